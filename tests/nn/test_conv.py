"""The convolution against SciPy, and its hand-written gradient against automatic ones."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from jax.test_util import check_grads
from scipy.ndimage import convolve1d

from a2g_jax.nn.conv import Conv1D, Dense, conv1d
from a2g_jax.nn.linear import linear

CASES = [(1, 1), (3, 1), (3, 4), (5, 2), (3, 9)]


def data(taps, seed=0, frames=11):
    random = np.random.default_rng(seed)
    shapes = (2, frames, 3), (taps, 3, 4)
    return tuple(jnp.asarray(random.normal(size=shape), jnp.float32) for shape in shapes)


def plain(x, kernel, dilation):
    """The same convolution with XLA's own gradient."""
    pad = dilation * (kernel.shape[0] // 2)
    return lax.conv_general_dilated(
        x, kernel, (1,), [(pad, pad)], rhs_dilation=(dilation,), dimension_numbers=("NWC", "WIO", "NWC")
    )


@pytest.mark.parametrize(("taps", "dilation"), CASES)
def test_equals_scipy(taps, dilation):
    x, kernel = data(taps)
    spread = np.zeros(((taps - 1) * dilation + 1, 3, 4))
    spread[::dilation] = kernel
    expected = np.zeros((2, 11, 4))
    for c in range(3):
        for d in range(4):
            # SciPy turns the kernel round; networks do not.
            expected[:, :, d] += convolve1d(
                np.asarray(x, np.float64)[:, :, c], spread[::-1, c, d], axis=1, mode="constant", cval=0
            )
    np.testing.assert_allclose(conv1d(x, kernel, dilation), expected, atol=1e-5)


@pytest.mark.parametrize("narrowing", [False, True])
@pytest.mark.parametrize(("taps", "dilation"), [*CASES, (3, 16)])
def test_gradient_equals_xlas(taps, dilation, narrowing):
    x, kernel = data(taps)
    if narrowing:  # four channels to three
        x, kernel = jnp.concatenate([x, x[:, :, :1]], axis=2), kernel.transpose(0, 2, 1)
    dy = np.random.default_rng(1).normal(size=(2, 11, kernel.shape[2])).astype(np.float32)

    def both(x, kernel):
        return [jax.vjp(lambda a, b, f=f: f(a, b, dilation), x, kernel)[1](dy) for f in (conv1d, plain)]

    ours, theirs = jax.jit(both)(x, kernel)
    for mine, expected in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(mine, expected, atol=2e-5)


def test_gradient_numerically(x64):
    x, kernel = (jnp.asarray(array, jnp.float64) for array in data(3, frames=6))
    check_grads(jax.jit(lambda a, b: jnp.tanh(conv1d(a, b, 2))), (x, kernel), order=1, modes=["rev"])


@pytest.mark.parametrize("axes", [(5,), (2, 5), (3, 2, 5)])
def test_gradient_of_linear_equals_xlas(axes):
    random = np.random.default_rng(2)
    sizes = (*axes, 3), (3, 4), (*axes, 4)
    x, kernel, dy = (jnp.asarray(random.normal(size=size), jnp.float32) for size in sizes)

    def both(x, kernel):
        return [jax.vjp(f, x, kernel)[1](dy) for f in (linear, jnp.matmul)]

    ours, theirs = jax.jit(both)(x, kernel)
    for mine, expected in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(mine, expected, atol=1e-5)
    np.testing.assert_array_equal(linear(x, kernel), jnp.matmul(x, kernel))


def test_gradient_inside_scan_is_the_one_outside():
    kernel = data(3)[1]
    many = jnp.stack([data(3, seed)[0] for seed in range(3)])

    def loss(kernel, x):
        return jnp.sum(jnp.sin(conv1d(x, kernel, 2)))

    @jax.jit
    def inside(kernel):
        return lax.scan(lambda carry, x: (carry, jax.grad(loss, (0, 1))(kernel, x)), 0, many)[1]

    outside = jax.jit(jax.grad(loss, (0, 1)))
    for n, (dkernel, dx) in enumerate(zip(*inside(kernel), strict=True)):
        expected = outside(kernel, many[n])
        np.testing.assert_allclose(dkernel, expected[0], atol=2e-5)
        np.testing.assert_allclose(dx, expected[1], atol=2e-5)


def test_module_is_the_function_with_a_bias():
    x, _ = data(3)
    module = Conv1D(4, 3, 2)
    params = module.init(jax.random.key(0), x)["params"]
    assert params["kernel"].shape == (3, 3, 4)
    np.testing.assert_array_equal(params["bias"], np.zeros(4))
    params["bias"] = jnp.arange(4.0)
    expected = np.asarray(conv1d(x, params["kernel"], 2)) + np.arange(4)
    np.testing.assert_allclose(module.apply({"params": params}, x), expected, atol=1e-6)


def test_weights_start_as_xaviers_uniform():
    kernel = Conv1D(50, 3).init(jax.random.key(0), jnp.zeros((1, 4, 40)))["params"]["kernel"]
    bound = np.sqrt(6 / (3 * 40 + 3 * 50))
    assert np.abs(kernel).max() <= bound
    assert np.std(kernel) == pytest.approx(bound / np.sqrt(3), rel=0.05)


def test_an_even_kernel_is_refused():
    with pytest.raises(ValueError, match=r"odd kernel size.*got 4"):
        Conv1D(4, 4).init(jax.random.key(0), jnp.zeros((1, 8, 3)))


def test_dense_works_on_each_frame_alone():
    x, _ = data(3)
    module = Dense(4)
    variables = module.init(jax.random.key(0), x)
    result = module.apply(variables, x)
    np.testing.assert_allclose(result, np.asarray(x) @ np.asarray(variables["params"]["kernel"]), atol=1e-5)
