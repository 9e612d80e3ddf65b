"""Motions of other frame rates at the rate of the table, without kinks."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_rows import rotations_from_rows, write_motion


def smooth_resample(motion: Motion, fps: float) -> Motion:
    """The motion at another rate, by cubic splines through the 6D rotations and the root.

    Linear interpolation between the frames of a slower motion would have a kink at each of them, which would count as
    jerk. Frame k shows time ``k / fps``; times after the last frame show the last frame.
    """
    if motion.fps == fps:
        return motion
    times = np.arange(motion.frames) / motion.fps
    wanted = np.minimum(np.arange(round(motion.seconds * fps)) / fps, times[-1])
    rows, _ = write_motion(motion, "6d", "motion")
    between = CubicSpline(times, rows.reshape(motion.frames, -1))(wanted).reshape(len(wanted), *rows.shape[1:])
    root = CubicSpline(times, np.asarray(motion.root))(wanted)
    rotations = rotations_from_rows(between.astype(np.float32), "6d")
    return replace(motion, rotations=rotations, root=root.astype(np.float32), fps=float(fps))
