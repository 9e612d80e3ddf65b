"""Speed and jerk of the hands relative to the root, in NumPy: for the many short stretches around pinned clips."""

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.body_joints import find_wrists
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton


def local_places(motion: Motion) -> Float[np.ndarray, "T J 3"]:
    """Joint positions with the root at the origin, metres."""
    places = motion.positions()
    local: Float[np.ndarray, "T J 3"] = places - places[:, :1]
    return local


def hand_joints(skeleton: Skeleton) -> list[int]:
    """Both wrists; all joints where no wrists are found."""
    wrists = find_wrists(skeleton)
    return list(range(skeleton.joints)) if wrists is None else list(wrists)


def hand_speeds(places: Float[np.ndarray, "T J 3"], skeleton: Skeleton, fps: float) -> Float[np.ndarray, " t"]:
    """Speed of the faster hand, m/s, one value fewer than frames."""
    return _fastest(places, skeleton, 1) * fps


def hand_jerk(places: Float[np.ndarray, "T J 3"], skeleton: Skeleton, fps: float) -> Float[np.ndarray, " t"]:
    """Jerk of the hand with more of it, m/s3 (third differences), three values fewer than frames."""
    return _fastest(places, skeleton, 3) * fps**3


def _fastest(places: Float[np.ndarray, "T J 3"], skeleton: Skeleton, order: int) -> Float[np.ndarray, " t"]:
    if len(places) <= order:
        return np.zeros(0)
    steps = np.diff(places[:, hand_joints(skeleton)], n=order, axis=0)
    fastest: Float[np.ndarray, " t"] = np.linalg.norm(steps, axis=-1).max(axis=1)
    return fastest
