"""A linear first layer: linear prediction of the next frame, and whitening of its errors.

Poses at 20 frames a second are almost linear functions of those before them, and couplings initialised to the identity
learn this very slowly to the accuracy that a density needs. So the first layer subtracts a linear extrapolation of each
channel and whitens the residual; both are fitted to the first batch, like actnorms (Glow, Sec. 3.1), and then trained.
The published flows have no such layer.

``y = L (x - x_1 - sum_k a_k (x_k - x_{k+1}) - b x_1)``, with x_k the pose k frames before, coefficients a_k and a pull
towards the mean pose b for every channel, and L lower triangular, so that the log-determinant is a sum. Without the
pull, long motions drift away from the mean pose, since each frame only adds to the previous one.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.nn.flow.broadcast import of_channels

Params = dict[str, Array]

#: Ridge on variances before division: a share of their mean, and an absolute minimum.
_RIDGE, _EPSILON = 1e-3, 1e-8
#: Bounds on the time constant of the pull, frames: fitted to one batch, it could vanish or change its sign.
_SLOWEST, _FASTEST = 500.0, 5.0
#: Not trained.
FIXED_SPREAD = "spread"


def init_predictor(history: int, channels: int) -> Params:
    """Parameters that predict the previous pose and leave errors as they are; training starts from those of
    :func:`fit_predictor`."""
    return {
        "coefficients": jnp.zeros((history - 1, channels)),
        "pull": jnp.zeros((channels,)),
        "lower": jnp.zeros((channels, channels)),
        "log_scale": jnp.zeros((channels,)),
        FIXED_SPREAD: jnp.ones((channels,)),
    }


def fit_predictor(x: Float[Array, "B T C"], poses: Float[Array, "B T history C"]) -> Params:
    """Least squares of every channel on its own differences and its last value, and the Cholesky factor of the errors'
    covariance."""
    channels = x.shape[-1]
    steps = _differences(poses).reshape(-1, poses.shape[2] - 1, channels)
    place = poses[:, :, -1].reshape(-1, channels)
    target = x.reshape(-1, channels) - place
    count = len(target)

    def one_channel(step: Float[Array, "n lags"], residual: Float[Array, " n"]) -> Float[Array, " lags"]:
        square = step.T @ step / count
        size = _RIDGE * jnp.mean(jnp.diag(square)) + _EPSILON
        return jnp.linalg.solve(square + size * jnp.eye(len(square)), step.T @ residual / count)

    coefficients = jax.vmap(one_channel, in_axes=(2, 1), out_axes=1)(steps, target)
    errors = target - jnp.sum(steps * coefficients[None], axis=1)
    slope = jnp.mean(errors * place, axis=0) / (jnp.mean(jnp.square(place), axis=0) + _EPSILON)
    pull = jnp.clip(slope, -1.0 / _FASTEST, -1.0 / _SLOWEST)
    errors = errors - place * pull[None]
    covariance = errors.T @ errors / count
    size = _RIDGE * jnp.mean(jnp.diag(covariance)) + _EPSILON
    factor = jnp.linalg.cholesky(covariance + size * jnp.eye(channels))
    whitening = jax.scipy.linalg.solve_triangular(factor, jnp.eye(channels), lower=True)
    diagonal = jnp.diag(whitening)
    return {
        "coefficients": coefficients,
        "pull": pull,
        # In units of each row's own scale, so that training steps have the same effect everywhere.
        "lower": jnp.tril(whitening / diagonal[:, None], -1),
        "log_scale": jnp.log(diagonal),
        FIXED_SPREAD: jnp.sqrt(jnp.mean(jnp.square(steps), axis=(0, 1))) + 1e-3,
    }


def expected(params: Params, poses: Float[Array, "*S history C"]) -> Float[Array, "*S C"]:
    """Linear extrapolation of poses, the oldest first."""
    coefficients = params["coefficients"]
    steps = _differences(poses)
    weights = coefficients.reshape((1,) * (steps.ndim - 2) + coefficients.shape)
    last = poses[..., -1, :]
    return last * (1.0 + of_channels(params["pull"], last)) + jnp.sum(steps * weights, axis=-2)


def predictor(params: Params, x: Float[Array, "*S C"], poses: Float[Array, "*S history C"]) -> Float[Array, "*S C"]:
    """Whitened errors of the extrapolation; its log-determinant is :func:`predictor_log_det`."""
    return (x - expected(params, poses)) @ whitening(params).T


def predictor_inverse(
    params: Params, y: Float[Array, "*S C"], poses: Float[Array, "*S history C"], unwhitening: Float[Array, "C C"]
) -> Float[Array, "*S C"]:
    """Inverse of :func:`predictor`.

    Args:
        unwhitening: from :func:`inverse_whitening`; compute it once for a sampling run.
    """
    return y @ unwhitening.T + expected(params, poses)


def whitening(params: Params) -> Float[Array, "C C"]:
    """The whitening matrix L."""
    channels = len(params["log_scale"])
    unit = jnp.tril(params["lower"], -1) + jnp.eye(channels, dtype=params["lower"].dtype)
    return jnp.exp(params["log_scale"])[:, None] * unit


def inverse_whitening(params: Params) -> Float[Array, "C C"]:
    """The inverse of L, by a triangular system."""
    matrix = whitening(params)
    inverse: Float[Array, "C C"] = jax.scipy.linalg.solve_triangular(
        matrix, jnp.eye(len(matrix), dtype=matrix.dtype), lower=True
    )
    return inverse


def predictor_log_det(params: Params) -> Float[Array, ""]:
    """Log-determinant of one frame, the same for all."""
    return jnp.sum(params["log_scale"])


def as_steps(params: Params, poses: Float[Array, "*S history C"]) -> Float[Array, "*S history C"]:
    """Poses as network input: the steps from pose to pose at a common scale, and the last pose."""
    steps = _differences(poses)
    spread = of_channels(jax.lax.stop_gradient(params[FIXED_SPREAD]), steps)
    return jnp.concatenate([steps / spread, poses[..., -1:, :]], axis=-2)


def _differences(poses: Float[Array, "*S history C"]) -> Float[Array, "*S lags C"]:
    """Steps from pose to pose, the oldest first."""
    return poses[..., 1:, :] - poses[..., :-1, :]
