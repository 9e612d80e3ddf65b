"""Distances between sets beside SciPy and closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import sqrtm

from a2g_jax.metrics import distribution as m


def samples(seed, count=200, width=6, scale=1.0, shift=0.0):
    """Correlated Gaussian vectors."""
    random = np.random.default_rng(seed)
    mix = np.random.default_rng(99).normal(size=(width, width))
    return scale * random.normal(size=(count, width)) @ mix + shift


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.floats(0.3, 3.0), st.floats(-2.0, 2.0))
def test_frechet_is_the_textbook_formula_by_scipy(seed, scale, shift):
    a, b = samples(seed), samples(seed + 1, scale=scale, shift=shift)
    ca, cb = np.cov(a, rowvar=False), np.cov(b, rowvar=False)
    root = sqrtm(ca @ cb).real
    expected = ((a.mean(0) - b.mean(0)) ** 2).sum() + np.trace(ca + cb - 2 * root)
    result = m.frechet_distance(a, b)
    np.testing.assert_allclose(result.value, expected, rtol=1e-6, atol=1e-6)
    assert (result.samples, result.reference) == (200, 200)


def test_closed_form_of_gaussians():
    """Diagonal ones: the sum of (s1 - s2)^2 and (m1 - m2)^2."""
    first, second = np.array([1.0, 2.0, 0.0]), np.array([3.0, 0.5, 0.0])
    value = m.gaussian_distance(np.zeros(3), np.diag(first**2), np.ones(3), np.diag(second**2))
    assert value == pytest.approx(((first - second) ** 2).sum() + 3.0)


def test_degenerate_sets_give_real_numbers():
    """Fewer vectors than dimensions: the root of the product has no unique real value, the distance has."""
    a, b = samples(0, count=5, width=20), samples(1, count=5, width=20)
    assert 0.0 < m.frechet_distance(a, b).value < np.inf
    assert m.frechet_distance(a, a).value == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(m.frechet_distance(np.where(a > 0, a, np.nan), b).value)
    with pytest.raises(ValueError, match="two or more vectors of features for a covariance; got 1"):
        m.frechet_distance(a[:1], b)


def test_equal_distributions_come_nearer_with_more_samples():
    random = np.random.default_rng(0)
    distances = [
        np.mean([m.frechet_distance(*random.normal(size=(2, count, 32))).value for _ in range(3)])
        for count in (50, 200, 1000)
    ]
    assert distances[0] > 4 * distances[1] > 8 * distances[2] > 0
    # The notes' figures: 12.0 at 50 and 0.6 at 1000, in 32 dimensions.
    assert distances[0] == pytest.approx(12.0, rel=0.25)
    assert distances[2] == pytest.approx(0.6, rel=0.25)


def test_the_floor_is_that_of_halves():
    values = samples(3, count=400)
    floor = m.split_floor(values, np.random.default_rng(0))
    assert floor.samples == floor.reference == 200
    other = m.frechet_distance(samples(4, count=200), samples(5, count=200)).value
    assert 0.3 * other < floor.value < 3 * other
    assert floor.value < 0.1 * m.frechet_distance(values, samples(6, count=400, scale=2.0)).value


class TestHellinger:
    def test_of_itself_is_zero_and_not_nan(self):
        for seed in range(30):
            speeds = np.abs(np.random.default_rng(seed).normal(size=997))
            assert m.speed_hellinger(speeds, speeds) == pytest.approx(0.0, abs=1e-7)

    def test_of_speeds_that_never_meet_is_one(self):
        assert m.speed_hellinger(np.full(10, 0.01), np.full(20, 2.0)) == pytest.approx(1.0)
        assert m.speed_hellinger(np.full(10, 50.0), np.full(20, 90.0)) == pytest.approx(0.0, abs=1e-7)

    def test_is_the_formula(self):
        a, b = np.array([0.01, 0.02, 0.06]), np.array([0.01, 0.07, 0.08, 0.06])
        expected = np.sqrt(1 - (np.sqrt(2 / 3 * 1 / 4) + np.sqrt(1 / 3 * 3 / 4)))
        assert m.speed_hellinger(a, b) == pytest.approx(expected)
        assert np.isnan(m.speed_hellinger(np.array([np.nan]), b))
