"""Gains of motion: what they leave alone, and that motion has the recorded dynamics after a fit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from a2g_jax.features.dynamics import EDGES, Dynamics, rows_with_dynamics, split, with_dynamics
from a2g_jax.features.dynamics_fit import SHARES, Moved, fit_dynamics, moved_by, recorded_step
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.talker.recordings import talk

FPS, ROWS = 30.0, 3
#: Rows that move a point each, their own values.
ALONE = Moved(np.eye(ROWS), np.ones(ROWS), np.asarray)


def noise(seed: int, *, frames: int = 1500, smooth: float = 3.0, scale: float = 1.0) -> np.ndarray:
    """Values whose movements are slower the larger ``smooth`` is, of standard deviation ``scale``."""
    rough = np.random.default_rng(seed).normal(size=(frames, ROWS, 2))
    values = gaussian_filter1d(rough, smooth, axis=0)
    return (scale * values / values.std()).astype(np.float32)


def no_gains(rows: int = ROWS, width: int = 2) -> Dynamics:
    levels = np.broadcast_to(np.linspace(-3.0, 3.0, len(SHARES)), (len(EDGES), rows, len(SHARES)))
    return Dynamics(
        mean=np.full((rows, width), 0.3),
        shift=np.zeros((rows, width)),
        std=np.full((rows, width), 0.7),
        weight=np.ones(rows),
        slow=np.zeros(rows),
        levels=levels,
        gains=np.zeros_like(levels),
        speed_levels=levels[0, 0],
        speed_gains=np.zeros(len(SHARES)),
    )


def power(values: np.ndarray) -> np.ndarray:
    """Mean square of each band."""
    return np.array([np.mean(np.square(band)) for band in split(values, FPS)[1]])


def test_gains_of_one_change_nothing():
    values = noise(0)
    np.testing.assert_array_equal(with_dynamics(values, no_gains(), FPS), values)
    motion = talk(4.0, 1).motion
    for kind in ("6d", "exponential", "euler"):
        space = PoseSpace(motion.skeleton, kind)
        rows = space.write(np.asarray(motion.rotations, np.float32))
        found = rows_with_dynamics(space, rows, no_gains(space.rows, 6), FPS)
        np.testing.assert_allclose(found, rows, atol=2e-5)


@pytest.mark.parametrize("frames", [0, 1, 2, 7])
def test_a_few_frames_are_no_special_case(frames):
    louder = replace(no_gains(), gains=no_gains().gains + 1.0)
    found = with_dynamics(noise(0, frames=60)[:frames], louder, FPS)
    assert found.shape == (frames, ROWS, 2)
    assert np.all(np.isfinite(found))


def test_bands_are_the_values_and_hold_their_frequencies():
    values = noise(0)
    slow, bands = split(values, FPS)
    np.testing.assert_allclose(slow + sum(bands), values, atol=1e-5)
    wave = np.sin(2.0 * np.pi * 3.0 * np.arange(600) / FPS)[:, None, None]
    assert EDGES[int(np.argmax(power(wave)))] == 2.0


def test_a_gain_acts_where_its_band_is_strong():
    """Twice the amplitude above the middle level, and as it was below: shaking stays small, gestures grow."""
    values = noise(0, smooth=2.0)
    values[:700] *= 0.05
    gains = np.where(no_gains().levels > -1.5, np.log(2.0), 0.0)
    found = with_dynamics(values, replace(no_gains(), mean=np.zeros((ROWS, 2)), gains=gains), FPS)
    ratio = lambda part: np.diff(found[part], axis=0).std() / np.diff(values[part], axis=0).std()  # noqa: E731
    assert ratio(slice(50, 600)) < 1.1
    assert ratio(slice(800, 1450)) > 1.7


def test_motion_has_the_recorded_power_in_each_band():
    """Generated motion that is half as strong and slower: after the fit its bands are the person's, on other motion."""
    person, calm = noise(1, smooth=1.5), [noise(seed, smooth=2.0, scale=0.5) for seed in (2, 3)]
    dynamics = fit_dynamics(calm, [person + 1.0], ALONE, FPS)
    other = noise(4, smooth=2.0, scale=0.5)
    before, after = (power(values) / power(person) for values in (other, with_dynamics(other, dynamics, FPS)))
    assert np.all(before[1:] < 0.32)
    # The highest bands are nearly empty in the generated motion.
    np.testing.assert_allclose(after[1:-2], 1.0, atol=0.15)
    assert np.all(after[-2:] > 0.5)
    assert np.exp(np.abs(dynamics.gains).max()) <= 4.0 + 1e-6
    assert with_dynamics(other, dynamics, FPS).mean() == pytest.approx(1.0, abs=0.1)


