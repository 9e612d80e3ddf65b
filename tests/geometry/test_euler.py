"""Euler angles against SciPy, and the laws they obey."""

from itertools import permutations, product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.euler import continuous_euler, euler_matrices

ORDERS = ["".join(letters) for letters in permutations("XYZ")]
#: All orders of one and two axes, and the twelve of three.
ANY_ORDERS = [
    "".join(letters)
    for count in (1, 2, 3)
    for letters in product("XYZ", repeat=count)
    if all(first != second for first, second in zip(letters, letters[1:], strict=False))
]


@pytest.mark.parametrize("order", ANY_ORDERS)
def test_matrices_are_those_of_scipy(order):
    degrees = np.random.default_rng(0).uniform(-400, 400, (50, len(order)))
    expected = Rotation.from_euler(order, degrees, degrees=True).as_matrix()
    np.testing.assert_allclose(euler_matrices(degrees, order), expected, atol=1e-13)


@pytest.mark.parametrize("shape", [(), (2, 3)])
def test_leading_axes(shape):
    degrees = np.random.default_rng(1).uniform(-180, 180, (*shape, 3))
    expected = Rotation.from_euler("ZXY", degrees.reshape(-1, 3), degrees=True).as_matrix()
    np.testing.assert_allclose(euler_matrices(degrees, "ZXY"), expected.reshape(*shape, 3, 3), atol=1e-13)


@pytest.mark.parametrize("order", ORDERS)
def test_matrices_invert_angles(order):
    matrices = Rotation.random(60, rng=np.random.default_rng(2)).as_matrix().reshape(20, 3, 3, 3)
    np.testing.assert_allclose(euler_matrices(continuous_euler(matrices, order), order), matrices, atol=1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_angles_are_those_of_scipy(order):
    rotations = Rotation.random(500, rng=np.random.default_rng(0))
    angles = continuous_euler(rotations.as_matrix()[None], order)[0]
    np.testing.assert_allclose(angles, rotations.as_euler(order, degrees=True), atol=1e-6)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("nearness", [0.0, 1e-9, 1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_angles_near_gimbal_lock(order, nearness, precision):
    random = np.random.default_rng(0)
    degrees = random.uniform(-180, 180, (200, 3))
    degrees[:, 1] = random.choice([-90, 90], 200) + nearness * random.uniform(-1, 1, 200)
    matrices = Rotation.from_euler(order, degrees, degrees=True).as_matrix().astype(precision)
    angles = continuous_euler(matrices[:, None].astype(np.float64), order)[:, 0]
    result = Rotation.from_euler(order, angles, degrees=True).as_matrix()
    np.testing.assert_allclose(result, matrices, atol=2e-6)


@pytest.mark.parametrize("order", ORDERS)
def test_angles_run_on_through_turns_and_over_the_pole(order):
    time = np.linspace(0, 1, 400)
    degrees = np.stack([1000 * time, 50 * np.sin(9 * time) + 120 * time, -700 * time], axis=-1)
    matrices = Rotation.from_euler(order, degrees, degrees=True).as_matrix()
    angles = continuous_euler(matrices[:, None], order)[:, 0]
    assert np.abs(np.diff(angles, axis=0)).max() < 5
    np.testing.assert_allclose(np.diff(angles, axis=0), np.diff(degrees, axis=0), atol=1e-5)


def test_still_in_gimbal_lock_stays_still():
    matrices = Rotation.from_euler("ZXY", [[20, 80, 0], [20, 90, 0], [20, 90, 0], [20, 89, 0]], degrees=True)
    angles = continuous_euler(matrices.as_matrix()[:, None], "ZXY")[:, 0]
    np.testing.assert_allclose(angles, [[20, 80, 0], [20, 90, 0], [20, 90, 0], [20, 89, 0]], atol=1e-5)
