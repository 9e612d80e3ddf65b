"""Dropping joints without moving those that stay."""

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.body_joints import find_body
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.select import select_joints
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh import read_bvh

#: 0 hips - 1 spine - 2 chest - 3 neck - 4 head, 2 - 5 arm - 6 hand - 7 finger, 0 - 8 leg
NAMES = ("hips", "spine", "chest", "neck", "head", "arm", "hand", "finger", "leg")
PARENTS = (-1, 0, 1, 2, 3, 2, 5, 6, 0)


def make(frames=5, still=(), seed=0, ends=((4, (0.0, 0.2, 0.0)), (8, (0.0, -0.4, 0.0)))):
    random = np.random.default_rng(seed)
    rotations = Rotation.random(frames * 9, rng=random).as_matrix().reshape(frames, 9, 3, 3)
    for joint in still:
        rotations[:, joint] = rotations[0, joint]
    skeleton = Skeleton(random.normal(scale=0.3, size=(9, 3)).astype(np.float32), NAMES, PARENTS, ends)
    return Motion(rotations.astype(np.float32), random.normal(size=(frames, 3)).astype(np.float32), skeleton, 30.0)


def world(motion):
    """Orientations of all joints in the world, by a plain loop."""
    result = []
    for joint, parent in enumerate(motion.skeleton.parents):
        local = np.asarray(motion.rotations[:, joint], np.float64)
        result.append(local if parent < 0 else result[parent] @ local)
    return np.stack(result, axis=1)


@pytest.mark.parametrize("joints", [[0, 2, 4], [0, 5, 6], [0, 8, 4], [0, 1, 2, 3, 4, 5, 6, 7, 8], [0]])
def test_world_orientations_stay(joints):
    motion = make()
    selected = select_joints(motion, joints)
    assert selected.skeleton.names == tuple(NAMES[joint] for joint in joints)
    np.testing.assert_allclose(world(selected), world(motion)[:, joints], atol=2e-6)
    np.testing.assert_array_equal(selected.root, motion.root)
    assert selected.fps == motion.fps


def test_all_joints_is_the_same_motion():
    motion = make()
    selected = select_joints(motion, range(9))
    np.testing.assert_array_equal(selected.rotations, motion.rotations)
    np.testing.assert_array_equal(selected.skeleton.offsets, motion.skeleton.offsets)
    assert selected.skeleton.same_tree(motion.skeleton)


def test_positions_stay_where_no_dropped_joint_moves():
    # Dropped between kept ones: spine, neck and arm, all held still.
    joints = [0, 2, 4, 6, 8]
    motion = make(still=(1, 3, 5))
    selected = select_joints(motion, joints)
    assert selected.skeleton.parents == (-1, 0, 1, 1, 0)
    np.testing.assert_allclose(selected.positions(), motion.positions()[:, joints], atol=2e-6)


def test_positions_stay_where_two_dropped_joints_in_a_row_are_still():
    joints = [0, 3, 6]
    motion = make(still=(1, 2, 5))
    selected = select_joints(motion, joints)
    np.testing.assert_allclose(selected.positions(), motion.positions()[:, joints], atol=2e-6)


def test_a_dropped_joint_that_moves_keeps_its_mean_direction():
    motion = make(frames=2)
    swing = Rotation.from_rotvec([[0.3, 0, 0], [-0.3, 0, 0]]).as_matrix()
    motion.rotations[:, 3] = swing
    selected = select_joints(motion, [0, 1, 2, 4])
    offsets = motion.skeleton.offsets
    np.testing.assert_allclose(selected.skeleton.offsets[3], offsets[3] + offsets[4], atol=1e-6)


def test_ends_are_the_farthest_dropped_points():
    motion = make()
    offsets = np.asarray(motion.skeleton.offsets)
    ends = dict(select_joints(motion, [0, 1, 2, 3, 5, 6, 8]).skeleton.ends)
    assert set(ends) == {3, 5, 6}  # neck, hand and leg, in the new numbering
    head = max(offsets[4], offsets[4] + [0, 0.2, 0], key=np.linalg.norm)
    np.testing.assert_allclose(ends[3], head, atol=1e-6)
    np.testing.assert_allclose(ends[5], offsets[7], atol=1e-6)
    np.testing.assert_allclose(ends[6], [0, -0.4, 0], atol=1e-6)


def test_a_root_that_was_a_joint():
    motion = make(still=(3,))
    joints = [2, 4, 5]
    selected = select_joints(motion, joints)
    assert selected.skeleton.parents == (-1, 0, 0)
    np.testing.assert_allclose(world(selected), world(motion)[:, joints], atol=2e-6)
    np.testing.assert_allclose(selected.positions(), motion.positions()[:, joints], atol=2e-6)
    assert {joint for joint, _ in selected.skeleton.ends} == {1, 2}


@pytest.mark.parametrize("joints", [[], [0, 1, 1], [2, 0], [2, 8], [0, 2, 1], [1, 4, 3]])
def test_wrong_choices_are_refused(joints):
    with pytest.raises(ValueError, match=r"root first"):
        select_joints(make(), joints)


def test_jax_arrays_are_welcome():
    motion = jax.tree.map(jax.numpy.asarray, make())
    np.testing.assert_allclose(select_joints(motion, [0, 2, 4]).rotations, select_joints(make(), [0, 2, 4]).rotations)


@pytest.mark.parametrize("name", ["zeggs/067_Speech_2_x_1_0.bvh", "beat/2_scott_0_1_1.bvh"])
def test_real_rigs(shared, name):
    motion = read_bvh(shared / name).clip(0, 300)
    joints = list(find_body(motion.skeleton))
    selected = select_joints(motion, joints)
    np.testing.assert_allclose(world(selected), world(motion)[:, joints], atol=1e-5)
    distance = np.linalg.norm(selected.positions() - motion.positions()[:, joints], axis=-1)
    assert distance.max() < 0.02
    # Fingers and the top of the head are drawn although nothing moves them.
    assert {joint for joint, _ in selected.skeleton.ends} >= {15, 20, 21}