def test_motion_rests_as_the_recorded_one():
    person = noise(1)
    for start in range(0, 1500, 300):
        person[start : start + 60] = person[start]
    even = [noise(seed) for seed in (2, 3)]
    dynamics = fit_dynamics(even, [person], ALONE, FPS)
    slow = lambda values: np.mean(np.linalg.norm(np.diff(values, axis=0).reshape(-1, 6), axis=1) * FPS < 1.5)  # noqa: E731
    assert slow(person) > 0.15
    assert slow(noise(4)) < 0.02
    assert slow(with_dynamics(noise(4), dynamics, FPS)) > 0.06


def test_little_data_changes_little():
    person, calm = noise(1, smooth=1.5), [noise(2, smooth=2.5, scale=0.5)]
    long, short = (fit_dynamics(calm, [person[:frames]], ALONE, FPS) for frames in (1500, 30))
    assert np.abs(short.gains).mean() < 0.5 * np.abs(long.gains).mean()


def test_joints_move_what_is_below_them():
    skeleton = talk(2.0, 1).motion.skeleton
    moved = moved_by(PoseSpace(skeleton))
    elbow, wrist = skeleton.names.index("L_Elbow"), skeleton.names.index("L_Wrist")
    assert moved.points[elbow, wrist] == 1.0
    assert moved.points[elbow].sum() == 1.0
    assert not moved.points[wrist].any()
    assert moved.lever[elbow] == pytest.approx(np.linalg.norm(np.asarray(skeleton.offsets)[wrist]))
    motion = talk(2.0, 1).motion
    six = PoseSpace(skeleton).write(np.asarray(motion.rotations))
    places = motion.positions() - motion.positions()[:, :1]
    np.testing.assert_allclose(moved.positions(six), places, atol=1e-4)


def test_arrays_of_other_shapes_are_refused():
    arrays = no_gains().arrays()
    assert np.array_equal(Dynamics.of(arrays).levels, arrays["levels"])
    with pytest.raises(ValueError, match="dynamics/gains: expected"):
        Dynamics.of({**arrays, "gains": arrays["gains"][:, :2]})
    with pytest.raises(ValueError, match="NaN"):
        Dynamics.of({**arrays, "slow": np.full(ROWS, np.nan, np.float32)})


def test_jerk_is_the_recorded_one_where_its_rate_is_known():
    """Bands alone leave it too high where the recorded motion is at the lower end of its bands."""
    jerk = lambda one, step: np.median(np.abs(np.diff(one[::step], n=3, axis=0)))  # noqa: E731
    drawn, recorded = [noise(1, smooth=1.6)], [noise(2, smooth=2.4)]
    found = fit_dynamics(drawn, recorded, ALONE, FPS, FPS)
    ours, theirs = jerk(with_dynamics(drawn[0], found, FPS), 1), jerk(recorded[0], 1)
    assert abs(np.log2(ours / theirs)) < 0.25 < abs(np.log2(jerk(drawn[0], 1) / theirs))
    # A recording at half the rate has kinks between its frames, which count as no jerk.
    slow = recorded[0].copy()
    slow[1:-1:2] = (slow[:-2:2] + slow[2::2]) / 2.0
    found = fit_dynamics(drawn, [slow], ALONE, FPS, FPS / 2)
    ours, theirs = jerk(with_dynamics(drawn[0], found, FPS), 2), jerk(slow, 2)
    assert abs(np.log2(ours / theirs)) < 0.25


@pytest.mark.parametrize(
    ("recorded", "expected"),
    [
        (None, (1, False)),
        (15.0, (2, True)),
        (30.0, (1, True)),
        (120.0, (1, True)),
        (25.0, (1, False)),
        (10.0, (3, True)),
    ],
)
def test_the_step_from_one_recorded_frame_to_the_next(recorded, expected):
    assert recorded_step(30.0, recorded) == expected
