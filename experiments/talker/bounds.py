"""Expected values of the truth: multimodality, and scores of right and of unrelated motion.

    python -m experiments.talker.bounds [--takes 3] [--draws 20] [--seed 0]

Many right motions are drawn for each recording. Multimodality is the mean distance between two of them. A metric's
ceiling is its mean over right motions of the recording, its floor that over right motions of another recording of the
same speaker. Standard errors are over draws for one recording, and over recordings for a speaker and for all.
"""

import argparse
import math
from functools import partial
from typing import Any

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.metrics.rhythm import agreement, energy_peaks, speech_envelope, speed_peaks, wrist_speed
from a2g_jax.recording import Recording
from a2g_jax.talker.expectation import Estimate, bounds, expected_multimodality
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from experiments.talker.common import Part, cast_evenly, parallel, run_part, table

_WRISTS = [BODY_JOINTS.index("L_Wrist"), BODY_JOINTS.index("R_Wrist")]
SIGMA = 0.1
#: Seconds from a stroke's fastest moment to its syllable's energy peak, as in `experiments.motion`.
LEAD = 0.15
DISTANCES = {
    "wrists, mean distance, cm": "wrists",
    "22 joints, mean distance, cm": "joints",
    "22 joints, L1, cm": "l1",
}
SCORES = {
    "rhythm agreement": "rhythm",
    "positions to the recorded motion, L1, cm": "l1",
    "wrist jerk p90, m/s^3": "jerk",
}


def places(motion: Motion) -> np.ndarray:
    """Joint positions (T, J, 3) relative to the root, centimetres."""
    return 100 * (motion.positions() - np.asarray(motion.root)[:, None])


def distance(first: Motion, second: Motion, what: str) -> float:
    """Mean distance between two motions over frames and joints, centimetres."""
    apart = places(first) - places(second)
    if what == "l1":
        return float(np.abs(apart).sum(axis=-1).mean())
    lengths = np.linalg.norm(apart, axis=-1)
    return float(lengths[:, _WRISTS].mean() if what == "wrists" else lengths.mean())


def jerk(motion: Motion) -> float:
    """90th percentile of the wrists' third differences, m/s^3."""
    third = np.diff(motion.positions()[:, _WRISTS], n=3, axis=0) * motion.fps**3
    return float(np.percentile(np.linalg.norm(third, axis=-1), 90))


def score_function(recording: Recording, what: str) -> Any:
    """A metric of a motion for this recording."""
    if what == "jerk":
        return lambda motion, _: jerk(motion)
    if what == "l1":
        return lambda motion, target: distance(motion, target.motion, "l1")
    fps = recording.motion.fps
    envelope = speech_envelope(recording.audio, recording.sample_rate, fps, recording.motion.frames)
    speech = energy_peaks(envelope, fps)
    return lambda motion, _: agreement(speed_peaks(wrist_speed(motion), fps), speech, SIGMA, LEAD)


def measure(roles: tuple[dict[str, Any], dict[str, Any]], draws: int) -> dict[str, Any]:
    """All figures of one recording; the second role is another recording of the same speaker."""
    recording, other = (talk(**role) for role in roles)
    key = roles[0]["seed"]
    figures: dict[str, Any] = {"name": recording.name, "speaker": recording.speaker, "emotion": recording.emotion}
    figures["multimodality"] = {
        title: plain(expected_multimodality(recording, partial(distance, what=what), draws, key))
        for title, what in DISTANCES.items()
    }
    for title, what in SCORES.items():
        found = bounds(recording, other, score_function(recording, what), draws, key)
        figures.setdefault("scores", {})[title] = {"ceiling": plain(found.ceiling), "floor": plain(found.floor)}
    return figures


def plain(estimate: Estimate) -> list[float]:
    """Mean and standard error."""
    return [estimate.mean, estimate.standard_error]


def over(values: list[float]) -> list[float | None]:
    """Mean over recordings and its standard error."""
    error = float(np.std(values, ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else None
    return [float(np.mean(values)), error]


def gather(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Means of recordings."""
    return {
        "recordings": len(rows),
        "multimodality": {title: over([row["multimodality"][title][0] for row in rows]) for title in DISTANCES},
        "scores": {
            title: {end: over([row["scores"][title][end][0] for row in rows]) for end in ("ceiling", "floor")}
            for title in SCORES
        },
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many recordings and draws."""
    parser.add_argument("--takes", type=int, default=3, help="neutral recordings of each speaker, 2 or more")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--draws", type=int, default=20, help="right motions of each recording")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Bounds of each recording, each speaker and all."""
    roles = cast_evenly(options.takes, options.seconds, options.seed, emotions=("neutral",), rooms=False)
    groups = {name: [role for role in roles if role["speaker"] == name] for name in SPEAKERS}
    pairs = [(role, own[(i + 1) % len(own)]) for own in groups.values() for i, role in enumerate(own)]
    rows = parallel(partial(measure, draws=options.draws), pairs, options.workers)
    return {
        "draws": options.draws,
        "seconds": options.seconds,
        "recordings": rows,
        "all": gather(rows),
        "speakers": {name: gather([row for row in rows if row["speaker"] == name]) for name in groups},
    }


def _pm(value: list[float | None]) -> str:
    mean, error = value
    return f"{mean:.3g}" if error is None else f"{mean:.3g} ± {error:.2g}"


def tables(result: dict[str, Any]) -> str:
    """Multimodality, then ceilings and floors; mean and standard error."""
    columns = {**result["speakers"], "all": result["all"]}
    spread = [
        [title, *(_pm(group["multimodality"][title]) for group in columns.values()), _errors(result, title)]
        for title in DISTANCES
    ]
    scores = [
        [f"{title}: {end}", *(_pm(group["scores"][title][end]) for group in columns.values())]
        for title in SCORES
        for end in ("ceiling", "floor")
    ]
    size = (
        f"{len(result['recordings'])} neutral recordings of {result['seconds']:g} s, {result['draws']} right motions "
    )
    return (
        f"{size}of each; mean ± standard error over recordings.\n\n"
        + table(spread, ["true multimodality", *columns, "typical standard error of one recording"])
        + "\n"
        + table(scores, ["ceiling and floor", *columns])
    )


def _errors(result: dict[str, Any], title: str) -> float:
    return float(np.median([row["multimodality"][title][1] for row in result["recordings"]]))


PART = Part("bounds", "Multimodality, ceilings and floors", add_arguments, run, tables)

if __name__ == "__main__":
    run_part(PART)
