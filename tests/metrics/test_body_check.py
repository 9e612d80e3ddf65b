"""Checks of a body: sound motion has no findings, and planted faults are found at their frame and joint."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.metrics.body.bounds import anybody, bounds_of, extremes, extremes_from_json, extremes_to_json, widened
from a2g_jax.metrics.body.check import Stretch, check_motion, frames_outside
from a2g_jax.metrics.body.figures import Reference
from a2g_jax.talker.recordings import talk

TAKES = [talk(30.0, seed, speaker=speaker).motion for seed, speaker in ((1, "ada"), (2, "bruno"), (3, "chiara"))]
NAMES = TAKES[0].skeleton.names


def mean_pose(motions):
    mean = np.concatenate([np.asarray(motion.rotations, np.float64) for motion in motions]).mean(axis=0)
    return Rotation.from_matrix(mean).as_matrix()


REFERENCE = Reference(TAKES[0].skeleton, mean_pose(TAKES), float(np.mean(TAKES[0].root[:, 1])))
BOUNDS = bounds_of(REFERENCE, extremes(TAKES, REFERENCE))
HELD_OUT = talk(30.0, 11, speaker="ada").motion


def changed(motion, frames, joint, turn, axis="y"):
    """The motion with a joint turned by degrees about an axis of its parent in some frames."""
    rotations = np.array(motion.rotations)
    turned = Rotation.from_euler(axis, turn, degrees=True).as_matrix().astype(np.float32)
    rotations[frames, NAMES.index(joint)] = turned @ rotations[frames, NAMES.index(joint)]
    return replace(motion, rotations=rotations)


def moved(motion, frames, offset):
    """The motion with its root moved in some frames."""
    root = np.array(motion.root)
    root[frames] += np.asarray(offset, np.float32)
    return replace(motion, root=root)


def of(findings, figure, joint):
    found = [one for one in findings if (one.figure, one.joint) == (figure, joint)]
    assert found, f"no {figure} of {joint} among {[str(one) for one in findings]}"
    return found[0]


@pytest.mark.parametrize("bounds", [BOUNDS, None])
def test_sound_motion_has_no_findings(bounds):
    for motion in (*TAKES, HELD_OUT):
        assert check_motion(motion, bounds) == ()


@pytest.mark.parametrize("bounds", [BOUNDS, None])
@pytest.mark.parametrize("joint", ["L_Elbow", "R_Elbow"])
def test_a_flipped_elbow(bounds, joint):
    """150 degrees about the axis of the upper arm, in one frame."""
    findings = check_motion(changed(HELD_OUT, 200, joint, 150.0, "x"), bounds)
    found = of(findings, "turn", joint)
    assert found.first == 200
    assert found.stop == 202
    assert found.frames == 2
    assert found.value > 4000.0 > found.bound
    assert found.seconds == pytest.approx(found.frame / 30.0)
    assert joint in str(found)
    assert f"{found.value:.0f} degrees/s" in str(found)
    assert {one.joint for one in findings} <= {joint, joint.replace("Elbow", "Wrist")}


def test_an_elbow_that_bends_backwards():
    pose = Rotation.from_matrix(HELD_OUT.rotations[:, NAMES.index("L_Elbow")])
    axis = REFERENCE.axes[0]
    flexion = pose.as_rotvec() @ axis
    back = Rotation.from_rotvec(np.radians(-40.0) * np.tile(axis, (20, 1))).as_matrix()
    rotations = np.array(HELD_OUT.rotations)
    rotations[100:120, NAMES.index("L_Elbow")] = back
    found = of(check_motion(replace(HELD_OUT, rotations=rotations), BOUNDS), "backwards", "L_Elbow")
    assert flexion.min() > 0.0
    assert (found.first, found.stop) == (100, 120)
    assert found.value == pytest.approx(40.0, abs=0.1)
    assert found.bound == 15.0


@pytest.mark.parametrize("side", ["L", "R"])
def test_a_knee_that_bends_the_wrong_way(side):
    findings = check_motion(changed(HELD_OUT, slice(50, 60), f"{side}_Knee", -70.0, "x"), None)
    found = of(findings, "backwards", f"{side}_Knee")
    assert (found.first, found.stop) == (50, 60)
    assert of(
        check_motion(changed(HELD_OUT, slice(50, 60), f"{side}_Knee", 60.0, "z"), BOUNDS), "sideways", f"{side}_Knee"
    )


@pytest.mark.parametrize("bounds", [BOUNDS, None])
def test_a_teleport(bounds):
    found = of(check_motion(moved(HELD_OUT, slice(300, None), (0.5, 0.0, 0.0)), bounds), "root_speed", "Pelvis")
    assert (found.frame, found.first, found.stop) == (300, 300, 301)
    assert found.value == pytest.approx(15.0, abs=0.5)


def test_a_wrist_that_jumps():
    """A jump of the arm for one frame is jerk in that frame, and speed into and out of it."""
    findings = check_motion(changed(HELD_OUT, 400, "R_Shoulder", 80.0, "z"), BOUNDS)
    jerk, speed = of(findings, "wrist_jerk", "R_Wrist"), of(findings, "wrist_speed", "R_Wrist")
    assert jerk.first <= 400 < jerk.stop
    assert abs(jerk.frame - 400) <= 1
    assert (speed.first, speed.stop) == (400, 402)


def test_nan():
    rotations = np.array(HELD_OUT.rotations)
    rotations[17, NAMES.index("Neck"), 0, 0] = np.nan
    (found,) = check_motion(replace(HELD_OUT, rotations=rotations), BOUNDS)
    assert (found.figure, found.joint, found.frame, found.stop) == ("finite", "Neck", 17, 18)
    assert found.to_json()["value"] is None
    assert "Neck is not a number" in str(found)
    (found,) = check_motion(moved(HELD_OUT, 3, (np.inf, 0.0, 0.0)))
    assert (found.joint, found.frame) == ("Pelvis", 3)


@pytest.mark.parametrize("bounds", [BOUNDS, None])
def test_feet_that_slide(bounds):
    """1.35 m in a second and a half: no frame is fast, and both feet stand."""
    path = np.zeros((HELD_OUT.frames, 3))
    path[:, 0] = 0.03 * np.clip(np.arange(HELD_OUT.frames) - 500, 0, 45)
    found = of(check_motion(moved(HELD_OUT, slice(None), path), bounds), "slide", "L_Ankle")
    assert 500 < found.first < 516
    assert 545 <= found.stop <= 560
    assert found.value == pytest.approx(0.45, abs=0.02)


def test_feet_through_and_above_the_floor():
    sunk = of(check_motion(moved(HELD_OUT, slice(90, 95), (0.0, -0.15, 0.0)), BOUNDS), "sink", "L_Foot")
    assert (sunk.first, sunk.stop) == (90, 95)
    assert sunk.value == pytest.approx(0.15, abs=0.01)
    hops = of(check_motion(moved(HELD_OUT, slice(90, 95), (0.0, 0.2, 0.0)), BOUNDS), "lift", "Pelvis")
    assert (hops.first, hops.stop) == (90, 95)


def test_a_body_that_lies_down():
    fallen = changed(HELD_OUT, slice(100, None), "Pelvis", 85.0, "z")
    for bounds in (BOUNDS, anybody(REFERENCE)):
        assert of(check_motion(fallen, bounds), "tilt", "Pelvis").first == 100
    turned = check_motion(changed(HELD_OUT, slice(None), "Pelvis", 90.0, "y"), BOUNDS)
    assert "tilt" not in {one.figure for one in turned}


def test_a_neck_that_is_wrung():
    found = of(check_motion(changed(HELD_OUT, slice(30, 40), "Head", 100.0), BOUNDS), "range", "Head")
    assert (found.first, found.stop) == (30, 40)


def test_findings_cover_every_frame_outside():
    """Two groups of frames half a second apart are two findings, and a gap of a few frames is none."""
    frames = [60, 64, 90, 91]
    findings = [one for one in check_motion(changed(HELD_OUT, frames, "Head", 110.0), BOUNDS) if one.figure == "range"]
    assert sorted((one.first, one.stop, one.frames) for one in findings) == [(60, 65, 2), (90, 92, 2)]
    assert frames_outside(findings, HELD_OUT.frames) == 7


def test_a_stretch_has_bounds_of_its_own():
    """Frames of a clip are judged by the clip; those beside it are not."""
    fast = changed(HELD_OUT, [200, 300], "R_Elbow", 50.0, "x")
    clip = fast.clip(195, 206)
    assert {one.first for one in check_motion(fast, BOUNDS)} == {199, 200, 299, 300}
    own = BOUNDS.loosened(clip, "the clip")
    assert own.high["turn"][NAMES.index("R_Elbow")] > BOUNDS.high["turn"][NAMES.index("R_Elbow")]
    assert all(np.all(own.high[name] >= values) for name, values in BOUNDS.high.items())
    assert {one.first for one in check_motion(fast, BOUNDS, [Stretch(195, 206, own)])} == {299, 300}
    broken = changed(HELD_OUT, 200, "R_Elbow", 150.0, "x")
    assert check_motion(broken, BOUNDS, [Stretch(195, 206, BOUNDS.loosened(broken.clip(195, 206), "the clip"))])


def test_speeds_do_not_depend_on_the_frame_rate():
    slow = replace(HELD_OUT, fps=30.0)
    half = replace(slow, rotations=slow.rotations[::2], root=slow.root[::2], fps=15.0)
    assert check_motion(half, BOUNDS) == ()
    twice = replace(slow, fps=120.0)
    assert of(check_motion(twice, BOUNDS), "turn", "R_Elbow")


def test_bounds_have_their_margins_within_those_of_any_person():
    found = extremes(TAKES, REFERENCE)
    high, most = widened(found, REFERENCE), anybody(REFERENCE).high
    elbow = NAMES.index("L_Elbow")
    assert high["turn"][elbow] == pytest.approx(1.5 * found["turn"][elbow])
    assert found["turn"][elbow] == found["turn"][NAMES.index("R_Elbow")]
    assert high["turn"][NAMES.index("L_Foot")] == 180.0
    assert all(np.all(high[name] <= most[name]) for name in high)
    wild = {name: values + 1e6 for name, values in found.items()}
    for name, values in widened(wild, REFERENCE).items():
        np.testing.assert_array_equal(values, most[name])


def test_extremes_as_json():
    found = extremes(TAKES, REFERENCE)
    again = extremes_from_json(extremes_to_json(found), REFERENCE, "run.json")
    for name, values in found.items():
        np.testing.assert_allclose(again[name], values, rtol=1e-5)
    for wrong in ({}, [1], {**extremes_to_json(found), "turn": [1.0]}, {**extremes_to_json(found), "tilt": [None]}):
        with pytest.raises(InputError, match="run.json: is damaged"):
            extremes_from_json(wrong, REFERENCE, "run.json")


def test_other_bodies():
    """Skeletons without the joints of a body are checked for what they have."""
    skeleton = Skeleton(np.ones((2, 3), np.float32), ("tail", "tip"), (-1, 0))
    still = Motion(np.tile(np.eye(3, dtype=np.float32), (40, 2, 1, 1)), np.zeros((40, 3), np.float32), skeleton, 30.0)
    assert check_motion(still) == ()
    flipped = np.array(still.rotations)
    flipped[20, 1] = np.diag([1.0, -1.0, -1.0])
    (found,) = check_motion(replace(still, rotations=flipped))
    assert (found.figure, found.joint, found.first) == ("turn", "tip", 20)
    with pytest.raises(ValueError, match="22 joints; got 2"):
        check_motion(still, BOUNDS)
    assert check_motion(replace(HELD_OUT, rotations=HELD_OUT.rotations[:0], root=HELD_OUT.root[:0]), BOUNDS) == ()
    for frames in (1, 2, 3):
        assert check_motion(HELD_OUT.clip(0, frames), BOUNDS) == ()


def upper_body():
    """Talk on a skeleton without legs, with names of the 47 joints of work on BEAT."""
    names = {"Pelvis": "Hips", "Spine1": "Spine", "Spine2": "Spine2", "Neck": "Neck", "Head": "Head"}
    for side, word in (("L", "L"), ("R", "R")):
        names |= {f"{side}_Collar": f"{word}Shoulder", f"{side}_Shoulder": f"{word}Arm"}
        names |= {f"{side}_Elbow": f"{word}Arm1", f"{side}_Wrist": f"{word}Hand"}
    motion = TAKES[0]
    kept = [NAMES.index(role) for role in sorted(names, key=NAMES.index)]
    parents = []
    for joint in kept:
        above = motion.skeleton.parents[joint]
        while above not in kept and above != -1:
            above = motion.skeleton.parents[above]
        parents.append(kept.index(above) if above in kept else -1)
    skeleton = Skeleton(
        np.asarray(motion.skeleton.offsets)[kept], tuple(names[NAMES[joint]] for joint in kept), tuple(parents)
    )
    return Motion(np.asarray(motion.rotations)[:, kept], motion.root, skeleton, motion.fps)


def test_arms_of_an_upper_body():
    """Elbows and wrists are checked without legs and with two spines; figures of knees and feet are left out."""
    motion = upper_body()
    reference = Reference(motion.skeleton, mean_pose([motion]), float(motion.root[:, 1].mean()))
    assert reference.parts["bend"] == ("LArm1", "RArm1")
    assert reference.parts["wrist_jerk"] == ("LHand", "RHand")
    assert not {"sink", "lift", "slide"} & reference.parts.keys()
    found = extremes([motion], reference)
    for bounds in (bounds_of(reference, found), None):
        assert check_motion(motion, bounds) == ()
        rotations = np.array(motion.rotations)
        elbow = motion.skeleton.names.index("LArm1")
        axis = reference.axes[0]
        back = Rotation.from_rotvec(-np.radians(150.0) * axis).as_matrix()
        rotations[100:130, elbow] = back @ rotations[100:130, elbow]
        findings = check_motion(replace(motion, rotations=rotations), bounds)
        assert 100 <= of(findings, "backwards", "LArm1").first < 130
        assert of(findings, "wrist_jerk", "LHand")
    earlier = {name: values for name, values in extremes_to_json(found).items() if "bend" not in name}
    read = extremes_from_json(earlier, reference, "run.json")
    np.testing.assert_array_equal(bounds_of(reference, read).high["bend"], anybody(reference).high["bend"])
