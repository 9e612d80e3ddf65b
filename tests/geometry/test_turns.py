"""Turns that no body can make are bridged; all else stays."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.geometry.turns import FASTEST, bridge_turns, bridged
from a2g_jax.talker.recordings import talk

MOTION = talk(20.0, 3).motion
NAMES = MOTION.skeleton.names
WRIST = NAMES.index("R_Wrist")


def flipped(first, stop, degrees, motion=MOTION):
    """The motion with a wrist that is turned about its bone in some frames."""
    rotations = np.array(motion.rotations)
    turn = Rotation.from_rotvec([np.radians(degrees), 0.0, 0.0]).as_matrix()
    rotations[first:stop, WRIST] = rotations[first:stop, WRIST] @ turn
    return replace(motion, rotations=rotations.astype(np.float32))


def fastest(motion):
    """Degrees a second of each joint."""
    steps = rotation_angle(np.asarray(motion.rotations)[1:], np.asarray(motion.rotations)[:-1])
    return steps.max(axis=0) * motion.fps


def test_a_motion_without_fast_turns_is_returned_itself():
    found, changed = bridge_turns(MOTION)
    assert found is MOTION
    assert changed == {}


@pytest.mark.parametrize(("first", "stop"), [(200, 201), (200, 206), (0, 2), (597, 600), (200, 260), (1, 599)])
@pytest.mark.parametrize("degrees", [100.0, 176.0, -170.0])
def test_flips_are_bridged(first, stop, degrees):
    bad = flipped(first, stop, degrees)
    assert fastest(bad)[WRIST] > FASTEST
    found, changed = bridge_turns(bad)
    assert list(changed) == ["R_Wrist"]
    assert fastest(found).max() <= FASTEST
    others = [joint for joint in range(len(NAMES)) if joint != WRIST]
    np.testing.assert_array_equal(found.rotations[:, others], bad.rotations[:, others])
    # Nothing further than the reach of a bridge from where it is flipped.
    near = np.zeros(MOTION.frames, bool)
    near[max(0, first - 20) : stop + 20] = True
    np.testing.assert_array_equal(found.rotations[~near], bad.rotations[~near])


def test_a_short_flip_leaves_no_trace_of_the_other_side():
    bad = flipped(200, 204, 178.0)
    found, _ = bridge_turns(bad)
    apart = rotation_angle(found.rotations[:, WRIST], np.asarray(MOTION.rotations)[:, WRIST])
    assert apart.max() < 25.0


@settings(max_examples=30)
@given(st.integers(2, 60), st.integers(0, 2**31), st.floats(200.0, 3000.0))
def test_any_rotations_stay_rotations_and_fixed_frames_stay(frames, seed, limit):
    random = np.random.default_rng(seed)
    rotations = Rotation.random(frames, random_state=seed % 2**32).as_matrix()
    fixed = random.uniform(size=frames) < 0.2
    found = bridged(rotations, np.eye(3), limit, 150.0, 30.0, fixed)
    np.testing.assert_allclose(found @ np.swapaxes(found, 1, 2), np.broadcast_to(np.eye(3), found.shape), atol=1e-9)
    np.testing.assert_array_equal(found[fixed], rotations[fixed])
    assert rotation_angle(found[1:], found[:-1]).max() <= rotation_angle(rotations[1:], rotations[:-1]).max() + 1e-6
