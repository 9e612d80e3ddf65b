"""The global encoder (Sec. 3.4, Fig. 4): conditioning poses and audio to one feature of a frame."""

from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.nn.conv import Conv1D, Dense
from a2g_jax.nn.strided import StridedConv1D


class WindowEncoder(nn.Module):
    """A TCN over the conditioning window of a frame, averaged over time.

    Layer normalisation replaces the authors' batch normalisation: it has no running statistics, and the feature of a
    frame does not depend on the batch.
    """

    channels: int
    blocks: int
    features: int
    strided_norm: bool = False
    """Whether the strided convolutions have a normalisation and a ReLU too, and all of them Kaiming's weights."""

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Float[Array, "B F"]:
        initial = nn.initializers.he_normal() if self.strided_norm else nn.initializers.xavier_uniform()
        x = self._after(StridedConv1D(self.channels, kernel_init=initial)(x))
        for _ in range(self.blocks):
            x = nn.relu(x + nn.LayerNorm()(Conv1D(self.channels, kernel_init=initial)(x)))
        return self._after(StridedConv1D(self.features, kernel_init=initial)(x)).mean(axis=1)

    def _after(self, x: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
        return nn.relu(nn.LayerNorm()(x)) if self.strided_norm else x


class Fusion(nn.Module):
    """Fully connected layers from both embeddings to the global feature."""

    hidden: int
    features: int

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Float[Array, "B T F"]:
        return Dense(self.features)(nn.relu(Dense(self.hidden)(nn.relu(Dense(self.hidden)(x)))))
