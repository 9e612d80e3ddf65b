"""The flow paper's two protocols: clips continued from their first poses (Sec. 4.1), and their scores (Sec. 4.2).

L1 distances are means over coordinates, as in the paper's tables.

TED: 42 frames at 15 fps, 12 given and 30 generated. Trinity: 120 frames at 20 fps, 5 given, 95 generated, and 20 of
lookahead. Only generated frames are scored. Every row of a table is scored on the same clips and frames, whatever
history it needs itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from a2g_jax.data.corpus import Corpus
from a2g_jax.evaluation.baselines import right_motions
from a2g_jax.evaluation.feature_network import vectors_of
from a2g_jax.evaluation.likelihood_clips import recordings_of
from a2g_jax.evaluation.row_names import HALVES
from a2g_jax.evaluation.scores import METRICS
from a2g_jax.evaluation.set_scores import Reference, halves_cell, set_cell
from a2g_jax.generation.continuation import continue_clips
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.metrics import beats, diversity, physical
from a2g_jax.metrics.intervals import mean_interval
from a2g_jax.metrics.pointwise import correct_within
from a2g_jax.training.run import Run
from experiments.tables.ruler import Ruler


@dataclass(frozen=True)
class Protocol:
    """Frames and clips that are generated and scored."""

    frames: int
    """Frames of a clip."""
    first: int
    """First generated frame."""
    last: int
    """One after the last generated frame."""
    most: int = 256
    """Maximum number of scored clips, evenly spread over the test split: FGD needs more vectors than features."""


TED = Protocol(42, 12, 42)
TRINITY = Protocol(120, 5, 100)
PROTOCOLS = {"ted": TED, "trinity": TRINITY}


def starts_of(corpus: Corpus, protocol: Protocol, split: str = "test") -> Int[np.ndarray, " N"]:
    """First rows of the clips that are scored."""
    rows = [
        row
        for segment in corpus.segments(split)
        for row in range(segment.start, segment.stop - protocol.frames + 1, protocol.frames)
    ]
    chosen = np.unique(np.linspace(0, len(rows) - 1, min(protocol.most, len(rows))).round().astype(int))
    return np.array(rows)[chosen]


def continued(protocol: Protocol) -> Any:
    """A score of runs for :func:`experiments.tables.runs.run_table`."""

    def score(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
        del name
        starts = starts_of(ruler.corpus, protocol)
        audio, pose = clips_of(ruler.corpus, protocol, starts)
        made = continue_clips(run, audio, pose, protocol.first, protocol.last, ruler.samples, seed)
        return {"clips": len(starts), "scores": scores_of(made, ruler, protocol, starts, seed)}

    return score


def clips_of(
    corpus: Corpus, protocol: Protocol, starts: Int[np.ndarray, " N"]
) -> tuple[Float[np.ndarray, "N T bands"], Float[np.ndarray, "N T R D"]]:
    """Audio and poses of whole clips."""
    cut = [slice(start, start + protocol.frames) for start in starts]
    return np.stack([corpus.audio[rows] for rows in cut]), np.stack([corpus.pose[rows] for rows in cut])


def scores_of(
    made: Float[np.ndarray, "N samples frames R D"],
    ruler: Ruler,
    protocol: Protocol,
    starts: Int[np.ndarray, " N"],
    seed: int,
) -> dict[str, dict[str, Any]]:
    """Means over clips with 95 % intervals over recordings, and the best of a clip's samples, averaged over clips."""
    corpus, space = ruler.corpus, ruler.corpus.space
    audio, pose = clips_of(corpus, protocol, starts)
    inner = slice(protocol.first, protocol.last)
    axes = ruler.units.axis_share(space.positions(pose[0][:1]).shape[-1])
    truth = [space.positions(one[inner]) for one in pose]
    onsets = [beats.mel_onsets(one[inner], corpus.fps) for one in audio]
    places = [[space.positions(sample) for sample in clip] for clip in made]
    names = ("position_l1", "pck", "beat_alignment", "jerk", "wrist_speed")
    per_clip: dict[str, list[list[float]]] = {name: [] for name in names}
    for clip, target, speech in zip(places, truth, onsets, strict=True):
        near = correct_within(target, space.metres)
        distance = [np.abs(sample - target) for sample in clip]
        per_clip["position_l1"].append([axes * space.scale * float(d.sum(-1).mean()) for d in distance])
        per_clip["pck"].append([float((np.sqrt((d**2).sum(-1)) < near).mean()) for d in distance])
        moves = [beats.motion_beats(sample, corpus.fps, smoothing=2.0 / corpus.fps) for sample in clip]
        sigma = beats.frames_to_seconds(beats.FLOW_SIGMA_FRAMES, corpus.fps)
        per_clip["beat_alignment"].append([beats.beat_alignment(m, speech, sigma) for m in moves if len(speech)])
        per_clip["jerk"].append([_jerk(space, sample, corpus.fps) for sample in clip])
        speeds = [physical.speeds(space.wrists(sample), corpus.fps) for sample in clip]
        per_clip["wrist_speed"].append([float(np.mean(np.asarray(speed))) for speed in speeds])
    recordings = recordings_of(corpus, starts)
    summary = {name: _summary(name, values, recordings) for name, values in per_clip.items()}
    if made.shape[1] > 1:
        spread = [axes * space.scale * diversity.mean_pair_distance(np.stack(clip)) for clip in places]
        summary["multimodality"] = {**mean_interval(np.array(spread), recordings).to_json(), "best": None}
    if len(made) > 1:
        # Between the first samples of different clips, as in the paper; not within a long motion.
        apart = axes * space.scale * diversity.mean_pair_distance(np.stack([clip[0] for clip in places]))
        summary["diversity"] = {"mean": apart, "low": None, "high": None, "best": None}
    if ruler.network is not None:
        features = lambda poses: np.concatenate([ruler.network.clip_features(one) for one in poses])  # noqa: E731
        reference = _reference(ruler, [one[inner] for one in pose], recordings, seed)
        cell = set_cell(METRICS["fgd"], [features(made[:, k]) for k in range(made.shape[1])], reference)
        assert cell is not None
        summary["fgd"] = cell
    return summary


