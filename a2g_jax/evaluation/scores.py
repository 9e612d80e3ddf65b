"""Scores of one motion for one stretch of a corpus, and of several for the same audio."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.evaluation.emotion_judge import EmotionJudge
from a2g_jax.evaluation.feature_network import FeatureNetwork
from a2g_jax.evaluation.places import Body, Points, Pose
from a2g_jax.features import similarity
from a2g_jax.metrics import beats, distribution, diversity, physical, pointwise, semantic


class Metric(NamedTuple):
    """What a score is called and how it is read."""

    title: str
    unit: str
    better: str
    """``"lower"``, ``"higher"``, or ``"truth"``: near what the truth has."""
    source: str
    digits: int = 3


_A2G = "Audio2Gestures, extended"
METRICS: dict[str, Metric] = {
    "position_l1": Metric("position L1", "cm", "lower", f"{_A2G}, Eq. 22", 2),
    "position_l1_star": Metric("position L1*", "cm", "lower", f"{_A2G}, Eq. 23", 2),
    "position_l2": Metric("position L2", "cm", "lower", "EmotionGesture", 2),
    "speed_l1": Metric("speed L1", "cm/s", "lower", f"{_A2G}, Sec. 5.2.1", 1),
    "acceleration_l1": Metric("acceleration L1", "m/s2", "lower", f"{_A2G}, Sec. 5.2.1", 2),
    "pck": Metric("PCK", "", "higher", f"{_A2G}, Eq. 24"),
    "mpjre": Metric("joint rotation error", "degrees", "lower", "EmotionGesture", 1),
    "stft": Metric("STFT", "", "lower", f"{_A2G}, Eq. 6"),
    "ssim": Metric("SSIM", "", "higher", f"{_A2G}, Eq. 7"),
    "lpips": Metric("LPIPS", "", "lower", f"{_A2G}, Eq. 14", 1),
    "fgd": Metric("FGD", "", "lower", f"{_A2G}, Eq. 25", 2),
    "diversity": Metric("diversity", "cm", "truth", f"{_A2G}, Eq. 26", 2),
    "multimodality": Metric("multimodality", "cm", "truth", f"{_A2G}, Eq. 27", 2),
    "beat_alignment": Metric("beat alignment, motion to audio, 5 frames", "", "truth", "stylized flow"),
    "beat_alignment_audio": Metric("beat alignment, audio to motion, 0.1 s", "", "truth", "BEAT"),
    "srgr": Metric("SRGR", "", "higher", "BEAT, bounded form"),
    "emotion_accuracy": Metric("emotion accuracy", "", "higher", "EmotionGesture"),
    "l1_div": Metric("L1div", "cm", "truth", "BEAT", 0),
    "chi": Metric("CHI of speakers", "", "truth", "stylized flow, Table 3", 1),
    "silhouette": Metric("silhouette of speakers", "", "truth", "stylized flow, Table 3"),
    "speed_hellinger": Metric("wrist speeds, Hellinger", "", "lower", "GENEA"),
    "jerk": Metric("wrist jerk, 90th percentile", "m/s3", "truth", "GENEA", 0),
}
#: Metrics that compare with the truth frame by frame or window by window; a report's first table.
AGAINST_TRUTH = (
    *("position_l1", "position_l1_star", "position_l2", "speed_l1", "acceleration_l1", "pck", "mpjre", "stft", "ssim"),
    *("lpips", "srgr"),
)
#: Metrics that are a number for each motion; the others are one for a clip, or one for all.
PER_SAMPLE = tuple(name for name in METRICS if name not in ("fgd", "multimodality", "chi", "silhouette"))


@dataclass(frozen=True, eq=False)
class Scorer:
    """Everything that scoring needs besides motions."""

    body: Body
    fps: float
    network: FeatureNetwork | None
    judge: EmotionJudge | None = None

    def sample(self, pose: Pose, target: "Target") -> dict[str, float]:
        """Scores of one motion."""
        body, fps = self.body, self.fps
        places = body.places(pose)
        scores: dict[str, Any] = dict(_against(places, target.places, body.near(target.places), fps, body.scale))
        rotations, theirs = body.rotations(pose), body.rotations(target.pose)
        if rotations is not None and theirs is not None:
            scores["mpjre"] = _rotation_error(rotations, theirs)
        reach = body.reach()
        if reach is not None:
            scores["position_l1_star"] = scores["position_l1"] * pointwise.REFERENCE_WRIST_TO_WRIST / reach
        if target.relevance is not None:
            scores["srgr"] = semantic.srgr(places, target.places, target.relevance, body.near(target.places) / 2)
        if self.judge is not None:
            scores["emotion_accuracy"] = self.judge.accuracy(pose, target.emotion)
        scores["diversity"] = body.scale * _clip_distance(places)
        scores["l1_div"] = body.scale * diversity.l1_div(places, None)
        moves = beats.motion_beats(places, fps, smoothing=2.0 / fps)
        # Authors count five frames at fifteen a second.
        scores["beat_alignment"] = beats.beat_alignment(moves, target.onsets, beats.FLOW_SIGMA_FRAMES / fps)
        scores["beat_alignment_audio"] = beats.beat_alignment(target.onsets, moves, beats.BEAT_SIGMA)
        wrists = body.wrists(places)
        scores["jerk"] = float(np.percentile(np.asarray(physical.jerk(wrists, fps)), 90))
        speeds = np.asarray(physical.speeds(body.wrists(target.places), fps)).ravel()
        ours = np.asarray(physical.speeds(wrists, fps)).ravel()
        if body.metres:
            scores["speed_hellinger"] = distribution.speed_hellinger(ours, speeds)
        if self.network is not None:
            scores["lpips"] = self._lpips(pose, target.pose)
        return {name: float(value) for name, value in scores.items()}

    def multimodality(self, poses: list[Pose]) -> float:
        """Mean distance of several motions for one audio from each other."""
        if len(poses) < 2:
            return float("nan")
        return self.body.scale * diversity.mean_pair_distance(np.stack([self.body.places(pose) for pose in poses]))

    def features(self, pose: Pose) -> Float[np.ndarray, "n F"]:
        """Vectors for the Fréchet distance; none without a network."""
        return np.zeros((0, 1), np.float32) if self.network is None else self.network.clip_features(pose)

    def _lpips(self, pose: Pose, target: Pose) -> float:
        """Between time-averaged features of clips (Sec. 5.2.1), summed over blocks, averaged over clips."""
        assert self.network is not None
        frames = self.network.clip_frames
        count = len(pose) // frames
        if count == 0:
            return float("nan")
        clips = [each[: count * frames].reshape(count, frames, *each.shape[1:]) for each in (pose, target)]
        ours, theirs = (
            [block.mean(axis=1, keepdims=True) for block in self.network.blocks(np.asarray(clip, np.float32))]
            for clip in clips
        )
        return float(np.mean(np.asarray(similarity.lpips(ours, theirs))))


@dataclass(frozen=True, eq=False)
class Target:
    """The truth of a stretch, the onsets of its speech in seconds, and what is known of it."""

    pose: Pose
    places: Points
    onsets: Float[np.ndarray, " n"]
    emotion: str = ""
    relevance: Float[np.ndarray, " T"] | None = None
    """Of each frame, how much its gesture means."""


def _clip_distance(places: Points) -> float:
    """Mean distance of a motion's clips from each other; NaN for a motion of one clip."""
    clips = diversity.clips_of(places)
    return diversity.mean_pair_distance(clips) if len(clips) > 1 else float("nan")


_rotation_error = jax.jit(pointwise.joint_rotation_error)


@jax.jit
def _against(places, target, near, fps, scale):
    """Everything that compares point by point, in one program."""
    flat = lambda array: array.reshape(array.shape[0], -1)  # noqa: E731
    return {
        "position_l1": scale * pointwise.position_l1(places, target),
        "position_l2": scale * pointwise.position_l2(places, target),
        "speed_l1": scale * fps * pointwise.speed_l1(places, target),
        "acceleration_l1": fps**2 * pointwise.acceleration_l1(places, target),
        "pck": pointwise.pck(places, target, near),
        "stft": similarity.stft_distance(flat(places), flat(target)),
        "ssim": similarity.ssim(flat(places), flat(target)),
    }
