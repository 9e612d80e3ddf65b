"""The filter of ``--smooth``."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.geometry.smooth import smooth

SKELETON = Skeleton(np.ones((2, 3), np.float32), ("a", "b"), (-1, 0))
TIME = np.arange(300) / 60


def turning(*waves):
    """Joints that turn about x by sums of (degrees, Hz), through more than a half turn."""
    angle = sum(degrees * np.sin(2 * np.pi * hertz * TIME) for degrees, hertz in waves)
    turns = Rotation.from_euler("x", angle[:, None], degrees=True).as_matrix()
    rotations = np.repeat(turns[:, None], 2, axis=1).astype(np.float32)
    root = np.stack([angle, 0 * angle, 0 * angle], axis=1).astype(np.float32) / 100
    return Motion(rotations, root, SKELETON, 60.0)


def test_slow_motion_stays_and_shaking_goes():
    slow, both = turning((30, 0.5)), turning((30, 0.5), (4, 20))
    assert rotation_angle(smooth(slow, 6.0).rotations, slow.rotations).max() < 0.1
    inner = slice(20, -20)
    assert rotation_angle(smooth(both, 6.0).rotations, slow.rotations)[inner].max() < 0.15
    assert np.abs(smooth(both, 6.0).root - slow.root)[inner].max() < 0.0015


def test_no_delay_and_no_signs():
    """Full turns, whose quaternions change sign, and the phase of a wave near the cutoff."""
    turns = turning((400, 0.3))
    assert rotation_angle(smooth(turns, 6.0).rotations, turns.rotations).max() < 0.5
    wave = smooth(turning((10, 5)), 6.0).root[:, 0]
    before = turning((10, 5)).root[:, 0]
    lags = [np.dot(np.roll(wave, lag)[30:-30], before[30:-30]) for lag in (-1, 0, 1)]
    assert lags[1] == max(lags)
    np.testing.assert_allclose(np.linalg.det(smooth(turns, 6.0).rotations), 1, atol=1e-5)


def test_short_takes_and_bounds():
    motion = turning((30, 0.5), (3, 20))
    for frames in (1, 2, 3, 5, 12):
        assert smooth(motion.clip(0, frames), 6.0).frames == frames
    kept = smooth(motion, 6.0, start=10)
    np.testing.assert_array_equal(kept.rotations[:10], motion.rotations[:10])
    assert kept.frames == motion.frames
    with pytest.raises(InputError, match="below half of the frame rate, 30 Hz"):
        smooth(motion, 30.0)
