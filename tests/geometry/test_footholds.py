"""Standing feet stay, steps stay steps, and the rest of the body is untouched."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.footholds import _goal, lock_feet
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import world_rotations
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.talker.recordings import talk

LEGS = [BODY_JOINTS.index(f"{side}_{part}") for side in "LR" for part in ("Hip", "Knee", "Ankle")]
FEET = [BODY_JOINTS.index(f"{side}_{part}") for side in "LR" for part in ("Ankle", "Foot")]


@pytest.fixture(scope="module")
def still():
    """Eight seconds of a standing talker."""
    return talk(8.0, 3, fps=30.0).motion


def shaken(motion, degrees, seed=0):
    """The same with slowly wrong legs."""
    rng = np.random.default_rng(seed)
    noise = gaussian_filter1d(rng.normal(size=(motion.frames, len(LEGS), 3)), 6.0, axis=0)
    turns = Rotation.from_rotvec((np.radians(degrees) * noise / noise.std()).reshape(-1, 3)).as_matrix()
    rotations = motion.rotations.copy()
    rotations[:, LEGS] = rotations[:, LEGS] @ turns.reshape(motion.frames, len(LEGS), 3, 3)
    return replace(motion, rotations=rotations.astype(np.float32))


def speeds(motion):
    return np.linalg.norm(np.diff(motion.positions()[:, FEET], axis=0), axis=-1) * motion.fps


def test_orientations_of_some_joints_are_those_of_all(still):
    rotations, parents = still.rotations[:5], still.skeleton.parents
    whole, part = world_rotations(rotations, parents), world_rotations(rotations, parents, [LEGS[2]])
    above = {LEGS[2]}
    while parents[min(above)] >= 0:
        above.add(parents[min(above)])
    np.testing.assert_array_equal(part[:, sorted(above)], whole[:, sorted(above)])
    assert np.isnan(part[:, [joint for joint in range(len(parents)) if joint not in above]]).all()


def test_feet_that_slide_stand(still):
    sliding = shaken(still, 1.5)
    locked = lock_feet(sliding)
    assert speeds(sliding).mean() > 0.02
    assert speeds(locked).max() < 1e-3
    # Nothing above the hips turns; the whole body may sink where a leg is too short.
    others = [joint for joint in range(22) if joint not in LEGS]
    np.testing.assert_array_equal(locked.rotations[:, others], sliding.rotations[:, others])
    sunk = sliding.root - locked.root
    assert (sunk[:, 1] >= -1e-6).all()
    assert sunk.max() < 0.05
    np.testing.assert_array_equal(sunk[:, [0, 2]], 0.0)
    # No knee jumps.
    angle = lambda motion: Rotation.from_matrix(motion.rotations[:, LEGS[1]]).magnitude()  # noqa: E731
    assert np.abs(np.diff(angle(locked), n=2)).max() < 2.0 * np.abs(np.diff(angle(sliding), n=2)).max()


def test_feet_that_stand_stay(still):
    locked = lock_feet(still)
    np.testing.assert_allclose(locked.positions(), still.positions(), atol=1e-3)


def test_a_step_arrives(still):
    """A left foot that goes 20 cm aside within half a second."""
    body = find_body_joints(still.skeleton)
    hip = body[BODY_JOINTS.index("L_Hip")]
    share = np.clip((np.arange(still.frames) / 30.0 - 4.0) / 0.5, 0.0, 1.0)
    share = 3 * share**2 - 2 * share**3
    aside = Rotation.from_rotvec(np.radians(15.0) * share[:, None] * np.array([[0.0, 0.0, 1.0]])).as_matrix()
    rotations = still.rotations.copy()
    rotations[:, hip] = aside @ rotations[:, hip]
    stepping = replace(still, rotations=rotations.astype(np.float32))
    locked = lock_feet(stepping)
    ankle = body[BODY_JOINTS.index("L_Ankle")]
    went, gone = (motion.positions()[:, ankle] for motion in (stepping, locked))
    assert np.linalg.norm(went[-1] - went[0]) > 0.18
    # The talker itself turns about this hip before and after, less than 3 cm at the foot.
    np.testing.assert_allclose(gone[[0, -1]], went[[0, -1]], atol=0.03)
    np.testing.assert_allclose(gone[128], went[128], atol=0.02)
    moving = np.linalg.norm(np.diff(gone, axis=0), axis=-1) * 30.0
    assert moving[:100].max() < 1e-3
    assert moving[170:].max() < 1e-3
    assert moving.max() < 2.0 * np.linalg.norm(np.diff(went, axis=0), axis=-1).max() * 30.0


def test_skeletons_without_legs_are_left_as_they_are():
    skeleton = Skeleton(np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], np.float32), ("a", "b"), (-1, 0))
    motion = Motion(np.tile(np.eye(3, dtype=np.float32), (5, 2, 1, 1)), np.zeros((5, 3), np.float32), skeleton, 30.0)
    assert lock_feet(motion) is motion


@pytest.mark.parametrize("seconds", [0.15, 0.2, 0.3])
def test_a_step_passes_from_one_foothold_to_the_next_without_a_jump(seconds):
    """12 cm in a smooth step at 30 fps, between two stands that shake; slower ones count as standing."""
    time = (np.arange(180) / 30.0 - 3.0) / seconds + 0.5
    place = np.zeros((180, 3))
    place[:, 0] = 0.12 * (lambda x: x * x * (3.0 - 2.0 * x))(np.clip(time, 0.0, 1.0))
    place[:, 0] += 0.002 * np.sin(np.arange(180))
    world = np.broadcast_to(np.eye(3), (180, 3, 3))
    target, orientation = _goal(place, world, 30.0)
    largest = np.abs(np.diff(target[:, 0])).max()
    assert largest < 1.5 * np.abs(np.diff(place[:, 0])).max()
    assert np.ptp(target[:40, 0]) < 1e-9
    assert np.ptp(target[-40:, 0]) < 1e-9
    assert target[-1, 0] - target[0, 0] == pytest.approx(0.12, abs=0.002)
    np.testing.assert_allclose(orientation, world, atol=1e-9)
