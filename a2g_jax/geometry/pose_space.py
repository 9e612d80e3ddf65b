"""How a corpus writes down a pose: rotations of joints, directions of bones, or keypoints."""

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_layout import PoseLayout, PoseTrack
from a2g_jax.geometry.rotation import axis_angle_from_matrix, matrix_from_6d, matrix_from_axis_angle
from a2g_jax.geometry.skeleton import Skeleton

#: Values of each joint, bone or point. 6d: the first two columns of a local rotation matrix (Zhou et al. 2019);
#: exponential: axis times angle of a local rotation, radians, at most pi; directions: a unit vector from parent to
#: child; keypoints: where a point is in the image.
WIDTHS = {"6d": 6, "exponential": 3, "directions": 3, "keypoints": 2}

_exponential = jax.jit(axis_angle_from_matrix)
_rotations = jax.jit(matrix_from_axis_angle)


def represent(
    motion: Motion | PoseTrack, pose: str, where: str
) -> tuple[Float[np.ndarray, "T R D"], Skeleton | PoseLayout]:
    """Values of a motion, and what their rows are: joints of a skeleton, or points and bones.

    Args:
        pose: a key of :data:`WIDTHS`.
        where: the recording, for the error.

    Raises:
        InputError: such a motion does not tell such values.
    """
    if isinstance(motion, PoseTrack):
        if motion.kind != pose:
            raise InputError(f"{where}: holds {motion.kind}; prepare it with --pose {motion.kind}.")
        return np.asarray(motion.values, np.float32), motion.layout
    if pose == "directions":
        return _directions(motion)
    rotations = np.asarray(motion.rotations, np.float32)
    if pose == "6d":
        return np.swapaxes(rotations[..., :2], -1, -2).reshape(*rotations.shape[:2], 6), motion.skeleton
    if pose == "exponential":
        return np.asarray(_exponential(rotations)), motion.skeleton
    raise InputError(f"{where}: holds rotations of joints; prepare it with --pose 6d, exponential or directions.")


def rotations_from_rows(values: Float[np.ndarray, "T J D"], pose: str) -> Float[np.ndarray, "T J 3 3"]:
    """Rotation matrices of rows in a representation that tells rotations (``"6d"`` or ``"exponential"``)."""
    return np.asarray(matrix_from_6d(values) if pose == "6d" else _rotations(values))


def _directions(motion: Motion) -> tuple[Float[np.ndarray, "T B 3"], PoseLayout]:
    """The way from every joint's parent to it, in the world; joints that coincide with their parent are left out."""
    skeleton = motion.skeleton
    lengths = np.linalg.norm(np.asarray(skeleton.offsets), axis=-1)
    children = [joint for joint, parent in enumerate(skeleton.parents) if parent >= 0 and lengths[joint] > 1e-4]
    parents = [skeleton.parents[joint] for joint in children]
    places = motion.positions()
    vectors = places[:, children] - places[:, parents]
    layout = PoseLayout(
        skeleton.names, tuple(zip(parents, children, strict=True)), tuple(float(lengths[joint]) for joint in children)
    )
    return (vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)).astype(np.float32), layout
