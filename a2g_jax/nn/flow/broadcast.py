"""Broadcasting of channel vectors over frames."""

import jax.numpy as jnp
from jaxtyping import Array


def of_channels(vector: Array, frames: Array) -> Array:
    """``vector`` (C,) with as many axes as ``frames`` (..., C)."""
    return jnp.expand_dims(vector, tuple(range(frames.ndim - 1)))
