"""An encoder of the audio in front of the couplings, shared by all of them.

The published couplings each take the mel bands of the whole audio window as they are; a small recurrent layer learns
little of them. Here dilated convolutions with residual connections give an embedding of every frame, and a pose is
conditioned on that of its own frame and on one ahead: half a second is the time in which a stroke is prepared.
"""

import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.models.stylized_flow.config import AHEAD, REACH
from a2g_jax.nn.conv import Conv1D

#: Kernel size and dilation of each convolution.
_LAYERS = ((5, 1), (5, 2), (5, 4), (3, 8))
assert sum(kernel // 2 * dilation for kernel, dilation in _LAYERS) == REACH


class AudioEncoder(nn.Module):
    """Embeddings (B, T, 2 channels) of audio (B, T, bands): of every frame, and of one ``AHEAD`` frames later."""

    channels: int

    @nn.compact
    def __call__(self, x: Float[Array, "B T bands"]) -> Float[Array, "B T E"]:
        for number, (kernel, dilation) in enumerate(_LAYERS):
            y = nn.LayerNorm()(Conv1D(self.channels, kernel, dilation)(x))
            x = nn.relu(y if number == 0 else x + y)
        ahead = jnp.pad(x[:, AHEAD:], ((0, 0), (0, AHEAD), (0, 0)))
        return jnp.concatenate([x, ahead], axis=-1)
