"""Motion as a cubic B-spline: a pose every few frames, and smooth motion through them.

Talking people move at a few hertz, and motion at 30 frames a second says little with each frame: a frame is almost a
linear function of those before it, and noise of a hundredth of its range is jerk beyond that of the motion. A spline
with a knot every ``stride`` frames has the bandwidth of the motion. ``knots`` is the least-squares fit, written as a
filter, ``curve`` its inverse: a spline's knots are those that it was drawn through.

Frame t lies between knots k = floor(t / stride) and k + 1, and depends on k - 1 to k + 2.
"""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

#: Knots on either side that the fit of a knot depends on; beyond, weights are below a thousandth.
_REACH = 10
#: Knots before and after the one of a frame's stretch, that the frame depends on.
BEFORE, AFTER = 1, 2


def taps(share: Float[Array, " T"]) -> Float[Array, "T 4"]:
    """Weights of the four knots around each frame.

    Args:
        share: of the way from one knot to the next, 0 to 1.
    """
    u = share[:, None]
    return (
        jnp.concatenate([(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3], axis=1) / 6.0
    )


@cache
def _fit(stride: int) -> np.ndarray:
    """Weights of the frames around a knot in its least-squares fit, far from the ends."""
    count = 2 * (_REACH + 6) + 1
    time = np.arange((count - 1) * stride + 1) / stride
    away = np.abs(time[:, None] - np.arange(count)[None])
    basis = np.where(away < 1, 2 / 3 - away**2 + away**3 / 2, np.where(away < 2, (2 - away) ** 3 / 6, 0.0))
    middle = count // 2
    row = np.linalg.pinv(basis)[middle]
    reach = _REACH * stride
    weights = row[middle * stride - reach : middle * stride + reach + 1]
    return weights / weights.sum()


def knots(x: Float[Array, "B T C"], stride: int) -> Float[Array, "B _ C"]:
    """Knots at frames 0, stride, 2 stride, ... of the spline nearest to a motion; its ends are held beyond it."""
    if stride == 1:
        return x
    reach = _REACH * stride
    padded = jnp.pad(x, ((0, 0), (reach, reach), (0, 0)), mode="edge")
    one_channel = jnp.swapaxes(padded, 1, 2).reshape(-1, padded.shape[1], 1)
    kernel = jnp.asarray(_fit(stride), x.dtype)[:, None, None]
    fitted = jax.lax.conv_general_dilated(
        one_channel, kernel, (stride,), "VALID", dimension_numbers=("NWC", "WIO", "NWC")
    )
    return jnp.swapaxes(fitted.reshape(x.shape[0], x.shape[2], -1), 1, 2)


def curve(coefficients: Float[Array, "B K C"], stride: int) -> Float[Array, "B _ C"]:
    """The ``stride * K`` frames of a spline from its first knot on; its ends are held beyond it."""
    if stride == 1:
        return coefficients
    around = jnp.pad(coefficients, ((0, 0), (BEFORE, AFTER), (0, 0)), mode="edge")
    return along(around, jnp.arange(stride * coefficients.shape[1]), stride)


def along(around: Float[Array, "B K C"], frames: Int[Array, " T"], stride: int) -> Float[Array, "B T C"]:
    """Frames of a spline whose first knot lies at frame ``-stride``."""
    first = frames // stride
    weights = taps((frames - first * stride) / stride).astype(around.dtype)
    return sum(around[:, first + number] * weights[None, :, number, None] for number in range(BEFORE + AFTER + 1))  # type: ignore[return-value]
