"""Capture noise on a motion: jitter, pops and dropouts, as in tracked markers and poses from video.

The talker itself moves smoothly. EmotionGesture's motion-smooth loss is meant for training data that jitter; here the
size of the jitter is set, and the motion without it is available.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion

_WOBBLE = 0.08
"""Standard deviation, seconds, of the Gaussian window that smooths the slow part of the noise."""
_WHITE = 0.3
"""Share of the noise's variance that is new in every frame."""
_POPS, _POP_SIZE = 0.4, 4.0
"""Pops a minute and joint at one degree, and their size in the joint's standard deviations."""
_DROPOUTS, _DROPOUT_SECONDS = 0.4, (0.1, 0.35)
"""Dropouts a minute and joint at one degree, and how long the joint then stays still, seconds."""


def joint_weights(parents: tuple[int, ...]) -> Float[np.ndarray, " J"]:
    """Noise of each joint relative to the strength: 0.3 at the root and 0.1 more for each joint down the tree.

    Of the talker: pelvis 0.3, chest 0.6, elbows 0.9, wrists 1, last finger joints 1.3.
    """
    weights: list[float] = []
    for parent in parents:
        weights.append(0.3 if parent < 0 else weights[parent] + 0.1)
    return np.array(weights)


def add_jitter(motion: Motion, degrees: float, rng: np.random.Generator, skate: float = 0.0) -> Motion:
    """The motion with capture noise on every joint's rotation, larger far from the root.

    Each joint is turned by a random rotation vector. Each of its three components has a standard deviation of
    ``degrees * joint_weights``, made of white noise (0.3 of the variance) and noise smoothed over 0.08 s (0.7). Pops,
    single frames with four times that noise, and dropouts, in which a joint stays still for 0.1 to 0.35 s and then
    jumps to its true rotation, come 0.4 times a minute and joint for every degree.

    At 30 frames per second the wrists' root-mean-square jerk (third difference of their position) grows by a factor of
    about 4 at half a degree, 7 at one, 18 at 2.5 and 35 at 5 degrees: means over one recording of each speaker; the
    liveliest grow by 0.6 times as much and the calmest by 1.5 times.

    Args:
        motion: on any skeleton.
        degrees: strength; 0 gives the motion itself.
        rng: source of the noise; the same state gives the same noise, and that of a joint does not depend on the
            joints after it.
        skate: standard deviation, metres, of a slow drift (1 s) of the root over the floor: feet slide by as much.

    Raises:
        ValueError: a negative strength or skate.
    """
    if not (degrees >= 0.0 and skate >= 0.0):
        raise ValueError(f"Expected degrees and skate of 0 or more; got {degrees} and {skate}.")
    weights = joint_weights(motion.skeleton.parents)
    streams = rng.spawn(len(weights) + 1)
    rotations, root = motion.rotations, motion.root
    if degrees > 0.0:
        noisy = np.array(rotations, np.float64)
        for joint, stream in enumerate(streams[1:]):
            noisy[:, joint] = _capture(noisy[:, joint], float(degrees * weights[joint]), degrees, motion.fps, stream)
        rotations = noisy.astype(np.float32)
    if skate > 0.0:
        drift = np.zeros((motion.frames, 3))
        drift[:, [0, 2]] = skate * _smooth_noise(streams[0], motion.frames, 2, motion.fps)
        root = (np.asarray(root) + drift).astype(np.float32)
    return replace(motion, rotations=rotations, root=root)


def _capture(
    rotations: Float[np.ndarray, "T 3 3"], spread: float, degrees: float, fps: float, rng: np.random.Generator
) -> Float[np.ndarray, "T 3 3"]:
    """One joint with noise of ``spread`` degrees, and its pops and dropouts."""
    frames = len(rotations)
    slow = _smooth_noise(rng, frames, 3, fps, _WOBBLE)
    vectors = np.sqrt(_WHITE) * rng.standard_normal((frames, 3)) + np.sqrt(1.0 - _WHITE) * slow
    pops = rng.random(frames) < _POPS * degrees / 60.0 / fps
    vectors[pops] = _POP_SIZE * rng.standard_normal((int(pops.sum()), 3))
    captured = rotations @ Rotation.from_rotvec(np.deg2rad(spread) * vectors).as_matrix()
    lost = _dropouts(rng, frames, degrees, fps)
    return captured[np.maximum.accumulate(np.where(lost, 0, np.arange(frames)))]


def _dropouts(rng: np.random.Generator, frames: int, degrees: float, fps: float) -> Bool[np.ndarray, " T"]:
    """Frames in which a joint is lost; never the first one."""
    count = rng.poisson(_DROPOUTS * degrees * frames / fps / 60.0)
    first = rng.integers(1, max(frames, 2), count)
    length = np.maximum(1, np.rint(rng.uniform(*_DROPOUT_SECONDS, count) * fps)).astype(np.int64)
    edges = np.zeros(frames + 1, np.int64)
    np.add.at(edges, np.minimum(first, frames), 1)
    np.add.at(edges, np.minimum(first + length, frames), -1)
    return np.cumsum(edges[:frames]) > 0


def _smooth_noise(
    rng: np.random.Generator, frames: int, channels: int, fps: float, seconds: float = 1.0
) -> Float[np.ndarray, "T C"]:
    """Gaussian noise of standard deviation 1, smoothed by a Gaussian window of ``seconds`` (its standard deviation)."""
    width = seconds * fps
    margin = int(np.ceil(4.0 * width))
    white = rng.standard_normal((frames + 2 * margin, channels))
    window = np.zeros(2 * margin + 1)
    window[margin] = 1.0
    window = ndimage.gaussian_filter1d(window, width)
    smooth = ndimage.convolve1d(white, window / np.sqrt(np.sum(window**2)), axis=0, mode="constant")
    return smooth[margin : margin + frames]
