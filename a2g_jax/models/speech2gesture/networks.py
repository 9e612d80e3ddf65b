"""The networks of Speech2Gesture: audio encoder, U-Net and motion-patch discriminator.

Ginosar et al., "Learning Individual Styles of Conversational Gesture", 2019, Sec. 4; widths and order of layers as in
the authors' code. Three things differ:

- Layer normalisation over the values of a frame replaces batch normalisation. It has no running state, and a frame's
  output depends on no frame beyond the receptive field, so that windows of a long audio agree with one pass.
- The audio encoder subsamples frequency only. Theirs takes spectra at 100 Hz, halves them three times in time, and
  resizes the result to the frames of the motion; our features are at those frames from the start.
- Upsampling repeats frames, as theirs does, and clips whose length is not a multiple of the stride are padded at the
  end with zeros (the mean audio) and trimmed afterwards; theirs are always 64 frames long.
"""

from collections.abc import Sequence

import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.models.speech2gesture.config import Speech2GestureConfig
from a2g_jax.nn.conv import Conv1D, Dense
from a2g_jax.nn.strided import ImageConv, StridedConv1D, repeat_frames

#: Slope of the leaky rectifier below zero.
SLOPE = 0.2
EPSILON = 1e-5


class Activation(nn.Module):
    """Optional layer normalisation of each frame, and a leaky rectifier."""

    normalise: bool

    @nn.compact
    def __call__(self, x: Float[Array, "B T *rest"]) -> Float[Array, "B T *rest"]:
        if self.normalise:
            frame = tuple(range(2, x.ndim))
            x = nn.LayerNorm(epsilon=EPSILON, reduction_axes=frame, feature_axes=-1, use_fast_variance=False)(x)
        return nn.leaky_relu(x, SLOPE)


class AudioEncoder(nn.Module):
    """Eight convolutions over the image of time and frequency; the last one takes all bands that remain.

    Where several spectra share a frame, they are stacked along frequency.
    """

    channels: Sequence[int]
    normalise: bool

    @nn.compact
    def __call__(self, audio: Float[Array, "B T bands"]) -> Float[Array, "B T C"]:
        # With a channel of ones beside the audio: otherwise normalisation would remove the loudness.
        x = jnp.stack([audio, jnp.ones_like(audio)], axis=-1)
        for layer, features in enumerate(self.channels[:-1]):
            halved = layer % 2 == 1
            x = Activation(self.normalise)(ImageConv(features, 2 if halved else 1)(x))
        x = x.reshape(*x.shape[:2], -1)
        return Activation(self.normalise)(Conv1D(self.channels[-1])(x))


class UNet(nn.Module):
    """Convolutions that halve the frame rate, as many that double it, and skip connections between equal rates."""

    channels: int
    depth: int
    decoder_layers: int
    normalise: bool

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Float[Array, "B T D"]:
        def same(x: Array) -> Array:
            return Activation(self.normalise)(Conv1D(self.channels)(x))

        x = same(same(x))
        levels = []
        for _ in range(self.depth):
            levels.append(x)
            x = Activation(self.normalise)(StridedConv1D(self.channels)(x))
        for level in reversed(levels):
            x = same(repeat_frames(x, 2) + level)
        for _ in range(self.decoder_layers):
            x = same(x)
        return x


class Translator(nn.Module):
    """The translation network: audio to poses as z-scores (the generator of the GAN)."""

    config: Speech2GestureConfig
    features: int

    @nn.compact
    def __call__(self, audio: Float[Array, "B T bands"]) -> Float[Array, "B T D"]:
        c = self.config
        frames = audio.shape[1]
        padded = jnp.pad(audio, ((0, 0), (0, -frames % c.stride), (0, 0)))
        x = AudioEncoder(c.audio_channels, c.normalise)(padded)
        x = UNet(c.channels, c.depth, c.decoder_layers, c.normalise)(x)
        return Dense(self.features)(x)[:, :frames]


class Discriminator(nn.Module):
    """Outputs for overlapping patches of motion, given as differences of frames: 1 for true ones, 0 for generated."""

    channels: Sequence[int]
    normalise: bool

    @nn.compact
    def __call__(self, motion: Float[Array, "B T D"]) -> Float[Array, "B _"]:
        x = motion
        last = len(self.channels) - 1
        for layer, features in enumerate(self.channels):
            x = StridedConv1D(features, stride=1 if layer == last else 2)(x)
            # No normalisation in the first layer: it would remove the amplitude of the motion.
            x = Activation(self.normalise and layer > 0)(x)
        return StridedConv1D(1, stride=1)(x)[..., 0]


def translator_halo(config: Speech2GestureConfig) -> int:
    """Frames on either side that an output frame depends on, for the position in the stride that has most of them."""
    return max(
        max(frame - first, last - frame)
        for frame in range(config.stride)
        for first, last in [_audio_range(config, frame)]
    )


def _audio_range(config: Speech2GestureConfig, frame: int) -> tuple[int, int]:
    """First and last frame of audio that an output frame depends on, traced back through the layers."""
    first, last = frame - config.decoder_layers, frame + config.decoder_layers
    for _ in range(config.depth):  # through the convolutions after upsampling, which reach farthest
        first, last = (first - 1) // 2, (last + 1) // 2
    for _ in range(config.depth):
        first, last = 2 * first - 1, 2 * last + 2
    around = 2 + len(config.audio_channels)
    return first - around, last + around
