"""Networks of the emotion classifiers: an encoder over time, mean and spread over the clip, a perceptron."""

from collections.abc import Sequence

import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.nn.tcn import TCN


class AttentionEncoder(nn.Module):
    """Transformer encoder layers over a whole clip, with sinusoidal positions.

    Layers normalise their input (Xiong et al. 2020): with normalised outputs, as in Vaswani et al. 2017, training
    without a long warm-up stopped at a constant answer.
    """

    width: int
    layers: int
    heads: int
    dropout: float

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"], deterministic: bool = True) -> Float[Array, "B T D"]:
        x = nn.Dense(self.width)(x) + positions(x.shape[1], self.width)[None]
        for _ in range(self.layers):
            attention = nn.MultiHeadDotProductAttention(self.heads, dropout_rate=self.dropout)
            y = attention(nn.LayerNorm()(x), deterministic=deterministic)
            x = x + nn.Dropout(self.dropout)(y, deterministic=deterministic)
            y = nn.Dense(self.width)(nn.relu(nn.Dense(4 * self.width)(nn.LayerNorm()(x))))
            x = x + nn.Dropout(self.dropout)(y, deterministic=deterministic)
        return nn.LayerNorm()(x)


def positions(frames: int, width: int) -> Float[Array, "T D"]:
    """Sines, then cosines, of the frame number at wavelengths from 2 pi to 20000 pi frames."""
    half = width // 2
    rates = 10_000.0 ** (-jnp.arange(half) / max(half, 1))
    phase = jnp.arange(frames)[:, None] * rates[None]
    return jnp.concatenate([jnp.sin(phase), jnp.cos(phase)], axis=-1)


class ClipClassifier(nn.Module):
    """An encoder over time; mean and standard deviation over the clip; two linear layers."""

    channels: Sequence[int]
    hidden: int
    kernel_size: int
    dropout: float
    classes: int
    attention: AttentionEncoder | None = None
    """The encoder; residual convolutions of ``channels`` if None."""

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"], deterministic: bool = True) -> Float[Array, "B K"]:
        encoder = self.attention or TCN(self.channels, self.kernel_size, self.dropout)
        x = encoder(x, deterministic)
        # The epsilon keeps the gradient of the root finite where a channel is constant.
        deviation = jnp.sqrt(jnp.var(x, axis=1) + 1e-6)
        pooled = jnp.concatenate([jnp.mean(x, axis=1), deviation], axis=-1)
        hidden = nn.Dropout(self.dropout)(nn.relu(nn.Dense(self.hidden)(pooled)), deterministic=deterministic)
        logits: Float[Array, "B K"] = nn.Dense(self.classes)(hidden)
        return logits
