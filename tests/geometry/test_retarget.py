"""Retargeting between rigs of any names, axes, reference poses and helper joints."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs_for_tests import (
    DIALECTS,
    PARTS,
    Poses,
    Spec,
    angle,
    carrier,
    file_name,
    layouts,
    places,
    specs,
    through_file,
    world,
)
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.retarget import body_skeleton, find_rig, match_rigs, retarget, upper_body_skeleton
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh import read_bvh
from a2g_jax.talker.skeleton import TALKER_SKELETON

POSES = Poses.random(4, 3)


@settings(max_examples=12, deadline=None)  # two rigs each
@given(specs(), specs(), st.integers(0, 5))
def test_there_and_back(first, second, seed):
    """Joints are found, the other rig shows the true pose, and the way back returns every matched joint."""
    go_there_and_back(first, second, seed)


@pytest.mark.slow
@settings(max_examples=400, deadline=None)
@given(specs(), specs(), st.integers(0, 1000))
def test_there_and_back_on_hundreds_of_rigs(first, second, seed):
    go_there_and_back(first, second, seed)


@settings(max_examples=7, deadline=None)
@given(specs(), specs(), layouts(), layouts(), st.integers(0, 5))
def test_there_and_back_through_files(first, second, layout, other, seed):
    """The same, each motion written as BVH of any rotation order and unit and read again on its way."""
    go_through_files(first, second, layout, other, seed)


@pytest.mark.slow
@settings(max_examples=400, deadline=None)
@given(specs(), specs(), layouts(), layouts(), st.integers(0, 1000))
def test_there_and_back_through_files_of_hundreds_of_rigs(first, second, layout, other, seed):
    go_through_files(first, second, layout, other, seed)


def go_through_files(first, second, layout, other, seed):
    poses = Poses.random(3, seed)
    first, second = (dataclasses.replace(spec, tips=True) for spec in (first, second))
    built, joints = first.build(poses)
    shown, theirs = second.build(poses)
    motion, truth = through_file(built, layout), through_file(shown, other)
    source, target = find_rig(motion), find_rig(truth)
    there = through_file(retarget(motion, target, source=source), other)
    back = through_file(retarget(there, source, source=target), layout)
    # A file lists joints depth-first and knows no spaces in names.
    order = [motion.skeleton.index(file_name(built, joint)) for joint in range(built.skeleton.joints)]
    matched = [carrier(first, joints, part) for part in PARTS]
    worst = angle(world(motion)[:, [order[j] for j in matched]], world(back)[:, [order[j] for j in matched]])
    assert worst < 0.1
    np.testing.assert_allclose(world(motion)[:, order], world(built), atol=1e-5)
    target_order = [truth.skeleton.index(file_name(shown, joint)) for joint in range(shown.skeleton.joints)]
    for part in PARTS:
        joint = carrier(second, theirs, part)
        assert angle(world(there)[1:, target_order[joint]], world(shown)[1:, joint]) < 0.1, part
    tall = max(source.height, target.height)
    np.testing.assert_allclose(back.root, motion.root, atol=2e-3 * tall)


def go_there_and_back(first, second, seed):
    poses = Poses.random(3, seed)
    motion, joints = first.build(poses)
    truth, theirs = second.build(poses)
    source, target = find_rig(motion), find_rig(truth)
    named = [part for part in joints if first.dialect != "nameless" or part in PARTS]
    assert {part: source.roles[part] for part in named} == {part: joints[part] for part in named}
    match = match_rigs(source, target)
    there = retarget(motion, match)
    back = retarget(there, source, source=target)
    matched = [pair.source for pair in match.pairs]
    assert {carrier(first, joints, part) for part in PARTS} <= set(matched)
    assert angle(world(motion)[:, matched], world(back)[:, matched]) < 0.1
    np.testing.assert_allclose(back.root, motion.root, atol=2e-4 * first.scale)
    # Frame 0 shows each rig's own reference pose; all others show the same person.
    after, true = world(there)[1:], world(truth)[1:]
    for part in PARTS:
        joint = carrier(second, theirs, part)
        assert angle(after[:, joint], true[:, joint]) < 0.1, part


@pytest.mark.parametrize("dialect", sorted(DIALECTS))
def test_fingers_and_hips(dialect):
    """Fingers are found and moved as well; hips go where the legs' lengths put them."""
    motion, _ = Spec(dialect="beat", fingers=True).build(POSES)
    other = Spec(dialect=dialect, fingers=True, frames="random", lowered=45.0, up="Z", proportions=5)
    truth, theirs = other.build(POSES)
    there = retarget(motion, find_rig(truth))
    fingers = [joint for part, joint in theirs.items() if part[-1].isdigit()]
    assert len(fingers) == 30
    if dialect != "nameless":
        assert angle(world(there)[1:, fingers], world(truth)[1:, fingers]) < 0.1
    hips = [theirs["L_Hip"], theirs["R_Hip"]]
    moved, true = (places(m)[1:, hips].mean(axis=1) for m in (there, truth))
    np.testing.assert_allclose(moved, true, atol=0.02)  # the generator scales the pelvis' place, not the hips'


