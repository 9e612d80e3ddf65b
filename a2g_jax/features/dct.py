"""The discrete cosine transform over time, in blocks of a fixed number of frames."""

from functools import cache

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


@cache
def _basis(points: int) -> Float[np.ndarray, "points points"]:
    frame, band = np.arange(points) + 0.5, np.arange(points)
    rows = np.cos(np.pi * band[:, None] * frame[None] / points) * np.sqrt(2.0 / points)
    rows[0] /= np.sqrt(2.0)
    return rows


def block_dct(signal: Float[Array, "*batch T C"], points: int) -> Float[Array, "*batch T C"]:
    """Orthonormal DCT-II of every ``points`` frames: row ``b * points + k`` is band k of block b.

    Band k has ``k / 2`` periods per block. The transform is linear and preserves energy.

    Raises:
        ValueError: T is not a multiple of ``points``.
    """
    return _apply(signal, _basis(points))


def block_idct(bands: Float[Array, "*batch T C"], points: int) -> Float[Array, "*batch T C"]:
    """Inverse of :func:`block_dct`.

    Raises:
        ValueError: T is not a multiple of ``points``.
    """
    return _apply(bands, _basis(points).T)


def _apply(signal, matrix):
    points, frames = len(matrix), signal.shape[-2]
    if frames % points:
        raise ValueError(f"expected a multiple of {points} frames; got {frames}")
    blocks = signal.reshape(*signal.shape[:-2], frames // points, points, signal.shape[-1])
    return (jnp.asarray(matrix, signal.dtype) @ blocks).reshape(signal.shape)
