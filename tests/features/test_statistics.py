"""Running mean and deviation, and normalising by them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.features.statistics import RunningStatistics, Statistics


def collect(pieces):
    running = RunningStatistics()
    for piece in pieces:
        running.add(piece)
    return running


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(0, 40), min_size=1, max_size=8).filter(any),
    st.integers(0, 10**6),
    st.floats(-1e4, 1e4),
    st.floats(1e-2, 1e3),
)
def test_pieces_are_the_whole(lengths, seed, centre, width):
    random = np.random.default_rng(seed)
    pieces = [centre + width * random.normal(size=(length, 2, 3)) for length in lengths]
    whole = np.concatenate(pieces)
    result = collect(pieces).result(floor=0.0)
    np.testing.assert_allclose(result.mean, whole.mean(axis=0), rtol=1e-6, atol=1e-6 * width)
    np.testing.assert_allclose(result.std, whole.std(axis=0), rtol=1e-5, atol=1e-6 * width)


def test_float32_rows_far_from_zero():
    """A sum of squares in single precision would lose the deviation entirely."""
    rows = (1e4 + np.random.default_rng(0).normal(size=(2000, 1))).astype(np.float32)
    result = collect(np.array_split(rows, 7)).result(floor=0.0)
    np.testing.assert_allclose(result.std, rows.astype(np.float64).std(axis=0), rtol=1e-4)


def test_floor_keeps_constant_features_small():
    rows = np.stack([np.ones(10), np.arange(10.0)], axis=1)
    result = collect([rows]).result(floor=0.5)
    np.testing.assert_allclose(result.std, [0.5, np.std(np.arange(10))], rtol=1e-6)
    assert result.mean.dtype == result.std.dtype == np.float32


def test_no_rows_is_refused():
    with pytest.raises(ValueError, match="at least one row"):
        collect([np.zeros((0, 3))]).result(floor=0.0)


@pytest.mark.parametrize("array", [np.asarray, jnp.asarray])
@pytest.mark.parametrize("shape", [(3,), (5, 3), (2, 4, 3)])
def test_denormalise_inverts_normalise(array, shape):
    statistics = Statistics(array(np.float32([1, -2, 3])), array(np.float32([0.5, 2, 10])))
    x = array(np.random.default_rng(1).normal(size=shape).astype(np.float32))
    normal = statistics.normalise(x)
    expected = (np.asarray(x) - [1, -2, 3]) / [0.5, 2, 10]
    np.testing.assert_allclose(normal, expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(statistics.denormalise(normal), x, rtol=1e-5, atol=1e-6)


def test_features_of_two_axes_are_a_pytree_under_jit():
    statistics = Statistics(np.full((4, 6), 2.0, np.float32), np.full((4, 6), 3.0, np.float32))
    assert len(jax.tree.leaves(statistics)) == 2
    result = jax.jit(lambda s, x: s.normalise(x))(statistics, jnp.zeros((2, 5, 4, 6)))
    np.testing.assert_allclose(result, np.full((2, 5, 4, 6), -2 / 3), rtol=1e-6)
