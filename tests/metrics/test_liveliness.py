"""Statistics of lively motion on motions whose values are known."""

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton
from a2g_jax.metrics import liveliness
from a2g_jax.metrics.liveliness import Body
from a2g_jax.metrics.pooled import jackknife, pooled_mean, pooled_quantile
from a2g_jax.metrics.rhythm import speech_envelope

FPS = 100.0
PELVIS, HEAD = BODY_JOINTS.index("Pelvis"), BODY_JOINTS.index("Head")
L_WRIST, R_WRIST = BODY_JOINTS.index("L_Wrist"), BODY_JOINTS.index("R_Wrist")
FEET = [BODY_JOINTS.index(f"{side}_{part}") for part in ("Ankle", "Foot") for side in "LR"]


def still(frames: int = 1000) -> Body:
    """A body that does not move."""
    joints = np.tile(np.random.default_rng(0).normal(size=(1, 22, 3)), (frames, 1, 1))
    eye = np.tile(np.eye(3), (frames, 1, 1))
    return Body(joints, eye, eye, FPS)


def moved(joints: list[int], path) -> Body:
    """A still body of which some joints follow a path."""
    body = still(len(path))
    body.joints[:, joints] += path[:, None]
    return body


def wave(amplitude: float, hertz: float, frames: int = 1000) -> np.ndarray:
    path = np.zeros((frames, 3))
    path[:, 0] = amplitude * np.sin(2 * np.pi * hertz * np.arange(frames) / FPS)
    return path


def turned(degrees: np.ndarray) -> np.ndarray:
    """Rotations about the vertical."""
    angle = np.radians(degrees)
    rotations = np.tile(np.eye(3), (len(angle), 1, 1))
    rotations[:, 0, 0] = rotations[:, 2, 2] = np.cos(angle)
    rotations[:, 0, 2], rotations[:, 2, 0] = np.sin(angle), -np.sin(angle)
    return rotations


def test_a_still_body():
    body = still()
    assert liveliness.wrist_speeds(body).max() == liveliness.wrist_jerk(body).max() == 0.0
    assert liveliness.hands_at_rest(body).all()
    assert liveliness.pelvis_sway(body) == pytest.approx(0.0, abs=1e-6)
    assert liveliness.feet_slide(body) == 0.0
    assert liveliness.yaw_deviation(body.head) == 0.0
    assert liveliness.hand_dominance(body) == liveliness.hands_together(body) == 0.0


def test_speed_and_jerk_of_a_swinging_wrist():
    amplitude, hertz = 0.1, 1.0
    body = moved([L_WRIST], wave(amplitude, hertz))
    omega = 2 * np.pi * hertz
    speed, jerk = liveliness.wrist_speeds(body), liveliness.wrist_jerk(body)
    assert speed[:, 0].max() == pytest.approx(amplitude * omega, rel=0.01)
    assert np.median(speed[:, 0]) == pytest.approx(amplitude * omega / np.sqrt(2), rel=0.02)
    assert np.median(jerk[:, 0]) == pytest.approx(amplitude * omega**3 / np.sqrt(2), rel=0.02)
    assert speed[:, 1].max() == 0.0
    assert liveliness.hand_dominance(body) == pytest.approx(1.0)


def test_jerk_of_noise():
    # Third differences of independent noise have 1 + 9 + 9 + 1 = 20 times its variance.
    noise = np.random.default_rng(1).normal(size=(20000, 3)) * 1e-3
    jerk = liveliness.wrist_jerk(moved([R_WRIST], noise))[:, 1]
    assert np.sqrt(np.mean(np.square(jerk))) == pytest.approx(1e-3 * np.sqrt(3 * 20) * FPS**3, rel=0.03)


def test_what_moves_with_the_pelvis_is_no_movement_of_the_hands():
    body = moved(list(range(22)), wave(0.3, 1.0))
    assert liveliness.wrist_speeds(body).max() < 1e-9
    assert liveliness.hands_at_rest(body).all()
    assert liveliness.pelvis_sway(body) == pytest.approx(0.0, abs=1e-6)


