"""Motions: exact resampling, positions across chunk edges, and their life as a pytree."""

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from a2g_jax.geometry.motion import Motion, resample
from a2g_jax.geometry.skeleton import Skeleton

SKELETON = Skeleton(np.array([[0, 0, 0], [0, 0.5, 0], [0.3, 0, 0.1]], np.float32), ("a", "b", "c"), (-1, 0, 1))


def spin(rates, frames, fps, skeleton=SKELETON):
    """Every joint turns at a constant rate (radians a second about its own axis) while the root walks straight."""
    times = np.arange(frames) / fps
    rotations = Rotation.from_rotvec((times[:, None, None] * np.asarray(rates)).reshape(-1, 3)).as_matrix()
    root = times[:, None] * np.array([0.2, 0.0, 1.0]) + np.array([0, 0.9, 0])
    return Motion(rotations.reshape(frames, -1, 3, 3).astype(np.float32), root.astype(np.float32), skeleton, fps)


RATES = [[0.3, 0.2, -0.1], [2.0, 0, 1.0], [-1.0, 4.0, 0.5]]


def jerky(frames, seed=0, fps=15.0):
    random = np.random.default_rng(seed)
    turns = Rotation.random(frames * 3, rng=random).as_matrix().reshape(frames, 3, 3, 3)
    return Motion(turns.astype(np.float32), random.normal(size=(frames, 3)).astype(np.float32), SKELETON, fps)


def angles(first, second):
    between = np.swapaxes(np.asarray(first, np.float64), -1, -2) @ np.asarray(second, np.float64)
    return Rotation.from_matrix(between.reshape(-1, 3, 3)).magnitude()


def test_length():
    motion = jerky(45)
    assert motion.frames == 45
    assert motion.seconds == 3.0


class TestResample:
    def test_same_rate_is_the_same_motion(self):
        motion = jerky(7)
        assert resample(motion, 15.0) is motion

    def test_twice_the_rate_contains_the_originals(self):
        motion = jerky(20)
        double = resample(motion, 30.0)
        assert double.fps == 30.0
        assert double.frames == 40
        np.testing.assert_allclose(double.rotations[::2], motion.rotations, atol=2e-6)
        np.testing.assert_allclose(double.root[::2], motion.root, atol=1e-6)

    def test_there_and_back(self):
        motion = jerky(20)
        back = resample(resample(motion, 30.0), 15.0)
        assert back.frames == 20
        np.testing.assert_allclose(back.rotations, motion.rotations, atol=2e-6)
        np.testing.assert_allclose(back.root, motion.root, atol=1e-6)

    @settings(max_examples=15, deadline=None)
    @given(st.sampled_from([7.5, 15.0, 20.0, 24.0, 25.0, 29.97, 30.0, 60.0, 120.0]), st.integers(2, 700))
    def test_constant_speed_stays_exact(self, fps, frames):
        motion = spin(RATES, frames, 30.0)
        result = resample(motion, fps)
        assert result.frames == max(1, round(frames / 30.0 * fps))
        exact = spin(RATES, result.frames, fps)
        covered = np.arange(result.frames) / fps <= (frames - 1) / 30.0
        assert angles(result.rotations[covered], exact.rotations[covered]).max() < 1e-5
        np.testing.assert_allclose(result.root[covered], exact.root[covered], rtol=1e-5, atol=1e-5)

    def test_between_frames_it_is_scipys_slerp(self):
        motion = jerky(12)
        result = resample(motion, 20.0)
        times = np.arange(result.frames) / 20.0
        covered = times <= 11 / 15.0
        for joint in range(3):
            track = Slerp(np.arange(12) / 15.0, Rotation.from_matrix(motion.rotations[:, joint]))
            expected = track(np.minimum(times[covered], 11 / 15.0)).as_matrix()
            np.testing.assert_allclose(result.rotations[covered, joint], expected, atol=2e-5)

    def test_the_last_frame_is_held(self):
        motion = jerky(5)
        result = resample(motion, 15.0, frames=9)
        np.testing.assert_allclose(result.rotations[5:], np.broadcast_to(motion.rotations[4], (4, 3, 3, 3)), atol=2e-6)
        np.testing.assert_array_equal(result.root[5:], np.broadcast_to(motion.root[4], (4, 3)))

    def test_fewer_frames_than_there_are(self):
        motion = jerky(9)
        np.testing.assert_allclose(resample(motion, 15.0, frames=4).rotations, motion.rotations[:4], atol=2e-6)

    def test_a_single_frame(self):
        result = resample(jerky(1), 60.0)
        assert result.frames == 4
        np.testing.assert_allclose(result.rotations, np.broadcast_to(jerky(1).rotations, (4, 3, 3, 3)), atol=2e-6)

    def test_timestamps_do_not_drift(self):
        """Ten minutes from 30 to 29.97 fps: the last frame shows its own time, 18 frames of the input away."""
        motion = spin([[0.3, 0, 0]] * 3, 18000, 30.0)
        result = resample(motion, 29.97)
        times = np.arange(result.frames) / 29.97
        np.testing.assert_allclose(result.root[:, 2], times, rtol=2e-6, atol=1e-6)

    def test_no_frames_is_refused(self):
        with pytest.raises(ValueError, match="empty motion"):
            resample(jerky(3).clip(0, 0), 30.0)

    def test_result_is_float32_rotations(self):
        result = resample(jerky(8), 24.0)
        assert result.rotations.dtype == np.float32
        assert result.root.dtype == np.float32
        gram = np.swapaxes(result.rotations, -1, -2) @ result.rotations
        np.testing.assert_allclose(gram, np.broadcast_to(np.eye(3), gram.shape), atol=2e-6)


