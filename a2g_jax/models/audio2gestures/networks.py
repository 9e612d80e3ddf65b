"""The four networks of Audio2Gestures (extended paper, Sec. 3 and 5.3.2)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float, Key

from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.nn.conv import Conv1D, Dense
from a2g_jax.nn.tcn import TCN


class Gaussian(NamedTuple):
    """A diagonal Gaussian over a code, for each frame."""

    mean: Float[Array, "B T C"]
    log_variance: Float[Array, "B T C"]

    def sample(self, key: Key[Array, ""]) -> Float[Array, "B T C"]:
        """One draw by the reparameterisation trick."""
        return self.shift(jax.random.normal(key, self.mean.shape, self.mean.dtype))

    def shift(self, noise: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
        """The draw that standard normal ``noise`` stands for."""
        return self.mean + jnp.exp(0.5 * self.log_variance) * noise


#: Bound of log-variances: smooth, and the identity to 1 % below a third of it. Without one, the first steps from
#: Xavier weights can overflow ``exp``.
LOG_VARIANCE_BOUND = 10.0


#: Convolutions of the mapping net.
MAPPING_LAYERS = 3


class GaussianHead(nn.Module):
    """Two-layer heads for mean and log-variance; the latter is kept within +-10 by a scaled tanh."""

    hidden: int
    features: int

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Gaussian:
        mean = Dense(self.features)(nn.relu(Dense(self.hidden)(x)))
        log_variance = Dense(self.features)(nn.relu(Dense(self.hidden)(x)))
        log_variance = LOG_VARIANCE_BOUND * jnp.tanh(log_variance / LOG_VARIANCE_BOUND)
        return Gaussian(mean, log_variance)


class AudioEncoder(nn.Module):
    """f_A: audio features to the shared code S_A."""

    config: Audio2GesturesConfig

    @nn.compact
    def __call__(self, audio: Float[Array, "B T bands"], deterministic: bool = True) -> Gaussian:
        c = self.config
        x = TCN(c.audio_channels, c.kernel_size, c.dropout)(audio, deterministic)
        return GaussianHead(c.head_channels, c.code_channels)(x)


class MotionEncoder(nn.Module):
    """f_M: motion to the shared code S_M and the motion-specific code I_M."""

    config: Audio2GesturesConfig

    @nn.compact
    def __call__(self, motion: Float[Array, "B T pose"], deterministic: bool = True) -> tuple[Gaussian, Gaussian]:
        c = self.config
        x = TCN(c.motion_channels, c.kernel_size, c.dropout)(motion, deterministic)
        shared, specific = Dense(c.head_channels)(x), Dense(c.head_channels)(x)
        return (
            GaussianHead(c.head_channels, c.code_channels)(shared),
            GaussianHead(c.head_channels, c.code_channels)(specific),
        )


class Decoder(nn.Module):
    """g: both codes to motion."""

    config: Audio2GesturesConfig
    features: int

    @nn.compact
    def __call__(
        self, shared: Float[Array, "B T C"], specific: Float[Array, "B T C"], deterministic: bool = True
    ) -> Float[Array, "B T pose"]:
        c = self.config
        x = jnp.concatenate([shared, specific], axis=-1)
        x = TCN(c.decoder_channels, c.kernel_size, c.dropout)(x, deterministic)
        return Dense(self.features)(nn.relu(Dense(c.decoder_channels[-1])(x)))


class MappingNet(nn.Module):
    """f_R: noise with the statistics of a motion-specific code to such a code; itself a VAE (Sec. 4.2.4)."""

    config: Audio2GesturesConfig

    @nn.compact
    def __call__(self, noise: Float[Array, "B T C"]) -> Gaussian:
        c = self.config
        x = Conv1D(c.code_channels, c.kernel_size)(noise)
        for _ in range(MAPPING_LAYERS - 1):
            x = Conv1D(c.code_channels, c.kernel_size)(nn.relu(x))
        return GaussianHead(c.code_channels, c.code_channels)(x)