def test_twist_of_a_straight_arm_survives():
    """A roll about the bone moves no joint, but is retargeted as well."""
    still = Poses.random(2, 0)
    parts = {part: np.tile(np.eye(3), (2, 1, 1)) for part in still.parts}
    c, s = np.cos(0.9), np.sin(0.9)
    parts["L_Shoulder"] = parts["L_Elbow"] = parts["L_Wrist"] = np.tile([[1, 0, 0], [0, c, -s], [0, s, c]], (2, 1, 1))
    poses = Poses(parts, still.hips)
    motion, _ = Spec(frames="permuted", lowered=45.0, twists="chain").build(poses)
    truth, joints = Spec(dialect="unreal", up="Z").build(poses)
    there = retarget(motion, find_rig(truth))
    for part in ("L_Shoulder", "L_Elbow", "L_Wrist"):
        assert angle(world(there)[1:, joints[part]], world(truth)[1:, joints[part]]) < 0.1
    assert angle(world(there)[1:, joints["L_Wrist"]], np.eye(3)) > 50


def test_a_bent_elbow_shows_the_twist_of_its_arm():
    """Where the zero pose is meaningless and no T-pose was captured, the elbow's hinge gives the upper arm's roll."""
    talk, still = Poses.random(3, 2), Poses.random(2, 0)
    parts = {part: np.concatenate([np.eye(3)[None], turns]) for part, turns in talk.parts.items()}
    for side, sign in (("L", 1.0), ("R", -1.0)):
        hanging = Rotation.from_euler("ZX", [-60 * sign, 35], degrees=True)
        bent = hanging * Rotation.from_euler("y", -40 * sign, degrees=True)
        for part, turn in (("Shoulder", hanging), ("Elbow", bent), ("Wrist", bent)):
            parts[f"{side}_{part}"][0] = turn.as_matrix()
    poses = Poses(parts, np.tile(still.hips[:1], (4, 1)))
    motion, _ = Spec(frames="random").build(poses)
    truth, joints = Spec(up="Z").build(poses)
    motion, truth = motion.clip(1, 5), truth.clip(1, 5)
    there = retarget(motion, find_rig(truth), source=find_rig(motion, rest=0))
    for part in ("L_Shoulder", "R_Shoulder", "L_Elbow", "R_Elbow"):
        assert angle(world(there)[:, joints[part]], world(truth)[:, joints[part]]) < 0.1, part


def test_soles_stay_on_the_ground():
    """A person who stands still on a source stands on the same ground on any target."""
    parts = {part: np.tile(np.eye(3), (2, 1, 1)) for part in POSES.parts}
    motion, joints = Spec(lowered=0.0).build(Poses(parts, np.tile([0.0, 0.92, 0.0], (2, 1))))
    ground = places(motion)[:, joints["L_Foot"], 1].min()
    motion = dataclasses.replace(motion, root=np.asarray(motion.root) - np.float32([0, ground, 0]))
    there = retarget(motion, TALKER_SKELETON)
    toes = places(there)[:, [TALKER_SKELETON.index("L_Foot"), TALKER_SKELETON.index("R_Foot")], 1]
    tip = dict(TALKER_SKELETON.ends)[TALKER_SKELETON.index("L_Foot")][1]
    np.testing.assert_allclose(toes + tip, 0.0, atol=1e-4)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, 1.0), (1 / 2.54, 2.54), (10.0, 0.1), (1 / 0.3048, 0.3048)])