def _reference(
    ruler: Ruler, poses: Sequence[Float[np.ndarray, "T R D"]], recordings: Int[np.ndarray, " N"], seed: int
) -> Reference:
    """Feature vectors of the recorded frames."""
    assert ruler.network is not None
    vectors = [ruler.network.clip_features(one) for one in poses]
    return Reference.of(vectors, recordings.tolist(), [""] * len(vectors), seed)


def check_vectors(ruler: Ruler, protocol: Protocol) -> None:
    """Refuse a feature network whose clips are longer than what is generated.

    Raises:
        InputError: fewer than two feature vectors.
    """
    if ruler.network is not None:
        clips = len(starts_of(ruler.corpus, protocol))
        vectors_of([protocol.last - protocol.first] * clips, ruler.network.clip_frames, str(ruler.corpus.path))


def _jerk(space: PoseSpace, places: Float[np.ndarray, "T P D"], fps: float) -> float:
    return float(np.percentile(np.asarray(physical.jerk(space.wrists(places), fps)), 90))


def _summary(name: str, values: list[list[float]], recordings: Int[np.ndarray, " N"]) -> dict[str, Any]:
    there = np.array([bool(row) for row in values])
    rows = [row for row in values if row]
    interval = mean_interval(np.array([np.mean(row) for row in rows]), recordings[there])
    best = {"position_l1": np.min, "pck": np.max}.get(name)
    return {**interval.to_json(), "best": None if best is None else float(np.mean([best(row) for row in rows]))}


def nulls(ruler: Ruler, protocol: Protocol, seed: int = 0) -> dict[str, dict[str, Any]]:
    """Scores of baselines: the truth, another right motion for the audio (generated corpora only), another clip's
    motion, the first pose held, the mean pose, and the FGD of two halves of the truth."""
    check_vectors(ruler, protocol)
    starts = starts_of(ruler.corpus, protocol)
    _, pose = clips_of(ruler.corpus, protocol, starts)
    inner = pose[:, protocol.first : protocol.last]
    mean = np.asarray(ruler.corpus.space.valid(jnp.asarray(ruler.corpus.statistics["pose"].mean)))
    right = right_clips(ruler, protocol, starts, seed)
    candidates = {
        "truth": inner[:, None],
        **({} if right is None else {"another right motion": right}),
        # A take may have a single clip.
        **({"another clip's motion": np.roll(inner, len(inner) // 2, axis=0)[:, None]} if len(inner) > 1 else {}),
        "first pose held": np.broadcast_to(pose[:, protocol.first - 1 : protocol.first], inner.shape)[:, None],
        "mean pose": np.broadcast_to(mean[None, None], inner.shape)[:, None],
    }
    rows = {
        name: scores_of(np.asarray(made, np.float32), ruler, protocol, starts, seed)
        for name, made in candidates.items()
    }
    if ruler.network is not None:
        reference = _reference(ruler, list(inner), recordings_of(ruler.corpus, starts), seed)
        rows[HALVES] = {"fgd": halves_cell(METRICS["fgd"], reference)}
    return rows


def right_clips(
    ruler: Ruler, protocol: Protocol, starts: Int[np.ndarray, " N"], seed: int
) -> Float[np.ndarray, "N samples frames R D"] | None:
    """Other right motions of the scored frames, drawn from the talker; None for real recordings.

    They are not continued from the clip's own first poses.
    """
    corpus, clips = ruler.corpus, {}
    for segment in corpus.segments("test"):
        inside = [int(start) for start in starts if segment.start <= start < segment.stop]
        if not inside:
            continue
        motions = right_motions(corpus, segment, ruler.samples, seed)
        if motions is None:
            return None
        for start in inside:
            first = start - segment.start
            rows = slice(first + protocol.first, first + protocol.last)
            clips[start] = np.stack([motion[rows] for motion in motions])
    return np.stack([clips[int(start)] for start in starts])
