"""Scores of one motion for one stretch of a corpus, and of several for the same audio."""

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.evaluation.feature_network import FeatureNetwork
from a2g_jax.geometry.body import find_body
from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.rotation import matrix_from_6d
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.metrics import beats, distribution, diversity, physical, pointwise, structural

Pose = Float[np.ndarray, "T J 6"]


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
    "speed_l1": Metric("speed L1", "cm/s", "lower", f"{_A2G}, Sec. 5.2.1", 1),
    "acceleration_l1": Metric("acceleration L1", "m/s2", "lower", f"{_A2G}, Sec. 5.2.1", 2),
    "pck": Metric("PCK at 20 cm", "", "higher", f"{_A2G}, Eq. 24"),
    "mpjre": Metric("joint rotation error", "degrees", "lower", "EmotionGesture", 1),
    "stft": Metric("STFT", "", "lower", f"{_A2G}, Eq. 6"),
    "ssim": Metric("SSIM", "", "higher", f"{_A2G}, Eq. 7"),
    "lpips": Metric("LPIPS", "", "lower", f"{_A2G}, Eq. 14", 1),
    "fgd": Metric("FGD", "", "lower", f"{_A2G}, Eq. 25", 2),
    "diversity": Metric("diversity", "cm", "truth", f"{_A2G}, Eq. 26", 2),
    "multimodality": Metric("multimodality", "cm", "truth", f"{_A2G}, Eq. 27", 2),
    "beat_alignment": Metric("beat alignment, motion to audio, 5 frames", "", "truth", "stylized flow"),
    "beat_alignment_audio": Metric("beat alignment, audio to motion, 0.1 s", "", "truth", "BEAT"),
    "speed_hellinger": Metric("wrist speeds, Hellinger", "", "lower", "GENEA"),
    "jerk": Metric("wrist jerk, 90th percentile", "m/s3", "truth", "GENEA", 0),
}
#: Metrics that are a number for each motion; the others are one for a clip, or one for all.
PER_SAMPLE = tuple(name for name in METRICS if name not in ("fgd", "multimodality"))

_THRESHOLD = 0.2


@dataclass(frozen=True, eq=False)
class Scorer:
    """Everything that scoring needs besides motions."""

    skeleton: Skeleton
    fps: float
    network: FeatureNetwork | None

    def positions(self, pose: Pose) -> Float[np.ndarray, "T J 3"]:
        """Joints in metres, the root at the origin."""
        return np.asarray(_positions(pose, np.asarray(self.skeleton.offsets, np.float32), self.skeleton.parents))

    def sample(self, pose: Pose, target: "Target") -> dict[str, float]:
        """Scores of one motion."""
        places, fps = self.positions(pose), self.fps
        scores: dict[str, Any] = dict(_against(places, target.places, pose, target.pose, fps))
        scores["diversity"] = 100 * _clip_distance(places)
        moves = beats.motion_beats(places, fps, smoothing=2.0 / fps)
        # Authors count five frames at fifteen a second.
        scores["beat_alignment"] = beats.beat_alignment(moves, target.onsets, beats.FLOW_SIGMA_FRAMES / fps)
        scores["beat_alignment_audio"] = beats.beat_alignment(target.onsets, moves, beats.BEAT_SIGMA)
        wrists = self.wrists(places)
        scores["jerk"] = float(np.percentile(np.asarray(physical.jerk(wrists, fps)), 90))
        theirs = np.asarray(physical.speeds(self.wrists(target.places), fps)).ravel()
        scores["speed_hellinger"] = distribution.speed_hellinger(
            np.asarray(physical.speeds(wrists, fps)).ravel(), theirs
        )
        if self.network is not None:
            scores["lpips"] = self._lpips(pose, target.pose)
        return {name: float(value) for name, value in scores.items()}

    def multimodality(self, poses: list[Pose]) -> float:
        """Mean distance of several motions for one audio from each other, cm."""
        if len(poses) < 2:
            return float("nan")
        return 100 * diversity.mean_pair_distance(np.stack([self.positions(pose) for pose in poses]))

    def features(self, pose: Pose) -> Float[np.ndarray, "n F"]:
        """Vectors for the Fréchet distance; none without a network."""
        return np.zeros((0, 1), np.float32) if self.network is None else self.network.clip_features(pose)

    def wrists(self, places: Float[np.ndarray, "T J 3"]) -> Float[np.ndarray, "T w 3"]:
        """Both wrists, or every joint of a rig without."""
        body = find_body(self.skeleton)
        if body is None:
            return places
        return places[:, [body[BODY_JOINTS.index(f"{side}_Wrist")] for side in "LR"]]

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
        return float(np.mean(np.asarray(structural.lpips(ours, theirs))))


@dataclass(frozen=True, eq=False)
class Target:
    """The truth of a stretch, and the onsets of its speech in seconds."""

    pose: Pose
    places: Float[np.ndarray, "T J 3"]
    onsets: Float[np.ndarray, " n"]


def _clip_distance(places: Float[np.ndarray, "T J 3"]) -> float:
    """Mean distance of a motion's clips from each other; NaN for a motion of one clip."""
    clips = diversity.clips_of(places)
    return diversity.mean_pair_distance(clips) if len(clips) > 1 else float("nan")


@partial(jax.jit, static_argnums=2)
def _positions(pose, offsets, parents):
    return joint_positions(matrix_from_6d(pose), offsets, parents)


@jax.jit
def _against(places, target, pose, target_pose, fps):
    """Everything that compares joint by joint, in one program."""
    flat = lambda array: array.reshape(array.shape[0], -1)  # noqa: E731
    return {
        "position_l1": 100 * pointwise.position_l1(places, target),
        "speed_l1": 100 * fps * pointwise.speed_l1(places, target),
        "acceleration_l1": fps**2 * pointwise.acceleration_l1(places, target),
        "pck": pointwise.pck(places, target, _THRESHOLD),
        "mpjre": pointwise.joint_rotation_error(matrix_from_6d(pose), matrix_from_6d(target_pose)),
        "stft": structural.stft_distance(flat(places), flat(target)),
        "ssim": structural.ssim(flat(places), flat(target)),
    }
