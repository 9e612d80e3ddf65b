"""The losses of Audio2Gestures; equation numbers are the extended paper's.

Notation: B clips, T frames, J joints, C code channels; positions in metres, angles in radians. Every function takes
arrays and returns a scalar. Averages are over clips, frames and joints; norms over x, y, z are summed, as written in
the paper. (The authors' code differs in places; the notes of each function say where.)
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.geometry.rotation import geodesic_distance
from a2g_jax.models.audio2gestures.networks import Gaussian

Positions = Float[Array, "B T J _"]


def _joint_mean(per_joint: Float[Array, "B T J"], weights: Float[Array, " J"] | None) -> Float[Array, ""]:
    if weights is None:
        return jnp.mean(per_joint)
    return jnp.mean(per_joint @ (weights / jnp.sum(weights)))


def rotation_loss(
    predicted: Float[Array, "B T J 3 3"],
    target: Float[Array, "B T J 3 3"],
    joint_weights: Float[Array, " J"] | None = None,
) -> Float[Array, ""]:
    """Mean geodesic angle between rotation matrices (Eq. 2), radians."""
    return _joint_mean(geodesic_distance(predicted, target), joint_weights)


def position_loss(
    predicted: Positions, target: Positions, joint_weights: Float[Array, " J"] | None = None
) -> Float[Array, ""]:
    """Mean L1 distance of joint positions (Eq. 3), metres."""
    return _joint_mean(jnp.sum(jnp.abs(predicted - target), axis=-1), joint_weights)


def speed_loss(
    predicted: Positions, target: Positions, joint_weights: Float[Array, " J"] | None = None
) -> Float[Array, ""]:
    """Mean L1 distance of joint velocities, ``v_t = p_{t+1} - p_t`` (Eq. 4), metres a frame."""
    return position_loss(jnp.diff(predicted, axis=1), jnp.diff(target, axis=1), joint_weights)


def alignment_loss(audio_code: Float[Array, "B T C"], motion_code: Float[Array, "B T C"]) -> Float[Array, ""]:
    """L1 distance of the shared codes of audio and motion (Eq. 15), averaged over frames and channels."""
    return jnp.mean(jnp.abs(audio_code - motion_code))


def kl_loss(code: Gaussian) -> Float[Array, ""]:
    """KL divergence of a code's Gaussian from the standard normal (Eq. 18): summed over channels, a frame's average.

    The authors' code sums over time and averages over channels, so that its weight changes with the clip's length.
    """
    terms = jnp.exp(code.log_variance) + jnp.square(code.mean) - 1.0 - code.log_variance
    return 0.5 * jnp.mean(jnp.sum(terms, axis=-1))


def relaxed_loss(
    predicted: Positions, target: Positions, threshold: float, joint_weights: Float[Array, " J"] | None = None
) -> Float[Array, ""]:
    """Position loss beyond a tolerance, for motions sampled with a random specific code (Eq. 19), metres.

    The authors' code averages the distance over the entries above the threshold (NaN when there are none); this is
    the paper's ``max(|p^ - p|_1 - rho, 0)``.

    Args:
        threshold: rho, metres.
    """
    distance = jnp.sum(jnp.abs(predicted - target), axis=-1)
    return _joint_mean(jnp.maximum(distance - threshold, 0.0), joint_weights)


def bicycle_loss(code: Float[Array, "B T C"], recovered: Float[Array, "B T C"]) -> Float[Array, ""]:
    """L1 distance between a random specific code and the one encoded from its motion (Eq. 20).

    The model gives the code itself without its gradient and the mean of the encoded one: a target that could move
    towards its estimate would shrink to a constant. The paper does not say.
    """
    return jnp.mean(jnp.abs(code - recovered))


def diversity_loss(
    first: Positions, second: Positions, joint_weights: Float[Array, " J"] | None = None
) -> Float[Array, ""]:
    """Negative position distance of two motions sampled for the same clip (Eq. 21 as its text describes it), metres."""
    return -position_loss(first, second, joint_weights)
