"""The DCT in blocks against SciPy's, and its laws."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.fft import dct

from a2g_jax.features.dct import block_dct, block_idct


@pytest.fixture
def signal():
    return np.random.default_rng(0).normal(size=(2, 24, 3))


def test_equals_scipys_orthonormal_dct(signal):
    blocks = dct(signal.reshape(2, 3, 8, 3), type=2, norm="ortho", axis=2).reshape(signal.shape)
    np.testing.assert_allclose(block_dct(jnp.asarray(signal, jnp.float32), 8), blocks, atol=1e-5)


def test_the_inverse_gives_the_signal_back(signal):
    there = block_idct(block_dct(jnp.asarray(signal, jnp.float32), 12), 12)
    np.testing.assert_allclose(there, signal, atol=1e-5)


def test_energy_stays(signal):
    bands = np.asarray(block_dct(jnp.asarray(signal, jnp.float32), 24))
    np.testing.assert_allclose(np.sum(bands**2), np.sum(signal**2), rtol=1e-5)


def test_blocks_do_not_see_each_other(signal):
    other = signal.copy()
    other[:, 8:16] += 1.0
    first, second = (np.asarray(block_dct(jnp.asarray(s, jnp.float32), 8)) for s in (signal, other))
    np.testing.assert_array_equal(first[:, :8], second[:, :8])
    np.testing.assert_array_equal(first[:, 16:], second[:, 16:])
    assert np.abs(first[:, 8] - second[:, 8]).min() > 1


def test_a_constant_is_band_zero_alone():
    bands = np.asarray(block_dct(jnp.full((16, 1), 2.0), 16))
    np.testing.assert_allclose(bands[0], 2 * np.sqrt(16), rtol=1e-6)
    np.testing.assert_allclose(bands[1:], 0, atol=1e-5)


@pytest.mark.parametrize("transform", [block_dct, block_idct])
def test_refuses_a_remainder(transform):
    with pytest.raises(ValueError, match="multiple of 8 frames; got 9"):
        transform(jnp.zeros((9, 1)), 8)
