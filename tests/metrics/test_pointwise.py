"""Frame-by-frame scores beside loops."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.metrics import pointwise as m


def pair(seed, frames=6, joints=4, width=3):
    """Two random motions."""
    random = np.random.default_rng(seed)
    return random.normal(size=(2, frames, joints, width)).astype(np.float32)


def by_loops(a, b, distance):
    """Mean of a distance over frames and joints."""
    return np.mean([[distance(a[t, j] - b[t, j]) for j in range(a.shape[1])] for t in range(a.shape[0])])


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 1000), st.sampled_from([2, 3]))
def test_scores_equal_loops(seed, width):
    a, b = pair(seed, width=width)
    l1, l2 = (lambda d: np.abs(d).sum()), (lambda d: np.sqrt((d * d).sum()))
    np.testing.assert_allclose(m.position_l1(a, b), by_loops(a, b, l1), rtol=1e-5)
    np.testing.assert_allclose(m.position_l2(a, b), by_loops(a, b, l2), rtol=1e-5)
    speed = lambda p: (p[1:] - p[:-1]) * 30  # noqa: E731
    np.testing.assert_allclose(m.speed_l1(a, b, 30.0), by_loops(speed(a), speed(b), l1), rtol=1e-5)
    bent = lambda p: (p[2:] - 2 * p[1:-1] + p[:-2]) * 900  # noqa: E731
    np.testing.assert_allclose(m.acceleration_l1(a, b, 30.0), by_loops(bent(a), bent(b), l1), rtol=1e-4)
    np.testing.assert_allclose(m.pck(a, b, 1.5), by_loops(a, b, lambda d: float(l2(d) < 1.5)), rtol=1e-6)


def test_zero_only_for_equals_and_symmetric():
    a, b = pair(0)
    for score in (m.position_l1, m.position_l2, m.speed_l1, m.acceleration_l1):
        assert float(score(a, a)) == 0.0 < float(score(a, b)) == float(score(b, a))
    assert float(m.pck(a, a, 1e-6)) == 1.0


def test_pck_grows_with_its_threshold():
    a, b = pair(1)
    shares = [float(m.pck(a, b, threshold)) for threshold in np.linspace(0.1, 6, 12)]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (pytest.approx(0, abs=0.1), 1.0)


def test_another_size_of_body_is_brought_to_the_papers():
    a, b = pair(2)
    np.testing.assert_allclose(m.position_l1_star(a, b, 1.2064), m.position_l1(a, b), rtol=1e-6)
    np.testing.assert_allclose(m.position_l1_star(2 * a, 2 * b, 2 * 1.2064), m.position_l1(a, b), rtol=1e-5)


def test_joint_rotation_error_is_scipys_magnitude_whatever_both_are_turned_by():
    random = np.random.default_rng(3)
    a, b = (Rotation.random(20, random_state=random) for _ in range(2))
    matrices = lambda r: r.as_matrix().astype(np.float32).reshape(5, 4, 3, 3)  # noqa: E731
    expected = np.rad2deg((a.inv() * b).magnitude().mean())
    np.testing.assert_allclose(m.joint_rotation_error(matrices(a), matrices(b)), expected, rtol=1e-4)
    turn = Rotation.random(random_state=random)
    np.testing.assert_allclose(m.joint_rotation_error(matrices(turn * a), matrices(turn * b)), expected, rtol=1e-4)


def test_batches_give_a_score_each_and_inputs_stay():
    a, b = pair(4), pair(5)
    before = a.copy(), b.copy()
    each = np.asarray(m.position_l1(a, b))
    assert each.shape == (2,)
    np.testing.assert_allclose(each, [m.position_l1(a[n], b[n]) for n in range(2)], rtol=1e-6)
    np.testing.assert_array_equal(a, before[0])
    np.testing.assert_array_equal(b, before[1])


def test_a_broken_motion_has_no_score():
    a, b = pair(6)
    a[2, 1, 0] = np.nan
    for score in (m.position_l1, m.position_l2, m.speed_l1, m.acceleration_l1):
        assert np.isnan(score(a, b))
    assert np.isnan(m.pck(a, b, 1.0))
