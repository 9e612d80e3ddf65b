"""Jitter, feet that shake or slide, and calibration poses are found with their numbers, and nothing in sound motion."""

from dataclasses import replace

import numpy as np
import pytest
from recordings_for_tests import clean, codes, write_pair
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.geometry.retarget.calibration import calibration_frames
from a2g_jax.inspection.describe import body_places
from a2g_jax.inspection.inspect import inspect
from a2g_jax.inspection.shaking import check_jitter, check_shaking
from a2g_jax.inspection.sync import check_lengths
from a2g_jax.io.bvh import write_bvh


def faults(motion):
    rig = find_rig(motion)
    return check_shaking(motion, rig, body_places(motion, rig))


def noisy(motion, degrees, names=None):
    """White noise on joints; ``degrees`` is the standard deviation about each axis."""
    joints = list(range(motion.skeleton.joints)) if names is None else [motion.skeleton.index(name) for name in names]
    rotations = np.asarray(motion.rotations).copy()
    rng = np.random.default_rng(0)
    noise = Rotation.from_rotvec(np.radians(degrees) * rng.normal(size=(motion.frames * len(joints), 3))).as_matrix()
    rotations[:, joints] = rotations[:, joints] @ noise.reshape(motion.frames, -1, 3, 3)
    return replace(motion, rotations=rotations.astype(np.float32))


@pytest.mark.parametrize("fps", [15.0, 24.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("number", [1, 5])
def test_sound_motion_at_any_rate(number, fps):
    motion = resample(clean(number).motion, fps)
    assert faults(motion) == []
    assert calibration_frames(motion) == 0


@pytest.mark.parametrize("degrees", [0.5, 1.5])
@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_noise_on_all_joints(degrees, fps, tmp_path):
    motion = noisy(resample(clean(1).motion, fps), degrees)
    (found,) = faults(motion)
    assert found.code == "jitter"
    assert found.value == pytest.approx(degrees, rel=0.25)
    write_bvh(tmp_path / "a.bvh", motion)
    assert codes(inspect(tmp_path / "a.bvh").findings) == {"jitter"}


def test_noise_on_one_joint_and_on_the_root():
    motion = clean(1).motion
    (found,) = faults(noisy(motion, 1.5, ["L_Wrist"]))
    assert (found.code, found.place.joint) == ("jitter", "L_Wrist")
    root = np.asarray(motion.root) + 0.006 * np.random.default_rng(1).normal(size=motion.root.shape)
    (found,) = faults(replace(motion, root=root.astype(np.float32)))
    assert found.code == "jitter"
    assert found.value == pytest.approx(0.6, rel=0.25)
    assert check_jitter(motion.clip(0, 10)) == []


@pytest.mark.parametrize(("metres", "hertz"), [(0.02, 8.0), (0.01, 5.0), (0.006, 10.0)])
def test_planted_feet_that_shake(metres, hertz):
    motion = clean(2).motion
    time = np.arange(motion.frames) / motion.fps
    root = np.asarray(motion.root) + metres * np.sin(2 * np.pi * hertz * time)[:, None] * np.array([0.6, 0, 0.8])
    (found,) = faults(replace(motion, root=root.astype(np.float32)))
    assert found.code == "foot-shake"
    assert found.value == pytest.approx(100 * metres, rel=0.2)
    assert f"about {hertz:.0f} Hz" in found.message


@pytest.mark.parametrize("speed", [0.06, 0.3])
def test_planted_feet_that_slide(speed):
    motion = clean(2).motion
    time = np.arange(motion.frames) / motion.fps
    root = np.asarray(motion.root) + speed * time[:, None] * np.array([1, 0, 0])
    (found,) = faults(replace(motion, root=root.astype(np.float32)))
    assert found.code == "foot-slide"
    assert found.value == pytest.approx(speed * motion.seconds, rel=0.1)
    sway = np.asarray(motion.root) + 0.02 * np.sin(2 * np.pi * 0.25 * time)[:, None] * np.array([1, 0, 0])
    assert faults(replace(motion, root=sway.astype(np.float32))) == []


def spread(motion, lowered):
    """A pose with the arms lowered from a T-pose."""
    pose = np.tile(np.eye(3, dtype=np.float32), (motion.skeleton.joints, 1, 1))
    for side, sign in (("L", -1), ("R", 1)):
        turn = Rotation.from_euler("z", sign * lowered, degrees=True).as_matrix()
        pose[motion.skeleton.index(f"{side}_Shoulder")] = turn
    return pose


def before(motion, poses):
    rotations = np.concatenate([poses.astype(np.float32), np.asarray(motion.rotations)])
    root = np.concatenate([np.tile(np.asarray(motion.root)[:1], (len(poses), 1)), np.asarray(motion.root)])
    return replace(motion, rotations=rotations, root=root)


@pytest.mark.parametrize("lowered", [0.0, 45.0, 80.0])
@pytest.mark.parametrize("frames", [1, 12])
def test_a_calibration_pose_before_a_cut(lowered, frames, tmp_path):
    motion = before(clean(3).motion, np.tile(spread(clean(3).motion, lowered)[None], (frames, 1, 1, 1)))
    assert calibration_frames(motion) == frames
    write_bvh(tmp_path / "a.bvh", motion)
    report = inspect(tmp_path / "a.bvh")
    assert codes(report.findings) == {"calibration"}, report.text()
    assert "frame 0" in report.text()


@pytest.mark.parametrize("lowered", [0.0, 40.0])
def test_arms_that_are_lowered_from_a_calibration_pose(lowered):
    motion = clean(3).motion
    start, end = Rotation.from_matrix(spread(motion, lowered)), Rotation.from_matrix(np.asarray(motion.rotations[0]))
    turn, eased = (start.inv() * end).as_rotvec(), 0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, 32))
    poses = np.stack([(start * Rotation.from_rotvec(turn * share)).as_matrix() for share in eased])
    found = calibration_frames(before(motion, np.concatenate([np.tile(poses[:1], (15, 1, 1, 1)), poses])))
    assert 25 < found < 50