@pytest.mark.parametrize("up", ["Y", "Z", "-Y", "X"])
def test_unit_and_vertical_axis(scale, unit, up):
    motion, _ = Spec(scale=scale, up=up).build(POSES)
    for source in (motion, motion.skeleton):
        rig = find_rig(source)
        assert rig.unit_factor == unit
        assert rig.up == (up if up.startswith("-") else f"+{up}")
    assert find_rig(motion, up="-X").up == "-X"


def test_a_drawing_that_lies_down_and_a_motion_that_stands():
    """Some exporters draw Z-up and stand the body up by its root."""
    motion, _ = Spec(up="Z").build(POSES)
    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]], np.float32)
    rotations = np.asarray(motion.rotations).copy()
    rotations[:, 0] = turn @ rotations[:, 0]
    stood = dataclasses.replace(motion, rotations=rotations, root=np.asarray(motion.root) @ turn.T)
    rig = find_rig(stood)
    assert rig.up == "+Y"
    upright, _ = Spec().build(POSES)
    first, second = (retarget(m, TALKER_SKELETON) for m in (stood, upright))
    assert angle(world(first)[1:], world(second)[1:]) < 0.1


def test_table_says_what_was_matched():
    motion, _ = Spec(dialect="unreal", spines=5, twists="chain", fingers=True).build(POSES)
    table = match_rigs(find_rig(motion), find_rig(TALKER_SKELETON)).table()
    lines = {line.split()[1]: line for line in table.splitlines() if len(line.split()) > 2}
    assert lines["L_Shoulder"].split()[0] == "upperarm_l+upperarm_l_twist_01"
    assert lines["Spine2"].split()[0].endswith("spine_02")
    assert "name" in lines["L_Wrist"]
    assert "up is +Y" in table


def test_more_spines_take_shares():
    motion, _ = Spec(spines=2).build(POSES)
    longer, _ = Spec(spines=6).build(POSES)
    match = match_rigs(find_rig(motion), find_rig(longer))
    assert len(match.shares) == 4
    there = retarget(motion, match)
    steps = [angle(world(there)[2:3, a], world(there)[2:3, a + 1]) for a in range(2, 6)]
    np.testing.assert_allclose(steps[1:-1], steps[1], rtol=0.05)
    assert max(steps) < 15


def test_own_proportions():
    """The 22 and the 47 joints with a rig's own bones: joints lie where they lie on the rig."""
    motion, joints = Spec(dialect="hands", fingers=True, frames="random", lowered=30.0, spines=3, proportions=9).build(
        POSES
    )
    rig = find_rig(motion)
    body = retarget(motion, body_skeleton(rig), source=rig)
    ours = dict(zip(body.skeleton.names, range(22), strict=True))
    offset = None
    for part in PARTS:
        if part == "Chest":
            continue
        gap = places(body)[1:, ours[part]] - places(motion)[1:, joints[part]]
        offset = gap if offset is None else offset
        np.testing.assert_allclose(gap - offset, 0, atol=0.015 if part in ("Neck", "Head") else 0.012)
    upper = upper_body_skeleton(rig)
    assert upper.joints == 47
    moved = retarget(motion, upper, source=rig)
    tip = places(moved)[:, upper.index("LeftHandIndex3")] - places(moved)[:, upper.index("RightHand")]
    true = places(motion)[:, joints["L_Index3"]] - places(motion)[:, joints["R_Wrist"]]
    np.testing.assert_allclose(tip[1:], true[1:], atol=0.002)


