"""The product of every row of an array with a matrix, with a gradient that copies nothing."""

import jax
from jaxtyping import Array, Float


@jax.custom_vjp
def linear(x: Float[Array, "*S C"], kernel: Float[Array, "C D"]) -> Float[Array, "*S D"]:
    """``x @ kernel``.

    The gradient of the kernel is one product of two matrices, with all leading axes as one. Autodiff contracts them
    one by one, for which XLA on CPU first copies the upstream gradient transposed: two layers of 256 take a third
    longer. The price is forward-mode differentiation.
    """
    return x @ kernel


def _forward(x, kernel):
    return x @ kernel, (x, kernel)


def _backward(saved, dy):
    x, kernel = saved
    return dy @ kernel.T, x.reshape(-1, x.shape[-1]).T @ dy.reshape(-1, dy.shape[-1])


linear.defvjp(_forward, _backward)
