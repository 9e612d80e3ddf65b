"""Forward kinematics against a plain loop over 4x4 matrices."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.kinematics import forward_kinematics, global_rotations, joint_positions
from a2g_jax.geometry.rotation import matrix_from_axis_angle
from a2g_jax.geometry.skeleton import BODY_PARENTS

body_positions = jax.jit(lambda rotations, offsets: joint_positions(rotations, offsets, BODY_PARENTS))


def random_frames(joints, frames=1, seed=0):
    random = np.random.default_rng(seed)
    rotations = Rotation.random(frames * joints, rng=random).as_matrix().reshape(frames, joints, 3, 3)
    return rotations.astype(np.float32), random.normal(scale=0.3, size=(joints, 3)).astype(np.float32)


def reference(rotations, offsets, parents):
    """World transforms (J, 4, 4) of one frame, joint by joint, in float64."""
    world = []
    for joint, parent in enumerate(parents):
        local = np.eye(4)
        local[:3, :3] = rotations[joint]
        if parent >= 0:
            local[:3, 3] = offsets[joint]
        world.append(local if parent < 0 else world[parent] @ local)
    return np.stack(world)


@st.composite
def trees(draw):
    count = draw(st.integers(1, 9))
    return (-1, *(draw(st.integers(0, joint - 1)) for joint in range(1, count)))


@settings(max_examples=12, deadline=None)
@given(trees(), st.integers(0, 1000))
def test_random_trees(parents, seed):
    rotations, offsets = random_frames(len(parents), seed=seed)
    expected = reference(rotations[0], offsets, parents)
    both = jax.jit(lambda r, o: (global_rotations(r, parents), forward_kinematics(r, o, parents)))
    worlds, places = both(rotations[0], offsets)
    np.testing.assert_allclose(worlds, expected[:, :3, :3], atol=5e-6)
    np.testing.assert_allclose(places, expected[:, :3, 3], atol=5e-6)


@pytest.mark.smoke
def test_the_body():
    rotations, offsets = random_frames(22, frames=6)
    expected = np.stack([reference(frame, offsets, BODY_PARENTS)[:, :3, 3] for frame in rotations])
    np.testing.assert_allclose(body_positions(rotations, offsets), expected, atol=5e-6)


def test_a_chain_bent_by_hand():
    """Two unit bones along X; the first joint turned 90 degrees about Z, the second as well."""
    turn = np.asarray(matrix_from_axis_angle(jnp.array([0.0, 0.0, np.pi / 2])))
    rotations = np.stack([turn, turn, np.eye(3, dtype=np.float32)])
    offsets = np.array([[9, 9, 9], [1, 0, 0], [1, 0, 0]], np.float32)
    places = forward_kinematics(jnp.asarray(rotations), jnp.asarray(offsets), (-1, 0, 1))
    np.testing.assert_allclose(places, [[0, 0, 0], [0, 1, 0], [-1, 1, 0]], atol=1e-6)


def test_leading_axes_are_a_loop():
    rotations, offsets = random_frames(22, frames=6)
    one = jax.jit(lambda frame: forward_kinematics(frame, offsets, BODY_PARENTS))
    looped = np.stack([one(frame) for frame in rotations])
    np.testing.assert_allclose(body_positions(rotations, offsets), looped, atol=1e-6)
    shaped = body_positions(rotations.reshape(2, 3, 22, 3, 3), offsets)
    np.testing.assert_allclose(shaped, looped.reshape(2, 3, 22, 3), atol=1e-6)


def test_gradients(x64):
    parents = (-1, 0, 1, 1, 0)
    rotations, offsets = (array.astype(np.float64) for array in random_frames(5, seed=2))
    check_grads(
        jax.jit(lambda r, o: forward_kinematics(r, o, parents)), (rotations[0], offsets), order=1, modes=["rev", "fwd"]
    )