def test_what_is_missing_is_named():
    motion, joints = Spec(dialect="beat").build(POSES)
    names = tuple(name.replace("LeftArm", "Thing") for name in motion.skeleton.names)
    chain = Skeleton(np.ones((3, 3), np.float32), ("a", "b", "c"), (-1, 0, 1))
    with pytest.raises(InputError, match="walk.bvh: no human body: no L_Shoulder"):
        find_rig(chain, name="walk.bvh")
    # One name missing: the part is found by the shape of the tree.
    renamed = dataclasses.replace(motion.skeleton, names=names)
    assert find_rig(dataclasses.replace(motion, skeleton=renamed)).roles["L_Shoulder"] == joints["L_Shoulder"]
    assert find_rig(renamed, joints={"L_Shoulder": "Thing"}).by_shape is False
    with pytest.raises(InputError, match="no joint 'Thong'"):
        find_rig(renamed, joints={"L_Shoulder": "Thong"})
    with pytest.raises(InputError, match="lacks joints of BEAT's 47: .*R_Index1"):
        upper_body_skeleton(find_rig(motion))
    odd, _ = Spec(frames="random").build(POSES)
    with pytest.raises(InputError, match="no standing person"):
        find_rig(odd.skeleton)
    with pytest.raises(InputError, match="vertical axis"):
        find_rig(motion, up="W")


@pytest.mark.parametrize("name", ["beat/2_scott_0_1_1.bvh", "zeggs/067_Speech_2_x_1_0.bvh"])
def test_real_rigs_there_and_back(shared, name):
    motion = read_bvh(shared / name)
    rig = find_rig(motion)
    body = find_body_joints(motion.skeleton)
    assert set(body) <= set(rig.roles.values()) | set(rig.spine)
    others = {
        "talker": TALKER_SKELETON,
        "own": body_skeleton(rig),
        "47": upper_body_skeleton(rig),
        "beat": read_bvh(shared / "beat/2_scott_0_1_1.bvh").skeleton,
        "zeggs": read_bvh(shared / "zeggs/067_Speech_2_x_1_0.bvh").skeleton,
    }
    for key, skeleton in others.items():
        target = find_rig(skeleton)
        match = match_rigs(rig, target)
        there = retarget(motion, match)
        back = retarget(there, rig, source=target)
        matched = [pair.source for pair in match.pairs]
        assert len(matched) >= {"talker": 22, "own": 22, "47": 41}.get(key, 65)
        assert angle(world(motion)[:, matched], world(back)[:, matched]) < 0.05
        wrists = [rig.roles["L_Wrist"], rig.roles["R_Wrist"]]
        assert angle(world(motion)[:, wrists], world(there)[:, [target.roles["L_Wrist"], target.roles["R_Wrist"]]]) < 8


def test_an_invented_end_of_a_hand_points_anywhere():
    """A hand without fingers takes its line from its end site, unless that cannot be of a hand."""
    motion, joints = Spec(frames="permuted").build(POSES)
    truth, theirs = Spec(dialect="unreal").build(POSES)
    rig = find_rig(motion)
    wrist = joints["L_Wrist"]
    for turn, follows in ((20.0, True), (90.0, False)):
        bent = Rotation.from_euler("y", turn, degrees=True).as_matrix() @ np.array([0.1, 0.0, 0.0])
        x, y, z = (rig.align[wrist] @ bent).tolist()
        skeleton = dataclasses.replace(motion.skeleton, ends=(*motion.skeleton.ends, (wrist, (x, y, z))))
        there = retarget(dataclasses.replace(motion, skeleton=skeleton), truth.skeleton)
        off = angle(world(there)[1:, theirs["L_Wrist"]], world(truth)[1:, theirs["L_Wrist"]])
        assert off == pytest.approx(turn if follows else 0.0, abs=0.1)


def test_a_rig_without_legs_is_measured_by_its_arms():
    """Height from the lowest joint to the highest would call half a body a child's, in another unit."""
    from a2g_jax.talker.recordings import talk
    from a2g_jax.talker.views.upper_body import upper_body

    rig = find_rig(upper_body(talk(3.0, 0, fingers=True).motion))
    assert rig.unit_factor == 1.0
    assert 1.5 < rig.height < 2.0
