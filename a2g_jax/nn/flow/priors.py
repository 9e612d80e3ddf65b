"""Priors over a flow's latents, one frame of C channels at a time."""

import math

import jax
import jax.numpy as jnp
from jax.scipy.special import gammaln
from jaxtyping import Array, Float, Key


def log_prob(z: Float[Array, "*S C"], freedom: float = 0.0) -> Float[Array, "*S"]:
    """Log-density of every frame.

    Args:
        freedom: degrees of freedom of a multivariate Student-t distribution with the identity as its scale; 0 for the
            standard normal distribution.
    """
    channels, square = z.shape[-1], jnp.sum(jnp.square(z), axis=-1)
    if freedom == 0:
        return -0.5 * (square + channels * math.log(2 * math.pi))
    constant = gammaln((freedom + channels) / 2) - gammaln(freedom / 2) - 0.5 * channels * math.log(math.pi * freedom)
    log_density: Float[Array, "*S"] = constant - 0.5 * (freedom + channels) * jnp.log1p(square / freedom)
    return log_density


def spread(normal: Float[Array, "*S C"], key: Key[Array, ""], freedom: float = 0.0) -> Float[Array, "*S C"]:
    """Samples of the prior from standard normal frames: a Student-t frame has one divisor for all channels."""
    if freedom == 0:
        return normal
    chi_square = 2.0 * jax.random.gamma(key, freedom / 2, normal.shape[:-1], normal.dtype)
    return normal * jnp.sqrt(freedom / chi_square)[..., None]
