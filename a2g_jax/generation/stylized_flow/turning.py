"""Bodies that turn about, in clips for a flow whose training motion faces one way."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from a2g_jax.geometry.motion import Motion

#: Range of the heading of a standing talker, degrees.
_LARGEST_HEADING = 60.0
#: Standard deviation of the Gaussian that separates turning about from sway, seconds.
_TURNING = 0.5


def without_turning(motion: Motion, facing: Float[np.ndarray, "3 3"]) -> tuple[Motion, float]:
    """A motion that faces one way, and the removed range of its heading in degrees.

    Where the heading, continued over full turns, stays within 60 degrees, the motion is unchanged and the range is 0.
    Otherwise the slow part of the turning is removed, and sway of a second or less stays.

    Args:
        facing: orientation of the root of a body that faces forward.
    """
    # Rotations of the root in the world from the forward orientation.
    turns = np.asarray(motion.rotations[:, 0], np.float64) @ np.asarray(facing, np.float64).T
    heading = np.unwrap(np.arctan2(turns[:, 0, 2], turns[:, 2, 2]))
    turned = float(np.degrees(np.ptp(heading)))
    if turned <= _LARGEST_HEADING:
        return motion, 0.0
    # Reflected through the end values, so that of a constant turn nothing remains at the ends.
    frames = motion.frames
    around = np.pad(heading, frames, mode="reflect", reflect_type="odd")
    slow = ndimage.gaussian_filter1d(around, _TURNING * motion.fps)[frames : 2 * frames]
    cos, sin, zero, one = np.cos(slow), np.sin(slow), np.zeros_like(slow), np.ones_like(slow)
    back = np.stack([cos, zero, -sin, zero, one, zero, sin, zero, cos], axis=-1).reshape(-1, 3, 3)
    rotations = np.array(motion.rotations)
    rotations[:, 0] = back @ rotations[:, 0]
    return replace(motion, rotations=rotations), turned
