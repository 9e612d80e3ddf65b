"""Layers of the Transformer with attention to whole sequences (Vaswani et al. 2017), normalised after each addition."""

import jax
import jax.numpy as jnp
import numpy as np
from flax import linen as nn
from jaxtyping import Array, Float

_EPSILON = 1e-6
_XAVIER = nn.initializers.xavier_uniform()


def sinusoids(frames: int, channels: int) -> Float[np.ndarray, "frames channels"]:
    """Position encoding: sines and cosines of the frame's number, with periods from 2 pi to 20000 pi frames."""
    rates = 10000.0 ** (-2.0 * (np.arange(channels) // 2) / channels)
    angles = np.arange(frames)[:, None] * rates[None]
    return np.where(np.arange(channels)[None] % 2 == 0, np.sin(angles), np.cos(angles)).astype(np.float32)


class MultiHeadAttention(nn.Module):
    """Scaled dot-product attention of several heads; linear maps without bias, as in most code for it."""

    channels: int
    heads: int

    @nn.compact
    def __call__(self, query: Float[Array, "B N C"], memory: Float[Array, "B T D"]) -> Float[Array, "B N E"]:
        if self.channels % self.heads:
            raise ValueError(f"expected channels that the number of heads divides; got {self.channels}, {self.heads}")
        width = self.channels // self.heads

        def linear(x: Array) -> Array:
            y: Array = nn.Dense(self.channels, use_bias=False, kernel_init=_XAVIER)(x)
            return y

        def split(x: Array) -> Float[Array, "B S heads width"]:
            return x.reshape(*x.shape[:2], self.heads, width)

        q, k, v = split(linear(query)), split(linear(memory)), split(linear(memory))
        scores = jnp.einsum("bnhw,bthw->bhnt", q, k) / width**0.5
        mixed = jnp.einsum("bhnt,bthw->bnhw", jax.nn.softmax(scores, axis=-1), v)
        return linear(mixed.reshape(*query.shape[:2], self.channels))


class PostNormLayer(nn.Module):
    """Attention to a memory and two linear layers for each frame, both added to their input and then normalised.

    With the input itself as memory it is a layer of an encoder, otherwise one of a decoder without self-attention.
    """

    channels: int
    heads: int
    hidden: int
    dropout: float

    @nn.compact
    def __call__(
        self, x: Float[Array, "B N C"], memory: Float[Array, "B T C"], deterministic: bool
    ) -> Float[Array, "B N C"]:
        y = MultiHeadAttention(self.channels, self.heads)(x, memory)
        x = nn.LayerNorm(epsilon=_EPSILON)(x + nn.Dropout(self.dropout)(y, deterministic=deterministic))
        y = nn.relu(nn.Dense(self.hidden, kernel_init=_XAVIER)(x))
        y = nn.Dense(self.channels, kernel_init=_XAVIER)(y)
        normalised: Float[Array, "B N C"] = nn.LayerNorm(epsilon=_EPSILON)(
            x + nn.Dropout(self.dropout)(y, deterministic=deterministic)
        )
        return normalised


class Encoder(nn.Module):
    """Position encoding, dropout, and layers that attend to their own input."""

    layers: int
    heads: int
    hidden: int
    dropout: float

    @nn.compact
    def __call__(self, x: Float[Array, "B N C"], deterministic: bool) -> Float[Array, "B N C"]:
        channels = x.shape[-1]
        x = x + jnp.asarray(sinusoids(x.shape[1], channels), x.dtype)[None]
        x = nn.Dropout(self.dropout)(x, deterministic=deterministic)
        for _ in range(self.layers):
            x = PostNormLayer(channels, self.heads, self.hidden, self.dropout)(x, x, deterministic)
        return x
