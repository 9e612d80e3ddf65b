"""The losses of Audio2Gestures; equation numbers are the extended paper's.

Notation: B clips, T frames, J joints, C code channels; positions in metres, angles in radians. Every function takes
arrays and returns a scalar. Averages are over clips, frames and joints; norms over x, y, z are summed, as written in
the paper. (The authors' code differs in places; the notes of each function say where.)
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.models.audio2gestures.networks import Gaussian
from a2g_jax.models.motion_losses import Positions, joint_mean
from a2g_jax.models.motion_losses import position_loss as position_loss
from a2g_jax.models.motion_losses import rotation_loss as rotation_loss
from a2g_jax.models.motion_losses import speed_loss as speed_loss


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
    return joint_mean(jnp.maximum(distance - threshold, 0.0), joint_weights)


def bicycle_loss(code: Float[Array, "B T C"], recovered: Float[Array, "B T C"]) -> Float[Array, ""]:
    """L1 distance between a random specific code and the one encoded from its motion (Eq. 20).

    The model passes the code without its gradient and the mean of the encoded one: a target with a gradient would
    shrink to a constant. The paper does not specify this.
    """
    return jnp.mean(jnp.abs(code - recovered))


def diversity_loss(
    first: Positions, second: Positions, joint_weights: Float[Array, " J"] | None = None
) -> Float[Array, ""]:
    """Negative position distance of two motions sampled for the same clip (Eq. 21 as its text describes it), metres."""
    return -position_loss(first, second, joint_weights)
