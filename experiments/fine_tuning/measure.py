"""Statistics of motions for held-out speech, and how far they are from the person's own."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from a2g_jax.metrics.liveliness import Body, body_of, hands_at_rest, wrist_jerk, wrist_speeds
from experiments.fine_tuning.takes import Spoken


class Statistic(NamedTuple):
    """A column of the table."""

    title: str
    digits: int
    definition: str
    scale: float = 0.0
    """Difference that counts as much as a factor of two; 0 for statistics that are compared by their ratio."""


#: Of the hands and the posture; the last ones describe, and do not count for the distance.
STATISTICS: dict[str, Statistic] = {
    "speed_p50": Statistic("speed p50, m/s", 2, "median speed of the wrists relative to the pelvis"),
    "speed_p90": Statistic("p90", 2, "90th percentile of the same"),
    "speed_p99": Statistic("p99", 2, "99th percentile of the same"),
    "jerk_p50": Statistic("jerk p50, m/s3", 0, "median jerk of the wrists"),
    "jerk_p90": Statistic("p90", 0, "90th percentile of the same"),
    "rest": Statistic("rest, %", 1, "time in which both wrists are below 5 cm/s", 20.0),
    "height": Statistic("height, cm", 0, "mean height of the wrists above the pelvis", 20.0),
    "height_spread": Statistic("spread, cm", 1, "standard deviation of the same over time"),
    "radius": Statistic("radius, cm", 0, "mean horizontal distance of the wrists from the pelvis"),
    "posture": Statistic("posture, cm", 1, "mean distance of the joints' mean places from the person's", 10.0),
}
DESCRIBED: dict[str, Statistic] = {
    "agreement": Statistic("agreement", 3, "agreement of strokes with the speech, less the shifted motion's"),
    "between": Statistic("between samples, cm", 1, "mean distance of the wrists between two samples"),
}


def measure(parts: Sequence[Spoken]) -> dict[str, float]:
    """Statistics of all motions together; ``posture`` and the distance need the person's own.

    Args:
        parts: motions at one frame rate for one or more speeches.
    """
    bodies = [[body_of(motion) for motion in part.motions] for part in parts]
    every = [body for group in bodies for body in group]
    speed = np.concatenate([wrist_speeds(body).ravel() for body in every])
    jerks = np.concatenate([wrist_jerk(body).ravel() for body in every])
    wrists = np.concatenate([body.wrists for body in every])
    scores = [part.speech.agreement(motion) for part in parts for motion in part.motions]
    found = {
        **{f"speed_p{share}": float(np.percentile(speed, share)) for share in (50, 90, 99)},
        **{f"jerk_p{share}": float(np.percentile(jerks, share)) for share in (50, 90)},
        "rest": 100.0 * float(np.concatenate([hands_at_rest(body) for body in every]).mean()),
        "height": 100.0 * float(wrists[..., 1].mean()),
        "height_spread": 100.0 * float(np.mean([body.wrists[..., 1].std(axis=0).mean() for body in every])),
        "radius": 100.0 * float(np.linalg.norm(wrists[..., [0, 2]], axis=-1).mean()),
        "agreement": float(np.mean([score.value - score.null_mean for score in scores])),
    }
    pairs = [
        np.linalg.norm(first.wrists - second.wrists, axis=-1).mean()
        for group in bodies
        for number, first in enumerate(group)
        for second in group[number + 1 :]
    ]
    if pairs:
        found["between"] = 100.0 * float(np.mean(pairs))
    return found


def posture_distance(ours: Sequence[Spoken], person: Sequence[Spoken]) -> float:
    """Mean distance of the joints' mean places relative to the pelvis, cm, on one skeleton."""
    places = [
        np.mean([_mean_pose(body_of(motion)) for part in parts for motion in part.motions], axis=0)
        for parts in (ours, person)
    ]
    return 100.0 * float(np.linalg.norm(places[0] - places[1], axis=-1).mean())


def _mean_pose(body: Body) -> Any:
    """Mean places in the axes of the pelvis's mean heading, so that facing elsewhere is no other posture."""
    forward = body.pelvis[:, [0, 2], 2].sum(axis=0)
    sin, cos = forward / np.linalg.norm(forward)
    turn = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
    return body.local.mean(axis=0) @ turn.T


def distances(values: dict[str, float], person: dict[str, float]) -> dict[str, float]:
    """Distance of each statistic from the person's: 1 is a factor of two, or the statistic's own scale."""
    found = {}
    for name, statistic in STATISTICS.items():
        ours, theirs = values[name], person.get(name, 0.0)
        if statistic.scale:
            found[name] = abs(ours - theirs) / statistic.scale
        else:
            found[name] = abs(float(np.log2(max(ours, 1e-6) / max(theirs, 1e-6))))
    return found
