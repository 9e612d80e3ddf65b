"""Forward kinematics: local joint rotations to joint positions (Audio2Gestures, Eq. 5)."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.geometry.skeleton import tree_levels


def global_rotations(rotations: Float[Array, "J 3 3"], parents: tuple[int, ...]) -> Float[Array, "J 3 3"]:
    """Orientation of every joint in the world, of one frame: ``R_world = R_world_parent @ R_local``."""
    return _chain(rotations, None, parents)[0]


def forward_kinematics(
    rotations: Float[Array, "J 3 3"], offsets: Float[Array | np.ndarray, "J 3"], parents: tuple[int, ...]
) -> Float[Array, "J 3"]:
    """Joint positions of one frame in metres, with the root joint at the origin.

    One gather or slice and one batched 3x3 product for each level of the tree: the formulation XLA runs fastest on
    CPU, forward and backward (4x4 homogeneous matrices are twenty times slower). vmap it over frames.

    Args:
        rotations: local rotation matrices, parent from joint.
        offsets: bone vectors in the parent's frame, metres; row 0 is ignored.
        parents: the tree; static.
    """
    return _chain(rotations, offsets, parents)[1]


def _chain(rotations, offsets, parents):
    levels = tree_levels(parents)
    world = _take(rotations, levels[0])
    place = jnp.zeros((1, 3), rotations.dtype)
    worlds, places = [world], [place]
    for above, level in zip(levels, levels[1:], strict=False):
        rows = tuple(above.index(parents[joint]) for joint in level)
        parent_world = _take(world, rows)
        if offsets is not None:
            place = _take(place, rows) + (parent_world @ offsets[np.array(level)][:, :, None])[:, :, 0]
            places.append(place)
        world = parent_world @ _take(rotations, level)
        worlds.append(world)
    # Levels concatenate to a permutation of the joints; undo it.
    order = tuple(int(row) for row in np.argsort([joint for level in levels for joint in level]))
    positions = _take(jnp.concatenate(places), order) if offsets is not None else None
    return _take(jnp.concatenate(worlds), order), positions


def _take(array, rows: tuple[int, ...]):
    """The given rows; as a slice where they are consecutive, since the gradient of a gather is a slow scatter."""
    if rows == tuple(range(rows[0], rows[0] + len(rows))):
        return array[rows[0] : rows[0] + len(rows)]
    return array[np.array(rows)]


def joint_positions(
    rotations: Float[Array, "*batch J 3 3"], offsets: Float[Array | np.ndarray, "J 3"], parents: tuple[int, ...]
) -> Float[Array, "*batch J 3"]:
    """:func:`forward_kinematics` over any leading axes (time, clips, samples), root at the origin."""
    batch = rotations.shape[:-3]
    flat = rotations.reshape((-1, *rotations.shape[-3:]))
    positions = jax.vmap(lambda frame: forward_kinematics(frame, offsets, parents))(flat)
    return positions.reshape((*batch, *positions.shape[1:]))
