"""Poses of finished motions in the numbers of each kind, as NumPy arrays: rows are joints, bones or points."""

from functools import partial

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.host_rotation import matrices_from_6d
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.rotation import (
    axis_angle_from_matrix,
    matrix_from_6d,
    matrix_from_axis_angle,
    matrix_from_yxz,
    matrix_to_6d,
    yxz_from_matrix,
)
from a2g_jax.geometry.skeleton import Skeleton

#: Between local rotation matrices and the kinds of poses that are rotations.
TO_MATRIX = {"6d": matrix_from_6d, "exponential": matrix_from_axis_angle, "euler": matrix_from_yxz}
FROM_MATRIX = {"6d": matrix_to_6d, "exponential": axis_angle_from_matrix, "euler": yxz_from_matrix}


def layout_rows(layout: PoseLayout, kind: str) -> int:
    """Rows of a pose without a skeleton: points for keypoints, bones for directions."""
    return len(layout.names if kind == "keypoints" else layout.bones)


def unit_vectors(values: Float[np.ndarray, "T R D"], kind: str, fallback: Float[np.ndarray, "T R D"]):
    """Interpolated values made valid again: directions of length 1, keypoints as they are.

    Args:
        fallback: values where an interpolated direction has no length.
    """
    if kind != "directions":
        return values
    length = np.linalg.norm(values, axis=-1, keepdims=True)
    return np.where(length > 1e-6, values / np.maximum(length, 1e-6), fallback)


def interchangeable(kind: str) -> tuple[str, ...]:
    """The kinds that a recording of one kind can be written in without loss; the kind itself first."""
    return tuple(FROM_MATRIX) if kind == "6d" else (kind,)


def write_motion(motion: Motion, kind: str, where: str) -> tuple[Float[np.ndarray, "T R D"], Skeleton | PoseLayout]:
    """Poses of a motion, and the body that their rows are of.

    Args:
        kind: a key of :data:`~a2g_jax.geometry.pose_kinds.WIDTHS`.
        where: the recording, for the error.

    Raises:
        InputError: keypoints, which a motion has none of.
    """
    if kind == "directions":
        return _directions(motion)
    rotations = np.asarray(motion.rotations, np.float32)
    if kind == "6d":
        return np.swapaxes(rotations[..., :2], -1, -2).reshape(*rotations.shape[:2], 6), motion.skeleton
    if kind in FROM_MATRIX:
        return np.asarray(_written(rotations, kind)), motion.skeleton
    raise InputError(
        f"{where}: holds rotations of joints; prepare it with --pose {', '.join(FROM_MATRIX)} or directions."
    )


def rotations_from_rows(values: Float[np.ndarray, "T J D"], kind: str) -> Float[np.ndarray, "T J 3 3"]:
    """Rotation matrices of poses that are rotations."""
    return matrices_from_6d(np.asarray(values)) if kind == "6d" else np.asarray(_matrices(values, kind))


@partial(jax.jit, static_argnums=1)
def _written(rotations, kind):
    return FROM_MATRIX[kind](rotations)


@partial(jax.jit, static_argnums=1)
def _matrices(values, kind):
    return TO_MATRIX[kind](values)


def _directions(motion: Motion) -> tuple[Float[np.ndarray, "T B 3"], PoseLayout]:
    """World directions from every joint's parent to the joint; joints that coincide with their parent are left out."""
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
