"""Directions, frames and forward kinematics of poses, vectorised over frames in NumPy.

Every rig has its own tree, so a compiled kernel would be recompiled for every rig, which for one take costs more time
than it saves.
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.skeleton import tree_levels

Vector = Float[np.ndarray, "*batch 3"]
Matrix = Float[np.ndarray, "*batch 3 3"]


def world_rotations(
    rotations: Float[np.ndarray, "*t J 3 3"], parents: tuple[int, ...], only: Iterable[int] | None = None
) -> Float[np.ndarray, "*t J 3 3"]:
    """Orientation of every joint in the world from local rotations.

    Args:
        only: joints of which it is needed; NaN for all that are neither among them nor above them. All if None.
    """
    needed = set(range(len(parents))) if only is None else _with_parents(only, parents)
    world = np.array(rotations)
    if len(needed) < len(parents):
        world[..., [joint for joint in range(len(parents)) if joint not in needed], :, :] = np.nan
    for level in tree_levels(parents)[1:]:
        joints = [joint for joint in level if joint in needed]
        world[..., joints, :, :] = world[..., [parents[j] for j in joints], :, :] @ world[..., joints, :, :]
    return world


def _with_parents(joints: Iterable[int], parents: tuple[int, ...]) -> set[int]:
    found: set[int] = set()
    for joint in joints:
        while joint >= 0 and joint not in found:
            found.add(joint)
            joint = parents[joint]
    return found


def joint_places(
    world: Float[np.ndarray, "*t J 3 3"], offsets: Float[np.ndarray, "J 3"], parents: tuple[int, ...]
) -> Float[np.ndarray, "*t J 3"]:
    """Positions of every joint, the root at the origin, from orientations in the world."""
    places = np.zeros(world.shape[:-1], world.dtype)
    for level in tree_levels(parents)[1:]:
        joints, above = list(level), [parents[j] for j in level]
        bones = (world[..., above, :, :] @ offsets[joints].astype(world.dtype)[:, :, None])[..., 0]
        places[..., joints, :] = places[..., above, :] + bones
    return places


def unit(vector: Vector) -> Vector:
    """The vector with length 1; zero stays zero."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    return vector / np.where(length > 1e-9, length, 1.0)


def angle_between(first: Vector, second: Vector) -> Float[np.ndarray, "*batch"]:
    """Angle between two directions in degrees, exact near 0 and 180."""
    across = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.asarray(np.degrees(np.arctan2(across, np.sum(first * second, axis=-1))))


def rotation_angle(first: Matrix, second: Matrix) -> Float[np.ndarray, "*batch"]:
    """Angle between two rotations in degrees, exact near 0: from the chord, as the arccosine of the trace is not."""
    half_chord = np.linalg.norm(np.asarray(first) - np.asarray(second), axis=(-2, -1)) / np.sqrt(8.0)
    return np.asarray(np.degrees(2 * np.arcsin(np.clip(half_chord, 0.0, 1.0))))


def shortest_turn(start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation of least angle from one direction to another; any half turn for opposite directions."""
    start, end = unit(start), unit(end)
    cosine = float(start @ end)
    if cosine < -1 + 1e-9:
        axis = unit(np.cross(start, np.eye(3)[int(np.argmin(np.abs(start)))]))
        return 2 * np.outer(axis, axis) - np.eye(3)
    x, y, z = np.cross(start, end)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + cross + cross @ cross / (1 + cosine)


def frame_of(first: Float[np.ndarray, "3"], second: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Orthonormal columns: ``first``, the part of ``second`` perpendicular to it, and their cross product."""
    first = unit(first)
    second = unit(second - first * (first @ second))
    return np.stack([first, second, np.cross(first, second)], axis=1)


def between(start: Matrix, end: Matrix, weight: float) -> Matrix:
    """Interpolation of two rotations along the shorter arc, ``weight`` 0 (start) to 1 (end)."""
    turn = np.swapaxes(start, -1, -2) @ end
    skew = turn - np.swapaxes(turn, -1, -2)
    axis = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1) / 2
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, (np.trace(turn, axis1=-2, axis2=-1) - 1) / 2)
    # Half a turn has no shorter arc; sine is then 0 as well and the start is kept.
    axis = axis / np.where(sine > 1e-9, sine, 1.0)[..., None]
    x, y, z = np.moveaxis(axis, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape((*x.shape, 3, 3))
    part = (angle * weight)[..., None, None]
    return start @ (np.eye(3, dtype=start.dtype) + np.sin(part) * cross + (1 - np.cos(part)) * (cross @ cross))
