"""One-dimensional convolution over time that stays fast inside ``lax.scan`` on CPU."""

from functools import partial

import jax
import jax.numpy as jnp
from flax import linen as nn
from jax import lax
from jax.nn.initializers import Initializer
from jaxtyping import Array, Float

from a2g_jax.nn.linear import linear

_DIMENSIONS = ("NWC", "WIO", "NWC")


@partial(jax.custom_vjp, nondiff_argnums=(2,))
def conv1d(x: Float[Array, "B T C"], kernel: Float[Array, "K C D"], dilation: int = 1) -> Float[Array, "B T D"]:
    """Convolution over time with symmetric zero padding, so that the output has T frames.

    Has a custom backward pass: inside control flow on CPU, XLA's own gradient with respect to the kernel is a hundred
    times slower than K matrix products. The price is forward-mode differentiation.

    Args:
        kernel: K taps (odd) from C to D channels.
        dilation: frames between taps.
    """
    return _conv(x, kernel, dilation)


def _conv(x, kernel, dilation):
    pad = dilation * (kernel.shape[0] // 2)
    return lax.conv_general_dilated(
        x, kernel, (1,), [(pad, pad)], rhs_dilation=(dilation,), dimension_numbers=_DIMENSIONS
    )


def _conv_forward(x, kernel, dilation):
    return _conv(x, kernel, dilation), (x, kernel)


def _conv_backward(dilation, saved, dy):
    x, kernel = saved
    taps, channels, features = kernel.shape
    dx = _conv(dy, kernel[::-1].transpose(0, 2, 1), dilation)
    flat = lambda array: array.reshape(-1, array.shape[-1])  # noqa: E731
    offsets = [dilation * (tap - taps // 2) for tap in range(taps)]
    # Shifting is a copy, so the operand with fewer channels is shifted.
    if channels < features:
        dkernel = [flat(_slide(x, offset)).T @ flat(dy) for offset in offsets]
    else:
        dkernel = [flat(x).T @ flat(_slide(dy, -offset)) for offset in offsets]
    return dx, jnp.stack(dkernel)


def _slide(x, offset):
    """Frame t of the result is frame t + offset of ``x``, or zeros where there is none."""
    # One operation, so one copy; none for the middle tap.
    return x if offset == 0 else lax.pad(x, jnp.zeros((), x.dtype), ((0, 0, 0), (-offset, offset, 0), (0, 0, 0)))


conv1d.defvjp(_conv_forward, _conv_backward)


class Conv1D(nn.Module):
    """:func:`conv1d` with a bias; weights initialised as Xavier's (Glorot's) uniform unless given, the bias to zero."""

    features: int
    kernel_size: int = 3
    dilation: int = 1
    kernel_init: Initializer = nn.initializers.xavier_uniform()

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Float[Array, "B T D"]:
        if self.kernel_size % 2 == 0:
            raise ValueError(f"Expected an odd kernel size, for symmetric padding; got {self.kernel_size}.")
        shape = (self.kernel_size, x.shape[-1], self.features)
        kernel = self.param("kernel", self.kernel_init, shape)
        bias = self.param("bias", nn.initializers.zeros_init(), (self.features,))
        return conv1d(x, kernel, self.dilation) + bias[None, None]


class Dense(nn.Module):
    """A linear layer applied to every frame; Xavier's uniform weights, constant bias."""

    features: int
    initial_bias: float = 0.0

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> Float[Array, "B T D"]:
        kernel = self.param("kernel", nn.initializers.xavier_uniform(), (x.shape[-1], self.features))
        bias = self.param("bias", nn.initializers.constant(self.initial_bias), (self.features,))
        return linear(x, kernel) + bias[None, None]
