"""Invertible 1x1 convolution with its matrix kept as an LU decomposition (Glow, Sec. 3.2, Eq. 10 and 11).

``W = P (L + I) (U + diag(sign exp(log_scale)))``: L strictly lower, U strictly upper; P and the signs stay as
initialised. So the log-determinant is a sum, and the inverse two triangular systems.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

Params = dict[str, Array]

#: Parameters that are not trained; their gradient is zero.
FIXED = ("permutation", "sign")


def init_invertible(key: Key[Array, ""], channels: int) -> Params:
    """Parameters of a random rotation."""
    rotation, _ = jnp.linalg.qr(jax.random.normal(key, (channels, channels)))
    permutation, lower, upper = jax.scipy.linalg.lu(rotation)
    diagonal = jnp.diag(upper)
    return {
        "permutation": permutation,
        "lower": jnp.tril(lower, -1),
        "upper": jnp.triu(upper, 1),
        "sign": jnp.sign(diagonal),
        "log_scale": jnp.log(jnp.abs(diagonal)),
    }


def _factors(params: Params) -> tuple[Array, Array, Array]:
    permutation, sign = (jax.lax.stop_gradient(params[name]) for name in FIXED)
    identity = jnp.eye(len(sign), dtype=params["lower"].dtype)
    lower = jnp.tril(params["lower"], -1) + identity
    upper = jnp.triu(params["upper"], 1) + jnp.diag(sign * jnp.exp(params["log_scale"]))
    return permutation, lower, upper


def weight(params: Params) -> Float[Array, "C C"]:
    """W, by which :func:`invertible` multiplies every frame: ``y = W x``."""
    permutation, lower, upper = _factors(params)
    return permutation @ lower @ upper


def inverse_weight(params: Params) -> Float[Array, "C C"]:
    """Inverse of :func:`weight`, by two triangular systems; compute it once for a sampling run."""
    permutation, lower, upper = _factors(params)
    half = jax.scipy.linalg.solve_triangular(lower, permutation.T, lower=True, unit_diagonal=True)
    inverse: Float[Array, "C C"] = jax.scipy.linalg.solve_triangular(upper, half, lower=False)
    return inverse


def invertible(params: Params, x: Float[Array, "*S C"]) -> Float[Array, "*S C"]:
    """``W x`` of every frame; its log-determinant is :func:`invertible_log_det`."""
    return x @ weight(params).T


def invertible_inverse(params: Params, y: Float[Array, "*S C"]) -> Float[Array, "*S C"]:
    """Inverse of :func:`invertible`."""
    return y @ inverse_weight(params).T


def invertible_log_det(params: Params) -> Float[Array, ""]:
    """Log-determinant of one frame, the same for all."""
    return jnp.sum(params["log_scale"])
