"""Frame-by-frame scores beside loops."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.metrics import pointwise as m
from a2g_jax.talker.skeleton import TALKER_SKELETON


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


def test_weights_count_a_joint_as_often_as_they_say():
    """A mean weighted by (1, 2, 4, 1) / 8 is that over joints repeated so often."""
    a, b = pair(7)
    weights = np.array([1, 2, 4, 1], np.float32) / 8
    often = np.repeat(np.arange(4), [1, 2, 4, 1])
    for score in (m.position_l1, m.speed_l1, m.acceleration_l1):
        np.testing.assert_allclose(score(a, b, weights=weights), score(a[:, often], b[:, often]), rtol=1e-5)
    np.testing.assert_allclose(m.pck(a, b, 1.5, weights), m.pck(a[:, often], b[:, often], 1.5), rtol=1e-6)


def turned_arms(angle, bend=0.0):
    """The talker's skeleton with another rest pose: arms lowered and elbows bent by radians."""
    offsets, names = np.asarray(TALKER_SKELETON.offsets).copy(), TALKER_SKELETON.names
    for sign, side in ((1, "L"), (-1, "R")):
        for name, by in (("Elbow", angle), ("Wrist", angle + bend)):
            row = names.index(f"{side}_{name}")
            length = np.linalg.norm(offsets[row])
            offsets[row] = length * np.array([sign * np.cos(by), -np.sin(by), 0.0])
    return replace(TALKER_SKELETON, offsets=offsets)


@pytest.mark.parametrize(("angle", "bend"), [(0.0, 0.0), (0.8, 0.0), (1.5, 0.0), (-1.5, 0.0), (0.3, 1.0)])
def test_the_reach_is_that_of_a_t_pose_whatever_the_rest_pose(angle, bend):
    """1.364 m, not the 1.541 m of the bones, whose collars are slanted."""
    assert m.wrist_to_wrist(turned_arms(angle, bend)) == pytest.approx(1.364, abs=1e-5)
    lengths = np.linalg.norm(np.asarray(TALKER_SKELETON.offsets), axis=-1)
    arms = [n for n, name in enumerate(TALKER_SKELETON.names) if name[2:] in ("Collar", "Shoulder", "Elbow", "Wrist")]
    assert lengths[arms].sum() == pytest.approx(1.541, abs=1e-3)


def test_a_rest_pose_that_is_nearly_a_t_pose_is_measured_as_it_is():
    """As SMPL-X's, whose arms slope by a few degrees."""
    slight = turned_arms(0.1)
    assert m.wrist_to_wrist(slight) == pytest.approx(0.344 + 1.02 * np.cos(0.1), abs=1e-5)
    assert m.wrist_to_wrist(slight.scaled(0.5)) == pytest.approx(0.5 * m.wrist_to_wrist(slight), rel=1e-6)
    nameless = replace(TALKER_SKELETON, names=tuple(f"joint{n}" for n in range(22)))
    assert m.wrist_to_wrist(nameless) is None


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
