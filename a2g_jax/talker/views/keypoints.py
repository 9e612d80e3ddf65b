"""View in the format of Speech2Gesture: 49 two-dimensional keypoints at 15 frames per second.

The layout of Ginosar et al. 2019 ("Learning Individual Styles of Conversational Gesture"), after their removal of nose
and eyes: 0 neck (the middle of the shoulders, as OpenPose has it), 1 to 3 right shoulder, elbow and wrist, 4 to 6 the
left ones, 7 to 27 the left hand and 28 to 48 the right hand, each as OpenPose orders it: wrist, then thumb, index,
middle, ring and little finger with four points from knuckle to tip. Pixels, x to the right of the image (where a
speaker who faces the camera has the left hand), y down.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion, resample
from a2g_jax.io.files import atomic_path
from a2g_jax.talker.views.landmarks import landmarks, require_fingers

WINDOW = 64
"""Frames in one training example of Speech2Gesture: 4.2 seconds."""
_RATE = 16000
_WOBBLE = 3.0


def _names() -> tuple[str, ...]:
    names = ["Neck_Mid"]
    names += [f"{side}_{joint}" for side in "RL" for joint in ("Shoulder", "Elbow", "Wrist")]
    for side in "LR":
        names.append(f"{side}_Wrist")
        for finger in ("Thumb", "Index", "Middle", "Ring", "Pinky"):
            names += [f"{side}_{finger}{number}" for number in (1, 2, 3)] + [f"{side}_{finger}3_End"]
    return tuple(names)


KEYPOINTS = _names()
"""The talker's landmark at each of the 49; wrists come twice, as the end of an arm and as the start of a hand."""


def _bones() -> tuple[tuple[int, int], ...]:
    bones = [(0, 1), (1, 2), (2, 3), (0, 4), (4, 5), (5, 6)]
    for elbow_end, wrist in ((6, 7), (3, 28)):
        bones.append((elbow_end, wrist))
        for finger in range(5):
            first = wrist + 1 + 4 * finger
            bones += [(wrist, first), *((first + number, first + number + 1) for number in range(3))]
    return tuple(bones)


