"""A Transformer encoder with attention to a fixed number of frames (Audio2Gestures, extended, Sec. 6.2.4)."""

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.nn.conv import Dense


class LocalAttention(nn.Module):
    """One head of scaled dot-product attention to the frames at most ``reach`` away, before and after.

    Positions are encoded by a learned bias for each distance: the papers name no position encoding, and one of absolute
    frames would make the motion depend on where a window begins.
    """

    channels: int
    reach: int

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Float[Array, "B T D"]:
        query, key, value = (Dense(self.channels)(x) for _ in range(3))
        bias = self.param("distance_bias", nn.initializers.zeros_init(), (2 * self.reach + 1,))
        frames = jnp.arange(x.shape[1])
        distance = frames[None] - frames[:, None]
        near = jnp.abs(distance) <= self.reach
        offset = bias[jnp.clip(distance + self.reach, 0, 2 * self.reach)]
        scores = query @ jnp.swapaxes(key, 1, 2) / jnp.sqrt(jnp.asarray(self.channels, x.dtype))
        weights = jax.nn.softmax(jnp.where(near[None], scores + offset[None], -1e9), axis=-1)
        return weights @ value


class TransformerLayer(nn.Module):
    """Attention and two linear layers for each frame, both added to their input and normalised (Vaswani et al.)."""

    channels: int
    hidden: int
    reach: int
    dropout: float

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"], deterministic: bool) -> Float[Array, "B T C"]:
        y = nn.Dropout(self.dropout)(LocalAttention(self.channels, self.reach)(x), deterministic=deterministic)
        x = nn.LayerNorm()(x + y)
        y = nn.relu(Dense(self.channels)(nn.relu(Dense(self.hidden)(x))))
        y = nn.Dropout(self.dropout)(y, deterministic=deterministic)
        return nn.LayerNorm()(x + y)


class Transformer(nn.Module):
    """A linear layer to ``channels`` and encoder layers, each with attention over ``window`` frames.

    One frame of the output depends on ``layers * window / 2`` frames on either side.
    """

    layers: int = 5
    channels: int = 16
    hidden: int = 256
    window: int = 32
    dropout: float = 0.0

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"], deterministic: bool = True) -> Float[Array, "B T D"]:
        x = Dense(self.channels)(x)
        for _ in range(self.layers):
            x = TransformerLayer(self.channels, self.hidden, self.window // 2, self.dropout)(x, deterministic)
        return x