def test_rest_needs_both_hands():
    frames = 1000
    path = wave(0.1, 1.0, frames)
    path[frames // 2 :] = 0.0
    rest = liveliness.hands_at_rest(moved([L_WRIST], path))
    assert rest[frames // 2 + 30 :].all()
    assert rest[: frames // 2 - 30].mean() < 0.1  # the turning points


@pytest.mark.parametrize("start", [0.0, 170.0])
def test_yaw_about_any_heading(start):
    degrees = 10.0 * np.sin(2 * np.pi * np.arange(1000) / 100)
    assert liveliness.yaw_deviation(turned(start + degrees)) == pytest.approx(10 / np.sqrt(2), rel=1e-6)


def test_the_head_turns_relative_to_the_pelvis():
    skeleton = Skeleton(np.ones((22, 3), np.float32), BODY_JOINTS, BODY_PARENTS)
    rotations = np.tile(np.eye(3, dtype=np.float32), (200, 22, 1, 1))
    rotations[:, PELVIS] = turned(20 * np.sin(np.arange(200)))
    body = liveliness.body_of(Motion(rotations, np.zeros((200, 3), np.float32), skeleton, 30.0))
    assert liveliness.yaw_deviation(body.pelvis) == pytest.approx(20 / np.sqrt(2), rel=0.02)
    assert liveliness.yaw_deviation(body.head) == pytest.approx(0.0, abs=1e-3)
    rotations[:, HEAD] = turned(8 * np.sin(np.arange(200)))
    body = liveliness.body_of(Motion(rotations, np.zeros((200, 3), np.float32), skeleton, 30.0))
    assert liveliness.yaw_deviation(body.head) == pytest.approx(8 / np.sqrt(2), rel=0.02)


def test_a_body_without_arms_is_refused():
    skeleton = Skeleton(np.ones((2, 3), np.float32), ("Pelvis", "Head"), (-1, 0))
    motion = Motion(np.tile(np.eye(3), (5, 2, 1, 1)), np.zeros((5, 3)), skeleton, 30.0)
    with pytest.raises(InputError, match="retarget"):
        liveliness.body_of(motion)


def test_feet_that_slide_by_a_known_speed():
    path = np.zeros((1000, 3))
    path[:, 2] = 0.02 * np.arange(1000) / FPS
    assert liveliness.feet_slide(moved(FEET, path)) == pytest.approx(20.0, rel=1e-3)


def test_sway_over_the_feet():
    body = moved([PELVIS], wave(0.05, 1.0))
    assert liveliness.pelvis_sway(body) == pytest.approx(5.0 / np.sqrt(2), rel=1e-3)


def test_hands_that_move_together():
    path = np.cumsum(np.random.default_rng(2).normal(size=(1000, 3)), axis=0) * 1e-3
    assert liveliness.hands_together(moved([L_WRIST, R_WRIST], path)) == pytest.approx(1.0)


def test_distance_between_motions():
    first, second = still(), moved([L_WRIST], np.tile([0.0, 0.3, 0.0], (1000, 1)))
    joints, wrists = liveliness.distance_between([first, second])
    assert joints == pytest.approx(30.0 / 22)
    assert wrists == pytest.approx(15.0)
    with pytest.raises(ValueError, match="two"):
        liveliness.distance_between([first])


@pytest.mark.parametrize("noise", [1e-5, 1e-3])
def test_pauses_at_any_level_of_noise(noise):
    rate, rng = 16000, np.random.default_rng(3)
    audio = noise * rng.normal(size=6 * rate)
    audio[: 2 * rate] += 0.2 * rng.normal(size=2 * rate)
    audio[4 * rate :] += 0.2 * rng.normal(size=2 * rate)
    pause, speech = liveliness.speech_pauses(speech_envelope(audio, rate, 30.0, 180), 30.0)
    assert speech[:59].all()
    assert speech[125:].all()
    assert not speech[70:110].any()
    assert pause[80:100].all()
    assert not pause[:65].any()
    assert not (pause & speech).any()


def test_pooled_quantiles_and_means():
    rng = np.random.default_rng(0)
    groups = [rng.normal(size=size) for size in (50, 500, 7, 0, 20, 90)]
    together = np.concatenate(groups)
    for share in (0.5, 0.9):
        found = pooled_quantile(groups, share)
        assert found.mean == pytest.approx(np.quantile(together, share, method="inverted_cdf"))
        assert found.low <= found.mean <= found.high
        assert found.clips == 5
    mean = pooled_mean(groups)
    assert mean.mean == pytest.approx(together.mean())
    assert mean.low < mean.mean < mean.high
    assert np.isnan(pooled_quantile([], 0.5).mean)
    assert np.isnan(pooled_mean([groups[0]]).low)


def test_intervals_of_groups_are_wider_than_of_frames():
    # Frames of a recording are alike: ten recordings are ten values.
    rng = np.random.default_rng(4)
    levels = rng.normal(size=10)
    groups = [np.full(1000, level) for level in levels]
    found = pooled_mean(groups)
    # Student's t of ten values.
    assert found.high - found.low == pytest.approx(2 * 2.262 * levels.std(ddof=1) / np.sqrt(10), rel=1e-3)


def test_the_jackknife_of_a_mean_is_its_standard_error():
    values = np.random.default_rng(5).normal(size=20)
    found = jackknife(lambda chosen: float(values[list(chosen)].mean()), 20)
    assert found.mean == pytest.approx(values.mean())
    assert found.high - found.mean == pytest.approx(2.093 * values.std(ddof=1) / np.sqrt(20), rel=1e-3)
