"""All metrics of a report, in its order. ``docs/metrics.md`` is made from these records."""

from dataclasses import replace
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.features import similarity
from a2g_jax.metrics import beats, distribution, diversity, labels, physical, pointwise, semantic
from a2g_jax.metrics.context import ClipContext, MotionContext, PairContext, SetContext
from a2g_jax.metrics.registry import Metric

_A2G = "Audio2Gestures, extended"
_FLOW = "stylized flow"


def _flat(positions: Float[Array | np.ndarray, "T P D"]) -> Float[Array | np.ndarray, "T C"]:
    return positions.reshape(positions.shape[0], -1)


def _position_l1(pair: PairContext) -> Any:
    return pair.distance_scale * pointwise.position_l1(pair.positions, pair.target_positions, pair.weights)


def _position_l1_star(context: MotionContext) -> Any:
    if context.wrist_to_wrist is None:
        return None
    scaled = context.pair_scores["position_l1"] / context.size
    return scaled * pointwise.REFERENCE_WRIST_TO_WRIST / context.wrist_to_wrist


def _position_l2(pair: PairContext) -> Any:
    return pair.scale * pointwise.position_l2(pair.positions, pair.target_positions)


def _speed_l1(pair: PairContext) -> Any:
    return pair.speed_scale * pointwise.speed_l1(pair.positions, pair.target_positions, 1.0, pair.weights)


def _acceleration_l1(pair: PairContext) -> Any:
    return pair.acceleration_scale * pointwise.acceleration_l1(pair.positions, pair.target_positions, 1.0, pair.weights)


def _pck(pair: PairContext) -> Any:
    return pointwise.pck(pair.positions, pair.target_positions, pair.threshold, pair.weights)


_rotation_error = jax.jit(pointwise.joint_rotation_error)


def _mpjre(context: MotionContext) -> Any:
    if context.rotations is None or context.target_rotations is None:
        return None
    return _rotation_error(context.rotations, context.target_rotations)


def _stft(pair: PairContext) -> Any:
    return similarity.stft_distance(_flat(pair.positions), _flat(pair.target_positions))


def _ssim(pair: PairContext) -> Any:
    return similarity.ssim(_flat(pair.positions), _flat(pair.target_positions))


def _lpips(context: MotionContext) -> float | None:
    network = context.network
    if network is None:
        return None
    frames = network.clip_frames
    count = len(context.pose) // frames
    if count == 0:
        return float("nan")
    clips = [
        each[: count * frames].reshape(count, frames, *each.shape[1:]) for each in (context.pose, context.target_pose)
    ]
    ours, theirs = (
        [block.mean(axis=1, keepdims=True) for block in network.blocks(np.asarray(clip, np.float32))] for clip in clips
    )
    return float(np.mean(np.asarray(similarity.lpips(ours, theirs))))


def _fgd(split: SetContext) -> float | None:
    if len(split.reference) < 2:
        return None
    return distribution.frechet_distance(split.features, split.reference).value


def _diversity(context: MotionContext) -> float:
    return _mean_of_pairs(context, diversity.clips_of(context.weighted))


def _multimodality(clip: ClipContext) -> float:
    return _mean_of_pairs(clip.motions[0], clip.weighted)


def _mean_of_pairs(context: MotionContext, motions: Float[Array | np.ndarray, "N T P _"]) -> float:
    """Mean distance of pairs of motions in the units of a context; NaN for a single motion."""
    if len(motions) < 2:
        return float("nan")
    factor = diversity.paper_factor(len(motions)) if context.units.published_pairs else 1.0
    return context.distance_scale * factor * diversity.mean_pair_distance(motions)


def _beat_alignment(context: MotionContext) -> float:
    return beats.beat_alignment(context.beats, context.onsets, context.units.beat_tolerance(context.fps))


def _beat_alignment_audio(context: MotionContext) -> float:
    return beats.beat_alignment(context.onsets, context.beats, beats.BEAT_SIGMA)


def _srgr(context: MotionContext) -> Any:
    if context.relevance is None:
        return None
    return semantic.srgr(context.positions, context.target_positions, context.relevance, context.threshold / 2)


def _emotion_accuracy(context: MotionContext) -> float | None:
    return None if context.classifier is None else context.classifier.accuracy(context.pose, context.emotion)


def _l1_div(context: MotionContext) -> float:
    return context.scale * diversity.l1_div(context.positions, None)


def _grouped(split: SetContext) -> bool:
    return len(split.reference) >= 2 and 2 <= len(np.unique(split.speakers)) < len(split.speakers)


def _chi(split: SetContext) -> float | None:
    return labels.calinski_harabasz(split.features, split.speakers) if _grouped(split) else None


