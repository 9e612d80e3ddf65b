"""Activation normalisation: a scale and a shift for every channel, set from the first batch (Glow, Sec. 3.1)."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.nn.flow.broadcast import of_channels

Params = dict[str, Array]

#: Added to standard deviations before division.
_EPSILON = 1e-6


def init_actnorm(channels: int) -> Params:
    """Parameters of the identity; training starts from those of :func:`fit_actnorm`."""
    return {"bias": jnp.zeros((channels,)), "log_scale": jnp.zeros((channels,))}


def fit_actnorm(x: Float[Array, "B T C"]) -> Params:
    """Parameters that normalise ``x`` to mean 0 and standard deviation 1 in every channel."""
    std = jnp.std(x, axis=(0, 1))
    return {"bias": -jnp.mean(x, axis=(0, 1)), "log_scale": -jnp.log(std + _EPSILON)}


def actnorm(params: Params, x: Float[Array, "*S C"]) -> Float[Array, "*S C"]:
    """``(x + bias) exp(log_scale)``; its log-determinant is :func:`actnorm_log_det`."""
    return (x + of_channels(params["bias"], x)) * jnp.exp(of_channels(params["log_scale"], x))


def actnorm_inverse(params: Params, y: Float[Array, "*S C"]) -> Float[Array, "*S C"]:
    """Inverse of :func:`actnorm`."""
    return y * jnp.exp(-of_channels(params["log_scale"], y)) - of_channels(params["bias"], y)


def actnorm_log_det(params: Params) -> Float[Array, ""]:
    """Log-determinant of one frame, the same for all."""
    return jnp.sum(params["log_scale"])
