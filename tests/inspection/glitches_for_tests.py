"""Glitches to inject into a motion, each with the frames that it is in."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.rotation import matrix_from_axis_angle


def flipped_wrist(motion: Motion, frame: int) -> tuple[Motion, slice]:
    """The left wrist turned by 180 degrees in one frame."""
    rotations = np.array(motion.rotations)
    joint = motion.skeleton.index("L_Wrist")
    rotations[frame, joint] = rotations[frame, joint] @ np.diag([1.0, -1.0, -1.0]).astype(np.float32)
    return replace(motion, rotations=rotations), slice(frame, frame + 1)


def jump(motion: Motion, frame: int) -> tuple[Motion, slice]:
    """A cut: from one frame on the motion of three seconds later."""
    rotations, gap = np.array(motion.rotations), round(3 * motion.fps)
    rotations[frame:-gap] = rotations[frame + gap :]
    return replace(motion, rotations=rotations), slice(frame, frame + 1)


def frozen(motion: Motion, frame: int) -> tuple[Motion, slice]:
    """A second that stands still, after which the motion continues where it would be."""
    rotations, stop = np.array(motion.rotations), frame + round(motion.fps)
    rotations[frame:stop] = rotations[frame]
    return replace(motion, rotations=rotations), slice(frame + 1, stop + 1)


def jitter(motion: Motion, frame: int) -> tuple[Motion, slice]:
    """Ten degrees of noise about random axes on all joints for half a second."""
    rotations, stop = np.array(motion.rotations), frame + round(0.5 * motion.fps)
    axes = np.random.default_rng(frame).normal(size=(stop - frame, rotations.shape[1], 3))
    axes *= np.deg2rad(10.0) / np.linalg.norm(axes, axis=-1, keepdims=True)
    rotations[frame:stop] = rotations[frame:stop] @ np.asarray(matrix_from_axis_angle(jnp.asarray(axes, jnp.float32)))
    return replace(motion, rotations=rotations), slice(frame, stop)


GLITCHES = {"flipped wrist": flipped_wrist, "jump": jump, "frozen": frozen, "jitter": jitter}