def _silhouette(split: SetContext) -> float | None:
    return labels.silhouette(split.features, split.speakers) if _grouped(split) else None


def _speed_hellinger(context: MotionContext) -> float | None:
    if not context.metres:
        return None
    ours, theirs = (
        np.asarray(physical.speeds(wrists, context.fps)).ravel() for wrists in (context.wrists, context.target_wrists)
    )
    return distribution.speed_hellinger(ours, theirs)


def _wrist_speed(context: MotionContext) -> float:
    return float(np.mean(np.asarray(physical.speeds(context.wrists, context.fps))))


def _jerk(context: MotionContext) -> float:
    return float(np.percentile(np.asarray(physical.jerk(context.wrists, context.fps)), 90))


#: Least and greatest values of metrics that have a greatest one; others are 0 or more.
_BOUNDS = {
    **dict.fromkeys(("pck", "beat_alignment", "beat_alignment_audio", "srgr", "emotion_accuracy"), (0.0, 1.0)),
    **{"speed_hellinger": (0.0, 1.0), "ssim": (-1.0, 1.0), "silhouette": (-1.0, 1.0)},
}
_MEAN_POSE = "Prefers the mean pose to other right motions for the same speech."

METRICS: dict[str, Metric] = {
    metric.key: replace(metric, bounds=_BOUNDS.get(metric.key, (0.0, float("inf"))))
    for metric in (
        Metric(
            "position L1", "cm", "lower", f"{_A2G}, Eq. 22", 2, key="position_l1", scope="pair", against_target=True,
            measures="L1 norm of a joint's position error, mean over frames and joints.",
            blind_spots=_MEAN_POSE, function=_position_l1,
        ),
        Metric(
            "position L1*", "cm", "lower", f"{_A2G}, Eq. 23", 2, key="position_l1_star", against_target=True,
            measures="Position L1 as on a skeleton whose wrists are 120.64 cm apart in T-pose, to compare skeletons of"
            " different size. Ours are 136.4 cm apart.",
            blind_spots="Those of position L1; not defined where wrists are not found.", function=_position_l1_star,
        ),
        Metric(
            "position L2", "cm", "lower", "EmotionGesture", 2, key="position_l2", scope="pair", against_target=True,
            measures="Distance of a joint from its target, mean over frames and joints.",
            blind_spots=_MEAN_POSE, function=_position_l2,
        ),
        Metric(
            "speed L1", "cm/s", "lower", f"{_A2G}, Sec. 5.2.1", 1, key="speed_l1", scope="pair", against_target=True,
            measures="Position L1 of velocities.",
            blind_spots="A motion at rest is better than a lively one that moves at other times.", function=_speed_l1,
        ),
        Metric(
            "acceleration L1", "m/s2", "lower", f"{_A2G}, Sec. 5.2.1", 2, key="acceleration_l1", scope="pair",
            against_target=True, measures="Position L1 of accelerations.",
            blind_spots="Mostly jitter and stillness: a motion at rest is better than a lively one.",
            function=_acceleration_l1,
        ),
        Metric(
            "PCK", "", "higher", f"{_A2G}, Eq. 24", key="pck", scope="pair", against_target=True,
            measures="Share of points within 20 cm of their targets; of keypoints within a fifth of the longer side of"
            " the box around the mean pose.",
            blind_spots=_MEAN_POSE, function=_pck,
        ),
        Metric(
            "joint rotation error", "degrees", "lower", "EmotionGesture", 1, key="mpjre", against_target=True,
            measures="MPJRE: geodesic angle between local rotations, mean over frames and joints.",
            blind_spots="All joints count alike: an error at the shoulder, which moves the whole arm, as much as one at"
            " the wrist. Not defined without rotations.", function=_mpjre,
        ),
        Metric(
            "STFT", "", "lower", f"{_A2G}, Eq. 6", key="stft", scope="pair", against_target=True,
            measures="Distance of short-time spectra of the coordinates.",
            blind_spots="Windows are compared in place: motion that is right at another time counts as wrong.",
            function=_stft,
        ),
        Metric(
            "SSIM", "", "higher", f"{_A2G}, Eq. 7", key="ssim", scope="pair", against_target=True,
            measures="Structural similarity of coordinates over time (Eq. 7 to 13).",
            blind_spots="A pose that is held can score well where the recorded motion rests.", function=_ssim,
        ),
        Metric(
            "LPIPS", "", "lower", f"{_A2G}, Eq. 14", 1, key="lpips", against_target=True,
            measures="Distance of a feature network's time-averaged features (Sec. 5.2.1), summed over blocks, mean"
            " over clips; with `--features`.",
            blind_spots="The order of time within a clip. Comparable only with the same feature network.",
            function=_lpips,
        ),
        Metric(
            "FGD", "", "lower", f"{_A2G}, Eq. 25", 2, key="fgd", distance=True, scope="set",
            measures="Fréchet distance of Gaussians through a feature network's vectors of made and recorded motion;"
            " with `--features`.",
            blind_spots="Does not look at the audio: another clip's motion, over a whole split, is the truth in another"
            " order and scores 0. Falls with the number of vectors; a dash where there are fewer than two for each"
            " feature. Comparable only with the same feature network.",
            function=_fgd,
        ),
        Metric(
            "diversity", "cm", "truth", f"{_A2G}, Eq. 26", 2, key="diversity",
            measures="L1 distance of the 50-frame clips of a motion from each other, mean over pairs.",
            blind_spots="Jitter and implausible motion raise it; the audio does not matter.", function=_diversity,
        ),
        Metric(
            "multimodality", "cm", "truth", f"{_A2G}, Eq. 27", 2, key="multimodality", scope="clip",
            measures="L1 distance of several motions for one clip from each other, mean over pairs.",
            blind_spots="Jitter and implausible motion raise it.", function=_multimodality,
        ),
        Metric(
            "beat alignment, motion to audio", "", "truth", _FLOW, key="beat_alignment",
            measures="Mean over motion beats of `exp(-d^2 / 2 sigma^2)`, d the distance to the nearest onset of the"
            " speech, sigma a tolerance in seconds: 1/6 by default (`--beat-sigma`), with `--units stylized-flow` the"
            " paper's 5 frames.",
            blind_spots="Has no zero: random beats come near the truth. A motion of few beats can score well.",
            function=_beat_alignment,
        ),
        Metric(
            "beat alignment, audio to motion, 0.1 s", "", "truth", "BEAT", key="beat_alignment_audio",
            measures="The same as a mean over onsets, with the distance to the nearest motion beat and sigma 0.1 s.",
            blind_spots="Has no zero, and the more motion beats there are, the higher it is.",
            function=_beat_alignment_audio,
        ),
        Metric(
            "SRGR", "", "higher", "BEAT, bounded form", key="srgr", against_target=True,
            measures="PCK at half its threshold with frames weighted by semantic relevance, 0 to 1; where recordings"
            " carry semantic labels.",
            blind_spots="Frames without labels.", function=_srgr,
        ),
        Metric(
            "emotion accuracy", "", "higher", "EmotionGesture", key="emotion_accuracy", outcome=True,
            measures="Share of clips whose own emotion a trained classifier finds most probable; with"
            " `--emotion-classifier`.",
            blind_spots="Whatever the classifier does not look at; its own errors count too.",
            function=_emotion_accuracy,
        ),
        Metric(
            "L1div", "cm", "truth", "BEAT", 0, key="l1_div",
            measures="L1 distance of joints from their own mean, mean over frames, summed over joints.",
            blind_spots="Jitter and drift raise it; rises with the number of joints.", function=_l1_div,
        ),
        Metric(
            "CHI of speakers", "", "truth", f"{_FLOW}, Table 3", 1, key="chi", scope="set",
            measures="Calinski-Harabasz index of speakers in the feature network's space: spread between over spread"
            " within, each by its degrees of freedom.",
            blind_spots="Rises with the number of vectors. Speakers that differ by skeleton or recording count as"
            " styles.", function=_chi,
        ),
        Metric(
            "silhouette of speakers", "", "truth", f"{_FLOW}, Table 3", key="silhouette", scope="set",
            measures="Mean silhouette of speakers in the feature network's space, -1 to 1.",
            blind_spots="As of CHI.", function=_silhouette,
        ),
        Metric(
            "wrist speeds, Hellinger", "", "lower", "GENEA", key="speed_hellinger",
            measures="Hellinger distance of the histograms of wrist speeds of motion and target, 0 to 1.",
            blind_spots="Does not look at when the hands move, nor at the pose. Not defined without metres.",
            function=_speed_hellinger,
        ),
        Metric(
            "wrist jerk, 90th percentile", "m/s3", "truth", "GENEA", 0, key="jerk",
            measures="90th percentile of the third derivative of wrist positions.",
            blind_spots="Smooth motion that has nothing to do with the speech is as good as the truth.",
            function=_jerk,
        ),
        Metric(
            "wrist speed", "m/s", "truth", "GENEA", 2, key="wrist_speed",
            measures="Mean speed of the wrists; of all points where wrists are not found.",
            blind_spots="Jitter raises it; the audio does not matter.", function=_wrist_speed,
        ),
    )
}  # fmt: skip
