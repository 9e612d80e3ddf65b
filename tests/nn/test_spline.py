"""Cubic B-splines as a filter: the fit inverts the curve, and windows of a curve agree."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import BSpline

from a2g_jax.nn.spline import along, curve, knots

fit, draw = jax.jit(knots, static_argnums=1), jax.jit(curve, static_argnums=1)


def coefficients(count=40, seed=0):
    return jnp.asarray(np.random.default_rng(seed).normal(size=(2, count, 3)), jnp.float32)


@pytest.mark.parametrize("stride", [2, 3, 5])
def test_the_fit_of_a_curve_is_its_knots(stride):
    given = coefficients()
    found = fit(draw(given, stride), stride)
    assert found.shape == given.shape
    # The ends are held, which is no spline.
    np.testing.assert_allclose(found[:, 12:-12], given[:, 12:-12], atol=0.01)


@pytest.mark.parametrize("stride", [2, 3])
def test_the_curve_is_scipys(stride):
    given = coefficients()
    inner = np.asarray(draw(given, stride))[0, stride : -3 * stride]
    ours = BSpline(np.arange(44) - 2.0, np.asarray(given[0], np.float64), 3)
    np.testing.assert_allclose(inner, ours(np.arange(stride, 37 * stride) / stride), atol=1e-5)


def test_the_fit_is_least_squares():
    rng, stride = np.random.default_rng(1), 3
    motion = np.cumsum(rng.normal(size=(120, 2)), axis=0)
    time = np.arange(120) / stride
    places = np.arange(-1, 42)
    away = np.abs(time[:, None] - places)
    basis = np.where(away < 1, 2 / 3 - away**2 + away**3 / 2, np.where(away < 2, (2 - away) ** 3 / 6, 0.0))
    best = np.linalg.lstsq(basis, motion, rcond=None)[0][1:]
    found = fit(jnp.asarray(motion[None], jnp.float32), stride)[0]
    np.testing.assert_allclose(found[14:26], best[14:26], atol=0.02 * motion.std())


def test_a_straight_line_stays_and_stride_one_is_the_motion():
    line = jnp.linspace(0.0, 1.0, 120)[None, :, None] * jnp.ones((1, 1, 2))
    np.testing.assert_allclose(draw(fit(line, 3), 3)[:, 40:-40], line[:, 40:-40], atol=1e-4)
    assert fit(line, 1) is not None
    np.testing.assert_array_equal(draw(fit(line, 1), 1), line)


def test_any_part_of_a_curve_is_the_same():
    given, stride = coefficients(), 3
    whole = draw(given, stride)
    # Frames 40 to 60 lie between knots 13 and 20.
    part = along(given[:, 12:23], jnp.arange(40, 60) - 13 * stride, stride)
    np.testing.assert_allclose(part, whole[:, 40:60], atol=1e-6)
