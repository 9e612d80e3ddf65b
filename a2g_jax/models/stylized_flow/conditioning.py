"""Conditioning of a frame: the poses before it and the audio around it."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from a2g_jax.models.stylized_flow.config import StylizedFlowConfig


def windows(x: Float[Array, "B T C"], frames: int) -> Float[Array, "B _ frames C"]:
    """Every stretch of ``frames`` frames, oldest first; ``T - frames + 1`` of them."""
    count = x.shape[1] - frames + 1
    return jnp.stack([x[:, first : first + count] for first in range(frames)], axis=2)


def pose_history(x: Float[Array, "B T C"], history: int, after: int) -> Float[Array, "B _ history C"]:
    """The poses before each of the frames from ``history`` to ``T - after``."""
    return windows(x[:, : x.shape[1] - 1 - after], history)


def inner(config: StylizedFlowConfig, x: Float[Array, "B M C"]) -> Float[Array, "B N C"]:
    """The poses of a clip that have the whole conditioning around them."""
    return x[:, config.history_frames : x.shape[1] - config.after]


def pose_mask(key: Key[Array, ""], share: float, shape: tuple[int, int, int]) -> Bool[Array, "B N history"]:
    """Mask of the conditioning poses that stay when a share of them is dropped (frame dropout)."""
    return jax.random.bernoulli(key, 1.0 - share, shape)
