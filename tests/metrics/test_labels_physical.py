"""Scores against labels beside scikit-learn; physics of plain motions."""

import numpy as np
import pytest
from sklearn import metrics as sklearn

from a2g_jax.metrics import labels, physical


@pytest.mark.parametrize("seed", range(5))
def test_clusters_are_scored_as_by_scikit_learn(seed):
    random = np.random.default_rng(seed)
    groups = np.append(random.integers(0, 4, 60), 9)  # one point alone
    points = random.normal(size=(61, 5)) + groups[:, None] * 0.5
    assert labels.calinski_harabasz(points, groups) == pytest.approx(sklearn.calinski_harabasz_score(points, groups))
    assert labels.silhouette(points, groups) == pytest.approx(sklearn.silhouette_score(points, groups), abs=1e-9)


def test_one_group_is_none():
    for score in (labels.calinski_harabasz, labels.silhouette):
        with pytest.raises(ValueError, match="expected 2 to 3 groups for 4 points; got 1"):
            score(np.zeros((4, 2)), np.zeros(4, int))


def test_emotions():
    logits = np.array([[2.0, 0, 0], [0, 1, 0], [0, 0, 3], [4, 0, 0]])
    own = np.array([0, 1, 1, 0])
    assert labels.emotion_accuracy(logits, own) == 0.75
    np.testing.assert_array_equal(labels.confusion(logits, own), [[2, 0, 0], [0, 1, 1], [0, 0, 0]])


def test_jerk_of_a_cube_is_six():
    times = np.arange(30) / 10.0
    path = np.stack([times**3, 0 * times, 0 * times], axis=-1)[:, None].astype(np.float64)
    np.testing.assert_allclose(physical.jerk(path, 10.0), 6.0, rtol=1e-3)
    np.testing.assert_allclose(
        physical.speeds(2 * path[:, :, ::-1] / np.maximum(times, 1e-9)[:, None, None] ** 2, 10.0), 2.0, rtol=1e-3
    )


def test_rest_is_when_all_joints_rest():
    path = np.zeros((101, 2, 3))
    path[50:, 1, 0] = 0.02 * np.arange(51)  # 0.2 m/s in the second half
    assert float(physical.rest_share(path, 10.0)) == pytest.approx(0.5)


def test_feet_slide_only_while_they_stand():
    feet = np.zeros((101, 2, 3))
    assert physical.foot_skate(feet, 10.0) == (0.0, 0.0)
    feet[:, 0, 0] = 0.03 * np.arange(101)  # the left one slides at 0.3 m/s
    share, way = physical.foot_skate(feet, 10.0)
    assert (float(share), float(way)) == (pytest.approx(0.5), pytest.approx(0.15))
    feet[1:, 0, 1] = 0.2  # now it is in the air
    assert float(physical.foot_skate(feet, 10.0)[0]) == 0.0
