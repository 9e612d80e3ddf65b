"""A residual network with squeeze-and-excitation over spectrograms (He et al. 2016; Hu et al. 2018).

Group normalisation (Wu and He 2018) stands in the place of batch normalisation: it has no running statistics, and a
sample's output does not depend on the other samples of its batch.
"""

from collections.abc import Sequence

import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

#: Channels that are normalised together.
_GROUP = 8
_XAVIER = nn.initializers.xavier_uniform()
_EPSILON = 1e-5


def group_norm(channels: int) -> nn.GroupNorm:
    """Group normalisation in groups of eight channels, or of all where eight do not divide their number."""
    groups = channels // _GROUP if channels % _GROUP == 0 else 1
    return nn.GroupNorm(num_groups=groups, epsilon=_EPSILON, use_fast_variance=False)


class SqueezeExcitation(nn.Module):
    """Each channel scaled by a factor from 0 to 1, which depends on the means of all channels."""

    reduction: int = 8

    @nn.compact
    def __call__(self, x: Float[Array, "B T F C"]) -> Float[Array, "B T F C"]:
        channels = x.shape[-1]
        squeezed = jnp.mean(x, axis=(1, 2))
        hidden = nn.relu(nn.Dense(max(1, channels // self.reduction), kernel_init=_XAVIER)(squeezed))
        scale = nn.sigmoid(nn.Dense(channels, kernel_init=_XAVIER)(hidden))
        return x * scale[:, None, None]


class SEBlock(nn.Module):
    """Two convolutions and squeeze-and-excitation, added to the input (1x1 convolution where its shape changes)."""

    channels: int
    stride: int = 1

    @nn.compact
    def __call__(self, x: Float[Array, "B T F C"]) -> Float[Array, "B T2 F2 D"]:
        y = group_norm(self.channels)(nn.relu(convolution(self.channels, stride=self.stride, bias=False)(x)))
        y = group_norm(self.channels)(convolution(self.channels, bias=False)(y))
        y = SqueezeExcitation()(y)
        if self.stride > 1 or x.shape[-1] != self.channels:
            x = group_norm(self.channels)(convolution(self.channels, 1, self.stride, bias=False)(x))
        return nn.relu(x + y)


class SEResNet(nn.Module):
    """Features of spectrograms: stages of blocks, each after the first at half the rate in time and frequency."""

    blocks: Sequence[int]
    channels: Sequence[int]
    stem: int = 1
    """Stride of the first convolution."""

    @nn.compact
    def __call__(self, x: Float[Array, "B T F"]) -> Float[Array, "B T2 F2 C"]:
        first = self.channels[0]
        y = group_norm(first)(nn.relu(convolution(first, stride=self.stem)(x[..., None])))
        for stage, (count, channels) in enumerate(zip(self.blocks, self.channels, strict=True)):
            for block in range(count):
                y = SEBlock(channels, 2 if stage > 0 and block == 0 else 1)(y)
        return y


def convolution(channels: int, size: int = 3, stride: int = 1, bias: bool = True) -> nn.Conv:
    """A convolution over time and frequency with symmetric zero padding."""
    pad = size // 2
    return nn.Conv(channels, (size, size), stride, padding=((pad, pad), (pad, pad)), use_bias=bias, kernel_init=_XAVIER)
