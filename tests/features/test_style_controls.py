"""Height, speed and radius of the hands: against a loop, under shifts, turns, mirrors and time run backwards."""

import jax
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.features.style_controls import hand_height, hand_radius, hand_speed, moving_mean
from a2g_jax.geometry.mirror import mirror
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.rotation import axis_angle_from_matrix, matrix_to_6d
from a2g_jax.models.base import Data
from a2g_jax.models.stylized_flow.controls import SCALES, check_controls, measure
from a2g_jax.talker.recordings import talk

FPS = 30.0
NAMES = tuple(SCALES)


@pytest.fixture(scope="module")
def motion():
    return talk(8.0, seed=4, speaker="chiara").motion


@pytest.fixture(scope="module")
def hands(motion):
    places = motion.positions().astype(np.float64)
    return places[:, [motion.skeleton.index("L_Wrist"), motion.skeleton.index("R_Wrist")]], places[:, 0]


def in_a_loop(values, reach):
    return np.array([np.mean(values[max(0, t - reach) : t + reach + 1]) for t in range(len(values))])


def measured(motion: Motion, representation="6d", names=NAMES):
    write = matrix_to_6d if representation == "6d" else axis_angle_from_matrix
    rows = np.asarray(jax.jit(write)(motion.rotations))
    nothing = Statistics(np.zeros(rows.shape[1:], np.float32), np.ones(rows.shape[1:], np.float32))
    data = Data(PoseSpace(motion.skeleton, representation), motion.fps, 4, nothing)
    return np.asarray(jax.jit(lambda pose: measure(names, data, pose))(rows[None])[0])


def test_controls_are_those_of_a_loop(hands):
    wrists, root = hands
    height, radius, speed = [], [], []
    for t, (both, centre) in enumerate(zip(wrists, root, strict=True)):
        height.append(np.mean([y - centre[1] for _, y, _ in both]))
        radius.append(np.mean([np.hypot(x - centre[0], z - centre[2]) for x, _, z in both]))
        near = [(a, a + 1) for a in (t - 1, t) if a >= 0 and a + 1 < len(wrists)]
        speed.append(np.mean([np.linalg.norm(wrists[b, h] - wrists[a, h]) * FPS for a, b in near for h in (0, 1)]))
    wrists, root = wrists.astype(np.float32), root.astype(np.float32)
    np.testing.assert_allclose(hand_height(wrists, root, FPS), in_a_loop(height, 60), atol=1e-5)
    np.testing.assert_allclose(hand_radius(wrists, root, FPS), in_a_loop(radius, 60), atol=1e-5)
    np.testing.assert_allclose(hand_speed(wrists, FPS), in_a_loop(speed, 60), atol=1e-4)
    np.testing.assert_allclose(hand_height(wrists[:, :1], root, FPS, 0.0), wrists[:, 0, 1] - root[:, 1], atol=1e-5)


def test_a_moving_mean_is_exact_over_thousands_of_frames(getkey):
    values = np.asarray(100.0 + jax.random.normal(getkey(), (6000,)))
    np.testing.assert_allclose(moving_mean(values, 40), in_a_loop(values.astype(np.float64), 40), rtol=2e-6)
    # A window beyond both ends is the mean of all.
    np.testing.assert_allclose(moving_mean(values[:50], 80), np.full(50, values[:50].mean()), rtol=1e-6)


def test_a_shift_and_a_turn_about_the_vertical_change_nothing(hands):
    wrists, root = hands
    angle, shift = 0.8, np.array([3.0, -1.0, 2.0])
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    moved, centre = (wrists @ turn.T + shift).astype(np.float32), (root @ turn.T + shift).astype(np.float32)
    wrists, root = wrists.astype(np.float32), root.astype(np.float32)
    for control in (hand_height, hand_radius):
        np.testing.assert_allclose(control(moved, centre, FPS), control(wrists, root, FPS), atol=1e-5)
    np.testing.assert_allclose(hand_speed(moved, FPS), hand_speed(wrists, FPS), atol=1e-4)
    # Backwards in time, the averages run backwards.
    np.testing.assert_allclose(hand_speed(wrists[::-1], FPS), hand_speed(wrists, FPS)[::-1], atol=1e-4)
    assert hand_speed(wrists[:1], FPS).tolist() == [0.0]


@pytest.mark.parametrize("representation", ["6d", "exponential"])
def test_a_mirror_exchanges_the_hands(motion, representation):
    plain, mirrored = measured(motion, representation), measured(mirror(motion), representation)
    columns = [NAMES.index(name) for name in ("height", "right_height", "left_height", "speed", "radius")]
    np.testing.assert_allclose(mirrored, plain[:, columns], atol=2e-3)
    assert np.abs(plain[:, 1] - plain[:, 2]).max() > 0.01


def test_poses_are_measured_where_their_joints_are(motion, hands):
    wrists, root = (places.astype(np.float32) for places in hands)
    of = dict(zip(NAMES, measured(motion).T, strict=True))
    np.testing.assert_allclose(of["height"], hand_height(wrists, root, FPS), atol=1e-4)
    np.testing.assert_allclose(of["left_height"], hand_height(wrists[:, :1], root, FPS), atol=1e-4)
    np.testing.assert_allclose(of["radius"], hand_radius(wrists, root, FPS), atol=1e-4)
    # Relative to the root: how the body goes is no speed of the hands.
    np.testing.assert_allclose(of["speed"], hand_speed(wrists - root[:, None], FPS), atol=1e-3)


def test_poses_without_wrists_are_refused(motion):
    nothing = Statistics(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
    points = Data(PoseSpace(PoseLayout(("a", "b"), ((0, 1),)), "directions"), FPS, 4, nothing)
    with pytest.raises(InputError, match=r"--style-controls: .* holds bone directions"):
        check_controls(("height",), points)
    check_controls((), points)
    names = tuple(name.replace("Wrist", "Claw") for name in motion.skeleton.names)
    clawed = type(motion.skeleton)(motion.skeleton.offsets, names, motion.skeleton.parents)
    with pytest.raises(InputError, match="L_Wrist, R_Wrist"):
        check_controls(("height",), Data(PoseSpace(clawed), FPS, 4, nothing))
