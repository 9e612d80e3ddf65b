"""The four networks of Audio2Gestures (extended paper, Sec. 3, 5.3.2, 6.2.4 and 6.3)."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float, Key

from a2g_jax.features.dct import block_dct
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.nn.attention import Transformer
from a2g_jax.nn.conv import Conv1D, Dense
from a2g_jax.nn.rates import pooled
from a2g_jax.nn.recurrent import GRU
from a2g_jax.nn.tcn import TCN


class Gaussian(NamedTuple):
    """A diagonal Gaussian over a code, for each frame (or each DCT band)."""

    mean: Float[Array, "B T C"]
    log_variance: Float[Array, "B T C"]

    def sample(self, key: Key[Array, ""]) -> Float[Array, "B T C"]:
        """One draw by the reparameterisation trick."""
        return self.shift(jax.random.normal(key, self.mean.shape, self.mean.dtype))

    def shift(self, noise: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
        """The draw for given standard normal ``noise``."""
        return self.mean + jnp.exp(0.5 * self.log_variance) * noise

    @classmethod
    def certain(cls, mean: Float[Array, "B T C"]) -> "Gaussian":
        """A Gaussian of zero variance: the code of an autoencoder."""
        return cls(mean, jnp.full_like(mean, -jnp.inf))


#: Bound of log-variances, smooth: 1 % off at 1.7, 3.6 % at a third of the bound. Without one, the first steps from
#: Xavier weights can overflow ``exp``.
LOG_VARIANCE_BOUND = 10.0


#: Convolutions of the mapping net.
MAPPING_LAYERS = 3


def _bounded(log_variance):
    return LOG_VARIANCE_BOUND * jnp.tanh(log_variance / LOG_VARIANCE_BOUND)


class GaussianHead(nn.Module):
    """Two-layer heads for mean and log-variance; the latter is kept within +-10 by a scaled tanh."""

    hidden: int
    features: int
    log_variance: float = 0.0
    """Log-variance at initialisation, about."""

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Gaussian:
        mean = Dense(self.features)(nn.relu(Dense(self.hidden)(x)))
        log_variance = Dense(self.features, self.log_variance)(nn.relu(Dense(self.hidden)(x)))
        return Gaussian(mean, _bounded(log_variance))


class BandHead(nn.Module):
    """One linear layer each for mean and log-variance of DCT bands; for the shared code only the mean (Sec. 6.3)."""

    features: int
    points: int
    variational: bool
    log_variance: float = 0.0
    """Log-variance at initialisation, about."""

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Gaussian:
        bands = block_dct(x, self.points)
        mean = Dense(self.features)(bands)
        if not self.variational:
            return Gaussian.certain(mean)
        return Gaussian(mean, _bounded(Dense(self.features, self.log_variance)(bands)))


class BidirectionalGRU(nn.Module):
    """Layers of a forward and a backward GRU each, with concatenated outputs."""

    layers: int
    features: int

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"], deterministic: bool = True) -> Float[Array, "B T D"]:
        del deterministic
        for _ in range(self.layers):
            x = jnp.concatenate([GRU(self.features)(x)[0], GRU(self.features, reverse=True)(x)[0]], axis=-1)
        return x


def _backbone(config: Audio2GesturesConfig, channels: Sequence[int]) -> Callable[..., Array]:
    """The layers of an encoder before its heads."""
    if config.backbone == "gru":
        return BidirectionalGRU(config.recurrent_layers, config.recurrent_channels)
    if config.backbone == "transformer":
        return Transformer(
            config.attention_layers,
            config.attention_channels,
            config.attention_hidden,
            config.attention_window,
            config.dropout,
        )
    return TCN(channels, config.kernel_size, config.dropout)


def _head(config: Audio2GesturesConfig, *, shared: bool = False, hidden: int | None = None) -> GaussianHead | BandHead:
    if config.latent == "dct":
        return BandHead(config.code_channels, config.dct_points, not shared, config.initial_log_variance)
    return GaussianHead(hidden or config.head_channels, config.code_channels, config.initial_log_variance)


class AudioEncoder(nn.Module):
    """f_A: audio features to the shared code S_A."""

    config: Audio2GesturesConfig

    @nn.compact
    def __call__(self, audio: Float[Array, "B T bands"], deterministic: bool = True) -> Gaussian:
        x = _backbone(self.config, self.config.audio_channels)(audio, deterministic)
        return _head(self.config, shared=True)(x)


class MotionEncoder(nn.Module):
    """f_M: motion to the shared code S_M and the motion-specific code I_M (None without a split).

    I_M has one step for every ``specific_frames`` frames.
    """

    config: Audio2GesturesConfig

    @nn.compact
    def __call__(
        self, motion: Float[Array, "B T pose"], deterministic: bool = True
    ) -> tuple[Gaussian, Gaussian | None]:
        c = self.config
        x = _backbone(c, c.motion_channels)(motion, deterministic)
        if not c.split:
            return _head(c, shared=True)(Dense(c.head_channels)(x)), None
        shared, specific = Dense(c.head_channels)(x), Dense(c.head_channels)(x)
        return _head(c, shared=True)(shared), _head(c)(pooled(specific, c.specific_frames))


class Decoder(nn.Module):
    """g: both codes, in time, to motion, not smoothed yet."""

    config: Audio2GesturesConfig
    features: int

    @nn.compact
    def __call__(
        self,
        shared: Float[Array, "B T C"],
        specific: Float[Array, "B T C"] | None,
        deterministic: bool = True,
    ) -> Float[Array, "B T pose"]:
        c = self.config
        x = shared if specific is None else jnp.concatenate([shared, specific], axis=-1)
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
        return _head(c, hidden=c.code_channels)(x)
