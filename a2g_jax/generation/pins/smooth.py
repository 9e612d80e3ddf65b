"""Resampling without corners: a linear path between frames has a jump of speed at each of them."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion, resample


def resample_smoothly(motion: Motion, fps: float, frames: int) -> Motion:
    """The motion at another rate by cubic splines of unit quaternions and of the root; frame k is at time ``k / fps``.

    Motions of fewer than four frames are resampled linearly, and beyond the last frame that frame is repeated.

    Args:
        frames: length of the result.
    """
    if motion.frames < 4 or motion.fps == fps:
        return resample(motion, fps, frames)
    where = np.minimum(np.arange(frames) * (motion.fps / fps), motion.frames - 1)
    knots = np.arange(motion.frames)
    turns = CubicSpline(knots, continuous_quaternions(np.asarray(motion.rotations)))(where)
    rotations = Rotation.from_quat(turns.reshape(-1, 4)).as_matrix().reshape(*turns.shape[:2], 3, 3)
    root = CubicSpline(knots, np.asarray(motion.root, np.float64))(where)
    return replace(motion, rotations=rotations.astype(np.float32), root=root.astype(np.float32), fps=float(fps))


def continuous_quaternions(rotations: Float[np.ndarray, "T J 3 3"]) -> Float[np.ndarray, "T J 4"]:
    """Unit quaternions (xyzw) of which none changes its sign from one frame to the next."""
    flat = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_quat().reshape(*rotations.shape[:2], 4)
    turned = np.sum(flat[1:] * flat[:-1], axis=-1) < 0.0
    signs = np.concatenate([np.zeros((1, flat.shape[1]), int), np.cumsum(turned, axis=0)]) % 2
    continuous: Float[np.ndarray, "T J 4"] = np.where(signs[..., None] == 1, -flat, flat)
    return continuous
