"""Motion reconstruction losses that several models share; equation numbers are the extended Audio2Gestures paper's.

Notation: B clips, T frames, J joints; positions in metres, angles in radians. Averages are over clips, frames and
joints; norms over x, y, z are summed, as written in the paper.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.geometry.rotation import geodesic_distance

Positions = Float[Array, "B T J _"]


def joint_mean(per_joint: Float[Array, "B T J"], weights: Float[Array, " J"] | None) -> Float[Array, ""]:
    """Mean over clips and frames of a weighted mean over joints."""
    if weights is None:
        return jnp.mean(per_joint)
    return jnp.mean(per_joint @ (weights / jnp.sum(weights)))


def rotation_loss(
    predicted: Float[Array, "B T J 3 3"],
    target: Float[Array, "B T J 3 3"],
    joint_weights: Float[Array, " J"] | None = None,
) -> Float[Array, ""]:
    """Mean geodesic angle between rotation matrices (Eq. 2), radians."""
    return joint_mean(geodesic_distance(predicted, target), joint_weights)


def position_loss(
    predicted: Positions, target: Positions, joint_weights: Float[Array, " J"] | None = None
) -> Float[Array, ""]:
    """Mean L1 distance of joint positions (Eq. 3), metres."""
    return joint_mean(jnp.sum(jnp.abs(predicted - target), axis=-1), joint_weights)


def speed_loss(
    predicted: Positions, target: Positions, joint_weights: Float[Array, " J"] | None = None
) -> Float[Array, ""]:
    """Mean L1 distance of joint velocities, ``v_t = p_{t+1} - p_t`` (Eq. 4), metres a frame."""
    return position_loss(jnp.diff(predicted, axis=1), jnp.diff(target, axis=1), joint_weights)
