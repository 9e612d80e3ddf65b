"""Semantic-relevance gesture recall: correct joints count more where words carry meaning (BEAT, Liu et al. 2022)."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Positions = Float[Array | np.ndarray, "T J D"]

#: Mean semantic relevance of BEAT, by which its authors' code divides.
BEAT_MEAN_RELEVANCE = 0.165


def srgr(
    predicted: Positions, target: Positions, relevance: Float[Array | np.ndarray, " T"], threshold: float = 0.1
) -> Float[Array, ""]:
    """Share of joints nearer than ``threshold`` to their targets, frames weighted by their relevance: 0 to 1.

    NaN where no frame is relevant, or a position is NaN.

    Args:
        relevance: weight of each frame, 0 or more.
        threshold: in the unit of the positions.
    """
    return jnp.sum(_correct(predicted, target, threshold) * relevance) / jnp.sum(jnp.asarray(relevance))


def srgr_published(
    predicted: Positions, target: Positions, relevance: Float[Array | np.ndarray, " T"], threshold: float = 0.1
) -> Float[Array, ""]:
    """SRGR as in BEAT's public code, to compare with its published numbers: not bounded by 1.

    ``mean_t (c_t w_t / 0.165)`` with c the share of correct joints: a perfect motion of fully relevant frames scores
    6.06.
    """
    return jnp.mean(_correct(predicted, target, threshold) * relevance) / BEAT_MEAN_RELEVANCE


def _correct(predicted: Positions, target: Positions, threshold: float) -> Float[Array, " T"]:
    distance = jnp.linalg.norm(jnp.asarray(predicted) - jnp.asarray(target), axis=-1)
    share = jnp.mean((distance < threshold).astype(distance.dtype), axis=-1)
    return jnp.where(jnp.any(jnp.isnan(distance), axis=-1), jnp.nan, share)
