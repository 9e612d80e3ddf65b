"""Rotations in NumPy equal those of JAX outside of compiled functions, bit by bit."""

import numpy as np
import pytest

from a2g_jax.geometry.host_rotation import matrices_from_6d
from a2g_jax.geometry.rotation import matrix_from_6d

RANDOM = np.random.default_rng(0)


@pytest.mark.parametrize("shape", [(6,), (22, 6), (40, 55, 6)])
def test_equal_to_the_last_bit(shape):
    six = RANDOM.normal(size=shape).astype(np.float32)
    matrices = matrices_from_6d(six)
    assert matrices.dtype == np.float32
    np.testing.assert_array_equal(matrices, np.asarray(matrix_from_6d(six)))


def test_degenerate_vectors_too():
    six = RANDOM.choice(np.array([0, 1, -1, 1e-4, 2], np.float32), size=(3000, 6))
    matrices = matrices_from_6d(six)
    np.testing.assert_array_equal(matrices, np.asarray(matrix_from_6d(six)))
    identity = np.broadcast_to(np.eye(3), matrices.shape)
    np.testing.assert_allclose(matrices @ np.swapaxes(matrices, -1, -2), identity, atol=1e-5)
