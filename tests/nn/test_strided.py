"""Strided convolutions against their definition and XLA's own, and gradients by differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from jax.test_util import check_grads

from a2g_jax.nn.strided import ImageConv, StridedConv1D, image_conv, repeat_frames, strided_conv1d


def draw(seed, *shape):
    return jnp.asarray(np.random.default_rng(seed).normal(size=shape), jnp.float32)


@pytest.mark.parametrize(("taps", "stride"), [(4, 2), (2, 2), (4, 1), (6, 3), (8, 2), (3, 1), (1, 1)])
@pytest.mark.parametrize("frames", [1, 7, 12])
def test_strided_equals_its_definition(taps, stride, frames):
    x, kernel = draw(0, 2, frames, 3), draw(1, taps, 3, 5)
    before, count = (taps - stride) // 2, -(-frames // stride)
    expected = np.zeros((2, count, 5))
    for out in range(count):
        for tap in range(taps):
            frame = stride * out - before + tap
            if 0 <= frame < frames:
                expected[:, out] += np.asarray(x[:, frame], np.float64) @ np.asarray(kernel[tap])
    np.testing.assert_allclose(strided_conv1d(x, kernel, stride), expected, atol=1e-5)


def test_strided_equals_xlas():
    x, kernel = draw(0, 2, 16, 3), draw(1, 4, 3, 5)
    expected = lax.conv_general_dilated(x, kernel, (2,), [(1, 1)], dimension_numbers=("NWC", "WIO", "NWC"))
    np.testing.assert_allclose(strided_conv1d(x, kernel, 2), expected, atol=1e-5)


def test_strided_refuses_taps_that_are_no_multiple_of_the_stride():
    with pytest.raises(ValueError, match="multiple of 2 taps; got 3"):
        strided_conv1d(draw(0, 1, 4, 1), draw(1, 3, 1, 1), 2)


@pytest.mark.parametrize(("height", "stride", "bands"), [(3, 1, 8), (4, 2, 8), (4, 2, 7), (4, 2, 1)])
def test_image_conv_equals_its_definition(height, stride, bands):
    x, kernel = draw(0, 2, 5, bands, 3), draw(1, 3, height, 3, 2)
    below, count = (height - stride) // 2, -(-bands // stride)
    expected = np.zeros((2, 5, count, 2))
    for frame in range(5):
        for out in range(count):
            for tap in range(3):
                for row in range(height):
                    t, f = frame - 1 + tap, stride * out - below + row
                    if 0 <= t < 5 and 0 <= f < bands:
                        expected[:, frame, out] += np.asarray(x[:, t, f], np.float64) @ np.asarray(kernel[tap, row])
    np.testing.assert_allclose(image_conv(x, kernel, stride), expected, atol=1e-5)


def test_gradients_numerically(x64):
    double = lambda array: jnp.asarray(array, jnp.float64)  # noqa: E731
    x, kernel = double(draw(0, 2, 5, 2)), double(draw(1, 4, 2, 3))
    check_grads(jax.jit(lambda a, b: jnp.tanh(strided_conv1d(a, b, 2))), (x, kernel), order=1, modes=["fwd", "rev"])
    x, kernel = double(draw(0, 1, 3, 5, 2)), double(draw(1, 3, 4, 2, 2))
    check_grads(jax.jit(lambda a, b: jnp.tanh(image_conv(a, b, 2))), (x, kernel), order=1, modes=["rev"])


def test_gradient_inside_scan_is_the_one_outside():
    kernel, many = draw(1, 4, 3, 5), draw(0, 3, 2, 8, 3)
    gradient = jax.grad(lambda k, x: jnp.sum(jnp.sin(strided_conv1d(x, k, 2))))
    inside = jax.jit(lambda k: lax.scan(lambda carry, x: (carry, gradient(k, x)), 0, many)[1])(kernel)
    np.testing.assert_allclose(inside, [gradient(kernel, x) for x in many], atol=1e-5)


def test_repeat_frames():
    x = draw(0, 2, 3, 4)
    np.testing.assert_array_equal(repeat_frames(x, 3), np.repeat(np.asarray(x), 3, axis=1))


def test_modules_are_the_functions_with_a_bias():
    x = draw(0, 2, 6, 3)
    params = StridedConv1D(5).init(jax.random.key(0), x)["params"] | {"bias": jnp.arange(5.0)}
    expected = np.asarray(strided_conv1d(x, params["kernel"], 2)) + np.arange(5)
    np.testing.assert_allclose(StridedConv1D(5).apply({"params": params}, x), expected, atol=1e-6)
    image = draw(0, 2, 4, 6, 3)
    for stride, height in ((1, 3), (2, 4)):
        module = ImageConv(5, stride)
        params = module.init(jax.random.key(0), image)["params"] | {"bias": jnp.arange(5.0)}
        assert params["kernel"].shape == (3, height, 3, 5)
        expected = np.asarray(image_conv(image, params["kernel"], stride)) + np.arange(5)
        np.testing.assert_allclose(module.apply({"params": params}, image), expected, atol=1e-6)
