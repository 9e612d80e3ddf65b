"""A causal convolutional network over time (Bai et al. 2018): a frame depends on itself and frames before it."""

import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

_XAVIER = nn.initializers.xavier_uniform()


class CausalConv1D(nn.Module):
    """Convolution of two taps: a frame and the one ``dilation`` frames before it, zero before the first."""

    features: int
    dilation: int = 1

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Float[Array, "B T D"]:
        earlier = jnp.pad(x, ((0, 0), (self.dilation, 0), (0, 0)))[:, : x.shape[1]]
        y: Float[Array, "B T D"] = nn.Dense(self.features, kernel_init=_XAVIER)(jnp.concatenate([earlier, x], axis=-1))
        return y


class CausalTCN(nn.Module):
    """Residual blocks of two convolutions, block i with dilation ``2 ** i``; the number of channels stays."""

    layers: int
    dropout: float

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"], deterministic: bool) -> Float[Array, "B T C"]:
        for block in range(self.layers):
            y = x
            for _ in range(2):
                y = nn.relu(CausalConv1D(x.shape[-1], 2**block)(y))
                y = nn.Dropout(self.dropout)(y, deterministic=deterministic)
            x = nn.relu(x + y)
        return x
