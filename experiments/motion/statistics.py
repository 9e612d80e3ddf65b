"""The statistics of the table, each with its definition.

A row is a list of speeches with one or more motions each. Intervals are over speeches, 95 % by Student's t, and for FGD
by the jackknife.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from a2g_jax.evaluation.feature_network import FeatureNetwork
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import represent
from a2g_jax.metrics.distribution import Features, enough_vectors, frechet_distance, split_floor
from a2g_jax.metrics.intervals import Interval, mean_interval
from a2g_jax.metrics.liveliness import (
    Body,
    body_of,
    distance_between,
    feet_slide,
    hand_dominance,
    hands_at_rest,
    hands_together,
    pelvis_sway,
    speech_pauses,
    wrist_jerk,
    wrist_speeds,
    yaw_deviation,
)
from a2g_jax.metrics.pooled import jackknife, pooled_mean, pooled_quantile
from experiments.motion.speeches import Speech


class Statistic(NamedTuple):
    """A line of the table."""

    title: str
    unit: str
    digits: int
    definition: str


STATISTICS: dict[str, Statistic] = {
    "fgd": Statistic(
        "FGD",
        "",
        1,
        "Fréchet distance of the feature network's vectors (one for each clip of 128 frames, clips one after another)"
        " from the truth's; one motion of every speech at a time, mean over samples",
    ),
    "speed_p50": Statistic("wrist speed, p50", "m/s", 2, "median over frames and both wrists, relative to the pelvis"),
    "speed_p90": Statistic("wrist speed, p90", "m/s", 2, "90th percentile of the same"),
    "speed_p99": Statistic("wrist speed, p99", "m/s", 2, "99th percentile of the same"),
    "jerk_p50": Statistic("wrist jerk, p50", "m/s3", 0, "median of third differences, both wrists, not smoothed"),
    "jerk_p90": Statistic("wrist jerk, p90", "m/s3", 0, "90th percentile of the same"),
    "rest": Statistic("hands at rest", "% of time", 1, "both wrists below 5 cm/s, smoothed by a Gaussian of 0.05 s"),
    "rest_in_pauses": Statistic(
        "hands at rest in pauses", "% of pauses", 1, "the same in frames with no speech within 0.4 s"
    ),
    "rest_in_speech": Statistic("hands at rest in speech", "% of speech", 1, "the same in frames with speech"),
    "slower_in_pauses": Statistic(
        "wrist speed in pauses", "of that in speech", 2, "ratio of the mean speeds of both wrists"
    ),
    "between_joints": Statistic(
        "between samples, joints", "cm", 1, "mean distance of joints over pairs of motions for one speech"
    ),
    "between_wrists": Statistic("between samples, wrists", "cm", 1, "the same of the wrists"),
    "head_yaw": Statistic(
        "head yaw", "degrees", 1, "standard deviation within a speech of the head's heading relative to the pelvis"
    ),
    "hip_yaw": Statistic("hip yaw", "degrees", 1, "standard deviation within a speech of the pelvis's heading"),
    "sway": Statistic(
        "pelvis sway", "cm", 1, "standard deviation within a speech of the pelvis's place above the ankles, horizontal"
    ),
    "slide": Statistic("standing feet slide", "mm/s", 1, "speed along the floor of standing ankles and toes"),
    "agreement": Statistic(
        "agreement with speech",
        "",
        3,
        "mean over peaks of wrist speed of exp(-d^2 / 2 (0.1 s)^2), d from the nearest peak of energy (0.15 s later)",
    ),
    "agreement_null": Statistic("agreement, shifted", "", 3, "the same for the motion 1 to 5 s early or late"),
    "agreement_excess": Statistic("agreement less shifted", "", 3, "difference of the two"),
    "together": Statistic("hands move together", "", 2, "correlation of both wrists' speeds"),
    "dominance": Statistic("hand dominance", "", 2, "|r - l| / (r + l) of the wrists' mean speeds in a speech"),
    "listening": Statistic(
        "listening audit", "", 0, "does motion depend on the audio: silence, delay, another speaker, even loudness"
    ),
}
#: Of one motion, averaged over the samples of a speech and then over speeches.
_OF_BODY: dict[str, Callable[[Body], float]] = {
    "head_yaw": lambda body: yaw_deviation(body.head),
    "hip_yaw": lambda body: yaw_deviation(body.pelvis),
    "sway": pelvis_sway,
    "slide": feet_slide,
    "together": hands_together,
    "dominance": hand_dominance,
}
_QUANTILES = {
    "speed_p50": (wrist_speeds, 0.5),
    "speed_p90": (wrist_speeds, 0.9),
    "speed_p99": (wrist_speeds, 0.99),
    "jerk_p50": (wrist_jerk, 0.5),
    "jerk_p90": (wrist_jerk, 0.9),
}

Values = dict[str, dict[str, Any]]


def statistics(speeches: Sequence[Speech], motions: Sequence[Sequence[Motion]]) -> Values:
    """Every statistic but FGD and the audit: ``value``, ``low`` and ``high``.

    Args:
        motions: of each speech, all at one frame rate.
    """
    bodies = [[body_of(motion) for motion in group] for group in motions]
    found: dict[str, Interval] = {}
    for key, (function, share) in _QUANTILES.items():
        groups = [np.concatenate([function(body).ravel() for body in group]) for group in bodies]
        found[key] = pooled_quantile(groups, share)
    found |= _rest(speeches, bodies)
    for key, of_body in _OF_BODY.items():
        found[key] = mean_interval(np.array([np.mean([of_body(body) for body in group]) for group in bodies]))
    scores = [[speech.agreement(motion) for motion in group] for speech, group in zip(speeches, motions, strict=True)]
    for key, pick in (
        ("agreement", lambda one: one.value),
        ("agreement_null", lambda one: one.null_mean),
        ("agreement_excess", lambda one: one.value - one.null_mean),
    ):
        found[key] = mean_interval(np.array([np.mean([pick(one) for one in group]) for group in scores]))
    if min(len(group) for group in bodies) > 1:
        pairs = np.array([distance_between(group) for group in bodies])
        for number, key in enumerate(("between_joints", "between_wrists")):
            found[key] = mean_interval(pairs[:, number])
    return {key: as_json(interval) for key, interval in found.items()}


def _rest(speeches: Sequence[Speech], bodies: Sequence[Sequence[Body]]) -> dict[str, Interval]:
    """Rest, in all frames, in pauses and in speech, per cent; and the ratio of the speeds in pauses and in speech."""
    everywhere, paused, spoken, slow, fast = ([] for _ in range(5))
    for speech, group in zip(speeches, bodies, strict=True):
        fps, frames = group[0].fps, len(group[0].joints)
        pause, loud = speech_pauses(speech.envelope(fps, frames), fps)
        rest = np.stack([100.0 * hands_at_rest(body) for body in group])
        speed = np.stack([wrist_speeds(body).mean(axis=1) for body in group])
        everywhere.append(rest.ravel())
        paused.append(rest[:, pause].ravel())
        spoken.append(rest[:, loud].ravel())
        slow.append(speed[:, pause[1:]].ravel())
        fast.append(speed[:, loud[1:]].ravel())
    ratios = [a.mean() / max(b.mean(), 1e-9) if len(a) else np.nan for a, b in zip(slow, fast, strict=True)]
    return {
        "rest": pooled_mean(everywhere),
        "rest_in_pauses": pooled_mean(paused),
        "rest_in_speech": pooled_mean(spoken),
        "slower_in_pauses": mean_interval(np.array(ratios)),
    }


def as_json(interval: Interval) -> dict[str, Any]:
    """Value and interval, None where it is not defined."""
    low, high = ((float(end) if np.isfinite(end) else None) for end in (interval.low, interval.high))
    return {"value": float(interval.mean) if np.isfinite(interval.mean) else None, "low": low, "high": high}


def feature_vectors(network: FeatureNetwork, motions: Sequence[Sequence[Motion]]) -> list[list[Features]]:
    """Feature vectors of every motion."""
    kind = network.run.config.space.kind
    return [[network.clip_features(represent(motion, kind, "motion")[0]) for motion in group] for group in motions]


def fgd(vectors: list[list[Features]], reference: list[list[Features]]) -> dict[str, Any]:
    """FGD to the truth, with its numbers of vectors.

    Args:
        vectors: of each speech and sample.
        reference: of the truth, one motion of each speech.
    """

    def distance(chosen: Sequence[int]) -> float:
        target = np.concatenate([reference[one][0] for one in chosen])
        samples = range(min(len(group) for group in vectors))
        return float(
            np.mean(
                [frechet_distance(np.concatenate([vectors[one][k] for one in chosen]), target).value for k in samples]
            )
        )

    count, width = sum(len(group[0]) for group in reference), reference[0][0].shape[1]
    if not enough_vectors(count, width):
        return {"value": None, "low": None, "high": None, "vectors": count}
    return {**as_json(jackknife(distance, len(reference))), "vectors": count}


def halves(reference: list[list[Features]], seed: int) -> dict[str, Any]:
    """FGD between random halves of the truth's speeches: the floor, for half the number of vectors."""
    vectors = [group[0] for group in reference]
    owners = np.repeat(np.arange(len(vectors)), [len(group) for group in vectors])
    floor = split_floor(np.concatenate(vectors), np.random.default_rng(seed), owners=owners)
    return {"value": floor.value, "low": None, "high": None, "vectors": floor.samples}