KEYPOINT_BONES = _bones()
"""Pairs of keypoints to be joined in a drawing."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in front of the speaker, looking straight at them; the image's origin is its centre.

    A point ``d`` metres before the camera and ``x`` metres beside its axis shows ``focal * x / d`` pixels beside the
    centre. The defaults show shoulders 230 pixels wide, as in a medium shot of 1280 x 720.
    """

    focal: float = 2000.0
    """Focal length, pixels."""
    distance: float = 2.5
    """From the camera to the origin of the floor, metres."""
    height: float = 1.3
    """Of the camera over the floor, metres."""

    def project(self, points: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 2"]:
        """Pixels of points in the world (metres; x to the speaker's left, y up, z toward the camera)."""
        depth = self.distance - points[..., 2]
        x = self.focal * points[..., 0] / depth
        y = self.focal * (self.height - points[..., 1]) / depth
        return np.stack([x, y], axis=-1)


def keypoints(motion: Motion, fps: float = 15.0, camera: Camera = Camera()) -> Float[np.ndarray, "T 49 2"]:
    """The 49 keypoints relative to keypoint 0, pixels.

    Args:
        motion: of the talker with fingers.
        fps: frames per second of the result; frame k shows time ``k / fps``.

    Raises:
        InputError: the motion has no fingers.
    """
    require_fingers(motion)
    points = landmarks(resample(motion, fps))
    points["Neck_Mid"] = 0.5 * (points["L_Shoulder"] + points["R_Shoulder"])
    pixels = camera.project(np.stack([points[name] for name in KEYPOINTS], axis=1))
    return pixels - pixels[:, :1]


@dataclass(frozen=True)
class Detector:
    """Error model of a keypoint detector; the defaults are mild.

    A keypoint's error is the sum of jitter that is new in every frame and of a wobble smoothed over three frames, each
    of half the variance. Its standard deviation is ``jitter`` at rest (twice that for hands) and grows by ``blur``
    times the path of the point in a frame. A point is lost for a frame with probability ``loss`` (three times that
    for hands), twice that for a point that goes 30 pixels; it then stays at its last position, with confidence 0.
    """

    jitter: float = 0.6
    """Standard deviation of an arm's keypoint at rest, pixels on each axis."""
    blur: float = 0.06
    """Pixels of standard deviation for each pixel of movement in a frame."""
    loss: float = 0.004
    """Probability that an arm's keypoint is lost in a frame."""

    def detect(
        self, points: Float[np.ndarray, "T 49 2"], rng: np.random.Generator
    ) -> tuple[Float[np.ndarray, "T 49 2"], Float[np.ndarray, "T 49"]]:
        """Noisy keypoints and confidences in 0 to 1; keypoint 0 stays the origin and is never lost.

        A confidence is ``1 / (1 + e / 10)`` with the size of the point's error ``e`` in pixels, or 0.
        """
        frames = len(points)
        hand = np.where(np.arange(points.shape[1]) >= 7, 2.0, 1.0)
        speed = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=-1)
        spread = hand * self.jitter + self.blur * speed
        white = rng.standard_normal(points.shape)
        slow = ndimage.gaussian_filter1d(rng.standard_normal(points.shape), _WOBBLE, axis=0, mode="wrap")
        # A Gaussian window of s frames leaves 1 / (2 s sqrt(pi)) of white noise's variance.
        slow *= np.sqrt(2.0 * _WOBBLE * np.sqrt(np.pi))
        error = spread[..., None] * (white + slow) / np.sqrt(2.0)
        lost = rng.random(points.shape[:2]) < self.loss * (2.0 * hand - 1.0) * (1.0 + speed / 30.0)
        lost[0], lost[:, 0] = False, False
        error[:, 0] = 0.0
        detected = np.maximum.accumulate(np.where(lost, 0, np.arange(frames)[:, None]), axis=0)
        noisy = np.take_along_axis(points + error, detected[..., None], axis=0)
        confidence = 1.0 / (1.0 + np.linalg.norm(error, axis=-1) / 10.0)
        return noisy, np.where(lost, 0.0, confidence)


def write_s2g_windows(
    folder: str | os.PathLike[str],
    name: str,
    points: Float[np.ndarray, "T 49 2"],
    audio: Float[np.ndarray, " N"],
    sample_rate: int,
    fps: float = 15.0,
    stride: int = 5,
) -> list[Path]:
    """Write training examples in the layout of Speech2Gesture's own preparation.

    Each ``<name>-<first frame>.npz`` holds ``pose`` (64, 2, 49) in pixels and ``audio``, the 16 kHz samples from the
    time of its first frame to that of its last one: 67200 at 15 frames per second.

    Args:
        stride: frames between the starts of two examples; 5 in Speech2Gesture.

    Returns:
        The files, in order; none where there are fewer than 64 frames.

    Raises:
        InputError: the audio has another rate, or ends before the frames do.
    """
    if sample_rate != _RATE:
        raise InputError(f"{name}: has {sample_rate} Hz audio; Speech2Gesture's examples hold {_RATE} Hz.")
    paths = []
    for first in range(0, len(points) - WINDOW + 1, stride):
        begin, end = (round(frame * _RATE / fps) for frame in (first, first + WINDOW - 1))
        if end > len(audio):
            raise InputError(
                f"{name}: its audio ends at {len(audio) / _RATE:.2f} s, before its keypoints do; cut both to one take."
            )
        path = Path(folder) / f"{name}-{first:05d}.npz"
        pose = np.swapaxes(points[first : first + WINDOW], 1, 2)
        with atomic_path(path) as temporary:
            np.savez(temporary, pose=pose.astype(np.float64), audio=audio[begin:end].astype(np.float32))
        paths.append(path)
    return paths