@pytest.mark.parametrize("frames", [0, 1, 511, 512, 513, 1025])
def test_positions_at_chunk_edges(frames):
    motion = jerky(frames)
    offsets = np.asarray(SKELETON.offsets, np.float64)
    world, place = motion.rotations[:, 0].astype(np.float64), motion.root.astype(np.float64)
    expected = [place]
    for joint in (1, 2):
        place = place + world @ offsets[joint]
        world = world @ motion.rotations[:, joint]
        expected.append(place)
    result = motion.positions()
    assert result.shape == (frames, 3, 3)
    np.testing.assert_allclose(result, np.stack(expected, axis=1), atol=5e-6)


def test_clip():
    motion = jerky(10)
    clip = motion.clip(3, 7)
    assert clip.frames == 4
    np.testing.assert_array_equal(clip.rotations, motion.rotations[3:7])
    np.testing.assert_array_equal(clip.root, motion.root[3:7])
    assert clip.fps == motion.fps


class TestPytree:
    def test_leaves_are_the_arrays(self):
        leaves = jax.tree.leaves(jerky(4))
        assert sorted(leaf.shape for leaf in leaves) == [(3, 3), (4, 3), (4, 3, 3, 3)]

    def test_map_keeps_static_fields(self):
        motion = jerky(4)
        result = jax.tree.map(lambda x: x + 1, motion)
        np.testing.assert_array_equal(result.root, motion.root + 1)
        np.testing.assert_array_equal(result.skeleton.offsets, SKELETON.offsets + 1)
        assert result.fps == 15.0
        assert result.skeleton.names == ("a", "b", "c")

    def test_goes_through_jit(self):
        motion = jerky(4)
        result = jax.jit(lambda m: jax.tree.map(lambda x: 2 * x, m))(motion)
        np.testing.assert_allclose(result.root, 2 * motion.root)
        assert result.skeleton.parents == (-1, 0, 1)

    def test_fps_is_part_of_the_structure(self):
        assert jax.tree.structure(jerky(4)) != jax.tree.structure(jerky(4, fps=30.0))
        assert jax.tree.structure(jerky(4)) == jax.tree.structure(jerky(9, seed=1))
