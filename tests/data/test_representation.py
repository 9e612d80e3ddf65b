"""Poses as a corpus writes them down, and poses without a skeleton."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.geometry.pose_track import PoseTrack, represent, resample_track
from a2g_jax.geometry.skeleton import Skeleton

ARM = Skeleton(
    np.array([[0, 0, 0], [0, 0.3, 0], [0.25, 0, 0], [0, 0, 0]], np.float32),
    ("chest", "shoulder", "wrist", "palm"),
    (-1, 0, 1, 2),
)


def arm_motion(seed: int, frames: int = 7) -> Motion:
    """Random rotations of four joints, the last of which coincides with its parent."""
    rng = np.random.default_rng(seed)
    turns = Rotation.random(frames * 4, random_state=rng).as_matrix().reshape(frames, 4, 3, 3)
    return Motion(turns.astype(np.float32), rng.normal(size=(frames, 3)).astype(np.float32), ARM, 20.0)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["6d", "exponential"]))
def test_rotations_come_back(seed, pose):
    motion = arm_motion(seed)
    values, body = represent(motion, pose, "a take")
    assert body is motion.skeleton
    assert values.shape == (7, 4, 6 if pose == "6d" else 3)
    np.testing.assert_allclose(rotations_from_rows(values, pose), motion.rotations, atol=2e-3 if pose != "6d" else 1e-5)


def test_exponential_maps_are_scipys_rotation_vectors():
    motion = arm_motion(3, frames=50)
    values, _ = represent(motion, "exponential", "a take")
    expected = Rotation.from_matrix(np.asarray(motion.rotations).reshape(-1, 3, 3)).as_rotvec().reshape(50, 4, 3)
    near_pi = np.linalg.norm(expected, axis=-1) > np.pi - 0.01  # where both signs are right
    np.testing.assert_allclose(values[~near_pi], expected[~near_pi], atol=1e-4)


def test_directions_rebuild_the_positions():
    motion = arm_motion(5)
    values, layout = represent(motion, "directions", "a take")
    assert layout.bones == ((0, 1), (1, 2))  # none to the palm, which lies on the wrist
    np.testing.assert_allclose(np.linalg.norm(values, axis=-1), 1.0, atol=1e-6)
    places = motion.positions()
    for bone, (start, end) in enumerate(layout.bones):
        np.testing.assert_allclose(places[:, end], places[:, start] + layout.lengths[bone] * values[:, bone], atol=1e-5)


def test_a_rig_shows_no_keypoints_and_a_video_no_rotations():
    with pytest.raises(InputError, match=r"a take: holds rotations of joints; prepare it with --pose 6d"):
        represent(arm_motion(0), "keypoints", "a take")
    track = PoseTrack("keypoints", np.zeros((4, 2, 2), np.float32), PoseLayout(("a", "b"), ((0, 1),)), 15.0)
    with pytest.raises(InputError, match=r"a take: holds keypoints; prepare it with --pose keypoints"):
        represent(track, "6d", "a take")


def test_layouts_and_tracks_refuse_what_does_not_fit():
    with pytest.raises(ValueError, match="a point that is not there"):
        PoseLayout(("a",), ((0, 1),))
    with pytest.raises(ValueError, match="expected 1 lengths"):
        PoseLayout(("a", "b"), ((0, 1),), (0.1, 0.2))
    layout = PoseLayout(("a", "b", "c"), ((0, 1), (1, 2)))
    with pytest.raises(ValueError, match="expected 2 directions in each frame; got 3"):
        PoseTrack("directions", np.zeros((4, 3, 3), np.float32), layout, 15.0)


class TestResampling:
    def test_a_straight_path_stays_straight(self):
        at = np.arange(31, dtype=np.float32) / 30.0
        values = np.stack([at * 3.0, at * -2.0 + 1.0], axis=-1)[:, None]
        track = PoseTrack("keypoints", values, PoseLayout(("a",), ()), 30.0)
        again = resample_track(track, 12.5, 13)
        times = np.arange(13) / 12.5
        np.testing.assert_allclose(again.values[:, 0], np.stack([times * 3.0, times * -2.0 + 1.0], -1), atol=1e-5)
        assert (again.fps, again.frames) == (12.5, 13)

    def test_directions_stay_unit_vectors(self):
        rng = np.random.default_rng(0)
        values = rng.normal(size=(20, 1, 3))
        values /= np.linalg.norm(values, axis=-1, keepdims=True)
        values[5] = -values[4]  # no direction lies between
        track = PoseTrack("directions", values.astype(np.float32), PoseLayout(("a", "b"), ((0, 1),)), 15.0)
        again = resample_track(track, 30.0, 39)
        np.testing.assert_allclose(np.linalg.norm(again.values, axis=-1), 1.0, atol=1e-5)
        np.testing.assert_allclose(again.values[::2], track.values, atol=1e-6)

    def test_the_same_rate_changes_nothing(self):
        values = np.random.default_rng(1).normal(size=(9, 1, 2)).astype(np.float32)
        track = PoseTrack("keypoints", values, PoseLayout(("a",), ()), 15.0)
        np.testing.assert_array_equal(resample_track(track, 15.0, 7).values, values[:7])
