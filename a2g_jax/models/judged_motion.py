"""Poses as discriminators of motion take them."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.models.base import Data

#: Units of the input: of positions where they are metres, of z-scores otherwise, and of the numbers of rotations;
#: speeds are in three of the first a second.
_METRES, _SCORES, _TURNS, _SECONDS = 0.1, 1.0, 0.3, 3.0


def judged_motion(data: Data, pose: Float[Array, "B T R D"]) -> Float[Array, "B T D2"]:
    """Places and speeds of the joints, and the pose's own numbers: everything of order one.

    Args:
        pose: a network's output or recorded poses; made valid first, so that only the motion is judged.
    """
    rotations = data.space.rotations(pose)
    if rotations is None:
        places = data.pose_statistics.normalise(pose)
        values, unit = places, _SCORES
    else:
        places = data.space.joint_positions(rotations)
        # Not z-scores: a joint that hardly moves would give every generated motion away.
        values, unit = data.space.valid(pose, rotations) / _TURNS, _METRES
    speeds = jnp.diff(places, axis=1, append=places[:, -1:]) * (data.fps / (_SECONDS * unit))
    flat = lambda array: array.reshape(*array.shape[:2], -1)  # noqa: E731
    return jnp.concatenate([flat(places / unit), flat(speeds), flat(values)], axis=-1)
