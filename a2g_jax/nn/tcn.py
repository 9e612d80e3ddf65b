"""The temporal convolutional network of Audio2Gestures (Sec. 5.3.2)."""

from collections.abc import Sequence

from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.nn.conv import Conv1D, Dense


class ResidualBlock(nn.Module):
    """Two dilated convolutions with ReLU and dropout, added to the input (1x1 convolution where channels change)."""

    features: int
    kernel_size: int
    dilation: int
    dropout: float

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"], deterministic: bool) -> Float[Array, "B T D"]:
        y = x
        for _ in range(2):
            y = nn.relu(Conv1D(self.features, self.kernel_size, self.dilation)(y))
            y = nn.Dropout(self.dropout)(y, deterministic=deterministic)
        if x.shape[-1] != self.features:
            x = Dense(self.features)(x)
        return nn.relu(x + y)


class TCN(nn.Module):
    """Residual blocks in sequence, block i with dilation ``2 ** i``; non-causal: past and future count alike."""

    channels: Sequence[int]
    kernel_size: int = 3
    dropout: float = 0.0

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"], deterministic: bool = True) -> Float[Array, "B T D"]:
        for block, features in enumerate(self.channels):
            x = ResidualBlock(features, self.kernel_size, 2**block, self.dropout)(x, deterministic)
        return x


def receptive_halo(blocks: int, kernel_size: int = 3) -> int:
    """Frames on either side that one output frame of a :class:`TCN` with this many blocks depends on."""
    return 2 * (kernel_size // 2) * sum(2**block for block in range(blocks))
