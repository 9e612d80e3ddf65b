"""Strided convolutions over time or frequency, and upsampling in time."""

import jax.numpy as jnp
from flax import linen as nn
from jax import lax
from jax.nn.initializers import Initializer
from jaxtyping import Array, Float


def strided_conv1d(x: Float[Array, "B T C"], kernel: Float[Array, "K C D"], stride: int) -> Float[Array, "B _ D"]:
    """Convolution over time that keeps every ``stride``-th frame, with zero padding.

    Frame t of the result depends on frames ``stride * t - p`` to ``stride * t - p + K - 1`` with
    ``p = (K - stride) // 2``; there are ``ceil(T / stride)``. Neighbouring frames become channels, so that both passes
    are matrix products, which stay fast inside ``lax.scan`` on CPU.

    Args:
        kernel: K taps, a multiple of the stride.

    Raises:
        ValueError: another number of taps.
    """
    taps, channels, features = kernel.shape
    if taps % stride:
        raise ValueError(f"Expected a multiple of {stride} taps; got {taps}.")
    clips, frames = x.shape[:2]
    count, groups, before = -(-frames // stride), taps // stride, (taps - stride) // 2
    after = (count + groups - 1) * stride - before - frames
    # Negative padding crops last frames that no output depends on.
    blocks = lax.pad(x, jnp.zeros((), x.dtype), ((0, 0, 0), (before, after, 0), (0, 0, 0)))
    blocks = blocks.reshape(clips, count + groups - 1, stride * channels)
    weights = kernel.reshape(groups, stride * channels, features)
    receptive = jnp.concatenate([blocks[:, group : group + count] for group in range(groups)], axis=-1)
    return receptive @ weights.reshape(groups * stride * channels, features)


def image_conv(
    x: Float[Array, "B T F C"], kernel: Float[Array, "K L C D"], band_stride: int
) -> Float[Array, "B T _ D"]:
    """Convolution over time and frequency that keeps every frame and every ``band_stride``-th band, with zero padding.

    Args:
        kernel: K taps in time (odd) times L bands; of the ``ceil(F / band_stride)`` output bands, band f depends on L
            bands from ``band_stride * f - (L - band_stride) // 2`` on.
    """
    taps, height = kernel.shape[:2]
    bands = -(-x.shape[2] // band_stride)
    below = (height - band_stride) // 2
    above = (bands - 1) * band_stride + height - below - x.shape[2]
    padding = [(taps // 2, taps // 2), (below, above)]
    return lax.conv_general_dilated(x, kernel, (1, band_stride), padding, dimension_numbers=("NHWC", "HWIO", "NHWC"))


def repeat_frames(x: Float[Array, "B T C"], times: int) -> Float[Array, "B _ C"]:
    """Every frame repeated ``times`` times in a row."""
    clips, frames, channels = x.shape
    many = jnp.broadcast_to(x[:, :, None], (clips, frames, times, channels))
    return many.reshape(clips, frames * times, channels)


class StridedConv1D(nn.Module):
    """:func:`strided_conv1d` with a bias; Xavier's uniform weights unless given, zero bias."""

    features: int
    kernel_size: int = 4
    stride: int = 2
    kernel_init: Initializer = nn.initializers.xavier_uniform()

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Float[Array, "B _ D"]:
        shape = (self.kernel_size, x.shape[-1], self.features)
        kernel = self.param("kernel", self.kernel_init, shape)
        bias = self.param("bias", nn.initializers.zeros_init(), (self.features,))
        return strided_conv1d(x, kernel, self.stride) + bias[None, None]


class ImageConv(nn.Module):
    """:func:`image_conv` of three frames with a bias; Xavier's uniform weights, zero bias."""

    features: int
    band_stride: int = 1

    @nn.compact
    def __call__(self, x: Float[Array, "B T F C"]) -> Float[Array, "B T _ D"]:
        # Three bands, or four where every second one is kept, so that both sides are padded alike.
        shape = (3, 2 + self.band_stride, x.shape[-1], self.features)
        kernel = self.param("kernel", nn.initializers.xavier_uniform(), shape)
        bias = self.param("bias", nn.initializers.zeros_init(), (self.features,))
        return image_conv(x, kernel, self.band_stride) + bias[None, None, None]
