"""The generated talker's skeleton, the paths of its wrists, and inverse kinematics."""

import numpy as np
import pytest
from gestures_for_tests import JOINT, WRISTS

from a2g_jax.talker.ik import bend
from a2g_jax.talker.paths import Track, bump, draw_waves, minimum_jerk
from a2g_jax.talker.skeleton import PELVIS_HEIGHT, TALKER_SKELETON


def test_skeleton_is_an_adult_of_one_metre_seventy():
    skeleton = TALKER_SKELETON
    places = np.zeros((22, 3))
    places[0, 1] = PELVIS_HEIGHT
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        places[joint] = places[parent] + skeleton.offsets[joint]
    ends = {joint: places[joint] + end for joint, end in skeleton.ends}
    assert np.linalg.norm(places[WRISTS["left"]] - places[WRISTS["right"]]) == pytest.approx(1.364, abs=1e-4)
    assert ends[JOINT["Head"]][1] == pytest.approx(1.70, abs=1e-6)
    assert ends[JOINT["L_Foot"]][1] == pytest.approx(0.0, abs=1e-6)
    mirrored = places[WRISTS["right"]] * [-1, 1, 1]
    np.testing.assert_allclose(places[WRISTS["left"]], mirrored, atol=1e-7)


def test_steps_and_bumps_are_twice_continuous():
    x = np.linspace(-0.2, 1.2, 14001)
    for curve in (minimum_jerk(x), bump(x)):
        second = np.gradient(np.gradient(curve, x), x)
        assert np.abs(np.diff(second)).max() < 0.1
    assert minimum_jerk(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.0, 0.5, 1.0])
    assert bump(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.0, 1.0, 0.0])


def test_track_superposes_overlapping_steps():
    track = Track(np.zeros(1))
    track.step_to(np.ones(1), 0.0, 1.0)
    track.step_to(np.full(1, 3.0), 0.5, 1.5)
    track.add_pulse(np.full(1, 0.4), 2.0, 2.5, 3.0)
    times = np.array([-1.0, 0.4, 0.8, 1.7, 2.5, 4.0])
    expected = minimum_jerk(times) + 2.0 * minimum_jerk(times - 0.5)
    expected[4] += 0.4
    np.testing.assert_allclose(track.sample(times)[:, 0], expected, atol=1e-12)


def test_waves_have_the_size_asked_for():
    waves = draw_waves(np.random.default_rng(0), np.array([1.0, 0.2]), 0.1, 1.0)
    np.testing.assert_allclose(waves.sample(np.arange(0.0, 4000.0, 0.1)).std(axis=0), [1.0, 0.2], rtol=0.02)


def test_bend_reaches_its_end():
    rng = np.random.default_rng(0)
    start, direction = rng.normal(size=(200, 3)), rng.normal(size=(200, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    end = start + rng.uniform(0.2, 0.44, (200, 1)) * direction
    upper, inner, flexion = bend(start, end, rng.normal(size=(200, 3)), (0.25, 0.21), limit=False)
    lower = np.cos(flexion)[:, None] * upper + np.sin(flexion)[:, None] * inner
    np.testing.assert_allclose(start + 0.25 * upper + 0.21 * lower, end, atol=1e-9)