def test_faults_after_a_calibration_pose_keep_their_frames(tmp_path):
    motion = clean(3).motion
    rotations = np.asarray(motion.rotations).copy()
    wrist = motion.skeleton.index("R_Wrist")
    rotations[300, wrist] = rotations[300, wrist] @ np.diag([1.0, -1.0, -1.0]).astype(np.float32)
    motion = before(replace(motion, rotations=rotations), np.tile(spread(motion, 0.0)[None], (5, 1, 1, 1)))
    write_bvh(tmp_path / "a.bvh", motion)
    found = {finding.code: finding.place.frame for finding in inspect(tmp_path / "a.bvh").findings}
    assert found["flip"] in (304, 305)
    assert found["calibration"] == 0


def test_a_rate_of_its_own(tmp_path):
    """29.476 fps under a header of 24 over four seconds: 30 would leave 0.07 s."""
    (found,) = check_lengths(118, 24.0, 4.0)
    assert found.code == "frame-time"
    assert found.value == pytest.approx(29.476, rel=0.005)
    assert f"Frame Time: {1 / found.value:.8f}" in found.fix
    (found,) = check_lengths(1800, 24.0, 60.8)  # recorders that stopped at different times
    assert found.value == 30.0
    bvh, wav = write_pair(tmp_path, clean(0))
    assert inspect(bvh, wav).warnings == 0


@pytest.mark.parametrize("take", ["beat/2_scott_0_1_1.bvh", "zeggs/067_Speech_2_x_1_0.bvh", "beat2/2_scott_0_1_1.npz"])
def test_real_takes(take, shared):
    found = codes(inspect(shared / take).findings)
    assert found <= {"flip"}  # the wrists of the ZeroEGGS take do
