"""Faults of recorded motion, found and bridged: joints that jump from one frame to the next, bodies that spin."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage
from scipy.spatial.transform import Rotation, Slerp

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.liveliness import body_of, wrist_speeds

#: Fastest turn of a joint, degrees a second, and fastest wrist relative to the pelvis, m/s: twice as fast as people
#: move while they talk. What is faster is a fault of the recording.
FASTEST_TURN, FASTEST_WRIST = 1800.0, 8.0
#: Frames on either side of a jump that are replaced too: solvers and filters leave marks there.
_AROUND = 1
#: Heading of a standing talker stays within this range, degrees.
_LARGEST_HEADING = 60.0
#: Standard deviation of the Gaussian that separates turning about from sway, seconds.
_TURNING = 0.5


def joint_turns(motion: Motion) -> Float[np.ndarray, "t J"]:
    """Angle by which each joint turns in its parent's frame between frames, degrees; one frame fewer."""
    rotations = np.asarray(motion.rotations, np.float64)
    # The trace of R_t^T R_{t+1} is the sum of products of all entries.
    trace = np.einsum("tjab,tjab->tj", rotations[:-1], rotations[1:])
    return np.degrees(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))


def jumps(motion: Motion) -> Bool[np.ndarray, "t J"]:
    """Steps between frames in which a joint turns faster than 1800 degrees a second; all joints of a step in which a
    wrist is faster than 8 m/s."""
    found = joint_turns(motion) * motion.fps > FASTEST_TURN
    if motion.frames > 1 and find_body_joints(motion.skeleton) is not None:
        found |= (wrist_speeds(body_of(motion)) > FASTEST_WRIST).any(axis=1)[:, None]
    return found


def bridged(motion: Motion) -> tuple[Motion, int]:
    """The motion with jumping joints turned evenly (slerp) across their jumps, and the number of frames with a jump."""
    steps = jumps(motion)
    if not steps.any():
        return motion, 0
    rotations = np.array(motion.rotations, np.float64)
    for joint in np.flatnonzero(steps.any(axis=0)):
        bad = np.zeros(motion.frames, bool)
        bad[:-1] |= steps[:, joint]
        bad[1:] |= steps[:, joint]
        good = np.flatnonzero(~ndimage.binary_dilation(bad, iterations=_AROUND))
        if len(good) == 0:
            continue
        frames = np.clip(np.arange(motion.frames), good[0], good[-1])
        turns = Rotation.from_matrix(rotations[good, joint])
        rotations[:, joint] = (Slerp(good, turns)(frames) if len(good) > 1 else turns).as_matrix()
    count = int(steps.any(axis=1).sum())
    return replace(motion, rotations=rotations.astype(np.float32)), count


def without_turning(motion: Motion, facing: Float[np.ndarray, "3 3"]) -> tuple[Motion, float]:
    """A motion that faces one way, and the removed range of its heading in degrees.

    Where the heading, continued over full turns, stays within 60 degrees, the motion is unchanged and the range is 0.
    Otherwise the slow part of the turning is removed, and sway of a second or less stays.

    Args:
        facing: orientation of the root of a body that faces forward.
    """
    heading = _heading(motion, facing)
    turned = float(np.degrees(np.ptp(heading)))
    if turned <= _LARGEST_HEADING:
        return motion, 0.0
    # Reflected about the end values, so that a constant turn has no remainder at the ends.
    slow = ndimage.gaussian_filter1d(_extended(heading, motion.frames), _TURNING * motion.fps)
    slow = slow[motion.frames : 2 * motion.frames]
    cos, sin, zero, one = np.cos(slow), -np.sin(slow), np.zeros_like(slow), np.ones_like(slow)
    back = np.stack([cos, zero, sin, zero, one, zero, -sin, zero, cos], axis=-1).reshape(-1, 3, 3)
    rotations = np.array(motion.rotations)
    rotations[:, 0] = back @ rotations[:, 0]
    return replace(motion, rotations=rotations), turned


def tilt(motion: Motion, facing: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " T"]:
    """Angle between the vertical and the axis of the root that is vertical in ``facing``, degrees: 0 if upright."""
    cosine = _turns(motion, facing)[:, 1, 1]
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _turns(motion: Motion, facing: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "T 3 3"]:
    """Rotations of the root in the world from an orientation to those of the motion."""
    return np.asarray(motion.rotations[:, 0], np.float64) @ np.asarray(facing, np.float64).T


def _heading(motion: Motion, facing: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " T"]:
    forward = _turns(motion, facing)[:, :, 2]
    return np.unwrap(np.arctan2(forward[:, 0], forward[:, 2]))


def _extended(values: Float[np.ndarray, " T"], count: int) -> Float[np.ndarray, " S"]:
    """Values continued on either side by ``count`` of their point reflections."""
    return np.pad(values, count, mode="reflect", reflect_type="odd")
