"""Scores of generated clips: those of Table II, the seam of Table IV, and the emotions that a classifier sees."""

from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.evaluation.emotion_tables import EmotionTally
from a2g_jax.evaluation.scores import METRICS
from a2g_jax.evaluation.set_scores import Reference, set_cell
from a2g_jax.metrics import beats, diversity, physical, pointwise
from a2g_jax.metrics.intervals import mean_interval, share_interval
from experiments.emotion_gesture.bench import FIRST, MADE, Bench, Made, positions

#: Clips whose motions are compared with each other for diversity.
_COMPARED = 100
Cell = dict[str, Any]


def scores_of(made: Made, bench: Bench, seed: int) -> dict[str, Any]:
    """``scores``, means over clips with 95 % intervals over recordings; ``emotions``, with a judge, counts of clips."""
    corpus, space = bench.corpus, bench.corpus.space
    places, target = positions(corpus, made), bench.places[:, None, FIRST:]
    clip_means = {
        "position_l2": space.scale * np.asarray(pointwise.position_l2(places, target)).mean(axis=1),
        "beat_alignment": _beat_alignment(places, bench),
        "wrist_speed": _wrists(physical.speeds, places, bench, np.mean),
        "jerk": _wrists(physical.jerk, places, bench, lambda values: np.percentile(values, 90)),
    }
    if space.has_rotations:
        clip_means["mpjre"] = _rotation_error(made, bench)
    if made.shape[1] > 1:
        clip_means["multimodality"] = np.array([space.scale * diversity.mean_pair_distance(one) for one in places])
    scores = {name: over_recordings(values, bench) for name, values in clip_means.items()}
    if len(made) > 1:
        step = max(1, len(places) // _COMPARED)
        scores["diversity"] = cell(space.scale * diversity.mean_pair_distance(places[::step, 0]))
    scores |= _distance(made, bench, seed) | seam(places, bench)
    if bench.ruler.judge is None:
        return {"clips": len(made), "scores": scores}
    shown, emotions = _emotions(made, bench)
    return {"clips": len(made), "scores": scores | shown, "emotions": emotions}


def cell(value: float, **more: Any) -> Cell:
    """A score without an interval."""
    return {"mean": float(value), "low": None, "high": None, "best": None, **more}


def over_recordings(values: Float[np.ndarray, " N"], bench: Bench) -> Cell:
    """Mean over clips, with its interval over recordings: clips of one are not independent."""
    found = mean_interval(values, bench.recordings).to_json()
    return {"mean": found["mean"], "low": found["low"], "high": found["high"], "best": None}


def _beat_alignment(places: Float[np.ndarray, "N S T P _"], bench: Bench) -> Float[np.ndarray, " N"]:
    fps = bench.corpus.fps
    sigma = beats.frames_to_seconds(beats.FLOW_SIGMA_FRAMES, fps)
    found = [
        np.mean([beats.beat_alignment(beats.motion_beats(s, fps, smoothing=2.0 / fps), onsets, sigma) for s in clip])
        if len(onsets)
        else np.nan
        for clip, onsets in zip(places, bench.onsets, strict=True)
    ]
    return np.array(found)


def _wrists(measure, places: Float[np.ndarray, "N S T P _"], bench: Bench, reduce) -> Float[np.ndarray, " N"]:
    wrists = bench.corpus.space.wrists(places.reshape(-1, *places.shape[-2:])).reshape(*places.shape[:3], -1, 3)
    return np.array([np.mean([reduce(np.asarray(measure(s, bench.corpus.fps))) for s in clip]) for clip in wrists])


def _rotation_error(made: Made, bench: Bench) -> Float[np.ndarray, " N"]:
    """Geodesic angle between local rotations, degrees, mean over frames, joints and samples."""
    read = lambda pose: bench.corpus.space.read(pose.reshape(-1, *pose.shape[-2:]))  # noqa: E731
    target = read(np.ascontiguousarray(bench.pose[:, FIRST:])).reshape(len(made), MADE, -1, 3, 3)
    found = []
    for number in range(made.shape[1]):
        rotations = read(np.ascontiguousarray(made[:, number])).reshape(target.shape)
        found.append(np.asarray(pointwise.joint_rotation_error(rotations, target)))
    return np.mean(found, axis=0)


def _distance(made: Made, bench: Bench, seed: int) -> dict[str, Cell]:
    """FGD, mean over samples, of one motion for every clip."""
    network = bench.ruler.network
    if network is None:
        return {}
    # Clips follow each other, and the network's own clips tile them.
    features = lambda pose: network.clip_features(pose.reshape(-1, *pose.shape[-2:]))  # noqa: E731
    reference = features(bench.pose[:, FIRST:])
    if len(reference) < 2:
        return {}
    # A vector counts to the recording of its middle.
    middles = ((np.arange(len(reference)) + 0.5) * network.clip_frames).astype(int)
    owners = np.repeat(bench.recordings, MADE)[middles]
    truth = Reference(reference, owners, np.zeros(len(reference), int), seed)
    found = set_cell(METRICS["fgd"], [features(made[:, k]) for k in range(made.shape[1])], truth)
    return {} if found is None else {"fgd": {**found, "best": None}}


def seam(places: Float[np.ndarray, "N S T P _"], bench: Bench) -> dict[str, Cell]:
    """Speed and jerk where the given poses end, relative to the recorded motion's at the same frames.

    Speeds are those of the steps to frames 10 and 11, jerks those of the three stretches of four frames with the step
    to frame 10: means over joints, clips and samples. ``seam_speed_error`` and ``seam_jerk_error`` are the distances of
    the ratios from 1, as absolute logarithms.
    """
    given = np.broadcast_to(bench.places[:, None, :FIRST], (*places.shape[:2], FIRST, *places.shape[3:]))
    ours, scores = np.concatenate([given, places], axis=2), {}
    stretches = {"seam_speed": (1, slice(FIRST - 1, FIRST + 2)), "seam_jerk": (3, slice(FIRST - 3, FIRST + 3))}
    for name, (order, rows) in stretches.items():
        size = [
            np.linalg.norm(np.diff(one[..., rows, :, :], n=order, axis=-3), axis=-1).mean()
            for one in (ours, bench.places)
        ]
        ratio = size[0] / max(size[1], 1e-9)
        scores |= {name: cell(ratio), f"{name}_error": cell(abs(np.log(max(ratio, 1e-9))))}
    return scores


def _emotions(made: Made, bench: Bench) -> tuple[dict[str, Cell], dict[str, Any] | None]:
    """Share of clips that the judge classifies as their own emotion, and the mean of these shares over emotions."""
    judge = bench.ruler.judge
    assert judge is not None
    tally = EmotionTally(judge.emotions)
    hits, counts = (np.zeros(len(bench.corpus.recordings), int) for _ in range(2))
    for number in range(made.shape[1]):
        rows = judge.probabilities(made[:, number].reshape(-1, *made.shape[-2:])).reshape(
            len(made), -1, len(judge.emotions)
        )
        for clip, emotion, recording in zip(rows, bench.emotions, bench.recordings, strict=True):
            if emotion in judge.emotions:
                tally.add(clip, emotion)
                hits[recording] += np.sum(np.argmax(clip, axis=-1) == judge.emotions.index(emotion))
                counts[recording] += len(clip)
    if not counts.any():
        return {}, None
    table, used = tally.counts, counts > 0
    found = share_interval(hits[used], counts[used]).to_json()
    recall = np.diag(table)[table.sum(axis=1) > 0] / table.sum(axis=1)[table.sum(axis=1) > 0]
    shown = {
        "emotion_accuracy": {"mean": found["mean"], "low": found["low"], "high": found["high"], "best": None},
        "emotion_balanced": cell(recall.mean(), chance=1.0 / len(recall)),
    }
    return shown, tally.to_json()
