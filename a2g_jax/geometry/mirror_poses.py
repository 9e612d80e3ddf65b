"""Mirroring of poses as arrays, for augmentation in training.

The same as :func:`a2g_jax.geometry.mirror.mirror`, joint by joint on local rotations: with ``B_j = A_m(j) K A_j^T`` of
that module, the reflection of the world cancels in all joints but the root,

    R_local_j(mirrored) = B_parent(j)^T R_local_m(j) B_j,    R_root(mirrored) = F R_root B_root.
"""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.mirror import FLIP, mirror_pairs
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.retarget.rig import find_rig


def pose_mirror(space: PoseSpace) -> Callable[[Float[Array, "B T R D"]], Float[Array, "B T R D"]]:
    """A function that exchanges left and right of poses, to be compiled with what follows it.

    Raises:
        InputError: poses without a skeleton, or a rig that is not recognised or not symmetric.
    """
    if not space.has_rotations:
        raise InputError(
            f"--mirror: exchanges left and right of a skeleton, and poses are {space.noun}; leave it out, or prepare"
            " the corpus with --pose 6d, exponential or euler."
        )
    rig = find_rig(space.skeleton, name="the corpus")
    partner, align = np.array(mirror_pairs(rig)), rig.align
    onto = align[partner] @ FLIP @ np.swapaxes(align, -1, -2)
    across = rig.world[:, 0]
    above = np.stack(
        [np.eye(3) - 2 * np.outer(across, across) if parent < 0 else onto[parent].T for parent in rig.skeleton.parents]
    )
    before, after = (jnp.asarray(array, jnp.float32)[None, None] for array in (above, onto))

    def mirrored(pose: Float[Array, "B T R D"]) -> Float[Array, "B T R D"]:
        rotations = space.rotations(pose)
        assert rotations is not None
        return space.from_rotations(before @ rotations[:, :, partner] @ after)

    return mirrored
