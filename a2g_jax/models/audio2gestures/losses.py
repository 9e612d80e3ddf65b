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

#: Added to variances, for a finite gradient of their root.
_SPREAD_EPSILON = 1e-4


def alignment_loss(audio_code: Float[Array, "B T C"], motion_code: Float[Array, "B T C"]) -> Float[Array, ""]:
    """L1 distance of the shared codes of audio and motion (Eq. 15), averaged over frames and channels."""
    return jnp.mean(jnp.abs(audio_code - motion_code))


def kl_terms(code: Gaussian) -> Float[Array, "B T C"]:
    """KL divergence of each entry's Gaussian from the standard normal (Eq. 18), nats."""
    return 0.5 * (jnp.exp(code.log_variance) + jnp.square(code.mean) - 1.0 - code.log_variance)


def kl_loss(code: Gaussian, free_nats: float = 0.0) -> Float[Array, ""]:
    """KL divergence of a code's Gaussian from the standard normal (Eq. 18): summed over channels, a frame's average.

    The authors' code sums over time and averages over channels, so that its weight changes with the clip's length.

    Args:
        free_nats: divergence of a channel below which it has no gradient (free bits; Kingma et al. 2016).
    """
    per_channel = jnp.mean(kl_terms(code), axis=(0, 1))
    return jnp.sum(jnp.maximum(per_channel, free_nats) if free_nats > 0 else per_channel)


def spread_loss(code: Float[Array, "B T C"]) -> Float[Array, ""]:
    """Mean over channels of ``max(0, 1 - standard deviation)`` over clips and frames (VICReg's variance term).

    Zero for a code that is as wide as the standard normal, about 1 for a constant one.
    """
    std = jnp.sqrt(jnp.var(code, axis=(0, 1)) + _SPREAD_EPSILON)
    return jnp.mean(jnp.maximum(1.0 - std, 0.0))


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
