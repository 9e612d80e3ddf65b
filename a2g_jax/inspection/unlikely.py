"""The least likely moments of a motion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion

#: Least distance of two moments in seconds, and most moments in a report.
APART, MOST = 0.5, 8
#: A normal distribution's standard deviation over its median absolute deviation.
_ROBUST = 1.4826
#: A moment names up to three joints whose change of acceleration is at least this share of the largest.
_SHARE, _NAMED = 0.5, 3


@dataclass(frozen=True)
class Moment:
    """A frame that is less likely than its neighbourhood."""

    frame: int
    """Frame of the motion."""
    seconds: float
    log_likelihood: float
    """Log-likelihood of the frame, nats."""
    deviations: float
    """Robust standard deviations below the motion's median."""
    joints: tuple[str, ...]
    """Joints with the largest change of acceleration, the largest first."""


def robust_scale(values: Float[np.ndarray, " N"]) -> tuple[float, float]:
    """Median, and the standard deviation estimated from the median absolute deviation."""
    median = float(np.median(values))
    return median, _ROBUST * float(np.median(np.abs(values - median)))


def unlikely_moments(
    log_likelihood: Float[np.ndarray, " N"], first: int, motion: Motion, most: int = MOST
) -> list[Moment]:
    """The least likely frames, the least likely first, no two within :data:`APART` seconds.

    Args:
        log_likelihood: values of the frames from ``first`` on.
        first: frame of the first value.
        motion: the motion, on the run's skeleton and at its frame rate.
        most: limit of moments.
    """
    median, scale = robust_scale(log_likelihood)
    left = log_likelihood.astype(np.float64)
    found: list[Moment] = []
    changes, reach = acceleration_changes(motion), APART * motion.fps
    numbers = np.arange(len(left))
    while len(found) < most and np.isfinite(left).any():
        at = int(np.argmin(left))
        below = (median - float(left[at])) / max(scale, 1e-9)
        found.append(
            Moment(first + at, (first + at) / motion.fps, float(left[at]), below, _oddest(motion, changes, first + at))
        )
        left[np.abs(numbers - at) < reach] = np.inf
    return found


def acceleration_changes(motion: Motion) -> Float[np.ndarray, "T J"]:
    """Norm of the third difference of each joint's rotation matrix ending at a frame; zero for the first three."""
    rotations = np.asarray(motion.rotations, np.float32)
    sizes = np.zeros(rotations.shape[:2], np.float32)
    if motion.frames > 3:
        sizes[3:] = np.linalg.norm(np.diff(rotations, n=3, axis=0), axis=(-2, -1))
    return sizes


def _oddest(motion: Motion, changes: Float[np.ndarray, "T J"], frame: int) -> tuple[str, ...]:
    # Third differences that end at a frame or at the two after it contain it with weights of 1, 3 and 3.
    here = changes[frame : frame + 3].max(axis=0)
    order = np.argsort(-here, kind="stable")[:_NAMED]
    return tuple(motion.skeleton.names[joint] for joint in order if here[joint] > max(_SHARE * here[order[0]], 1e-6))
