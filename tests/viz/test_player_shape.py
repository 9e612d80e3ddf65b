from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.geometry.retarget.upright import upright_motion
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.character import read_character
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.viz.player.roles import find_roles
from a2g_jax.viz.player.shape import build_shape
from a2g_jax.viz.player.stage import placement, shape_points
from experiments.characters.rigs import unreal
from tests.viz.figures_for_tests import body_skeleton, waving

MIXAMO = {
    "Hip": "UpLeg", "Knee": "Leg", "Ankle": "Foot", "Foot": "ToeBase",
    "Collar": "Shoulder", "Shoulder": "Arm", "Elbow": "ForeArm", "Wrist": "Hand",
}  # fmt: skip


def test_roles_of_the_body_joints():
    skeleton = body_skeleton()
    roles = find_roles(skeleton)
    names = skeleton.names
    assert [names[j] for j in (roles.pelvis, roles.chest, roles.neck, roles.head)] == [
        "Pelvis",
        "Spine3",
        "Neck",
        "Head",
    ]
    arm, leg = roles.arms["right"], roles.legs["left"]
    assert [names[j] for j in (arm.top, arm.middle, arm.tip)] == ["R_Shoulder", "R_Elbow", "R_Wrist"]
    assert [names[j] for j in (leg.top, leg.middle, leg.tip)] == ["L_Hip", "L_Knee", "L_Ankle"]


@pytest.mark.parametrize(
    "rename",
    [
        lambda name: name,
        lambda name: (
            {"L": "mixamorig:Left", "R": "mixamorig:Right"}[name[0]] + MIXAMO[name[2:]] if name[1] == "_" else name
        ),
        lambda name: f"joint{BODY_JOINTS.index(name)}",
    ],
)
def test_the_limbs_are_those_that_retargeting_moves(rename):
    """Whatever the joints are called, or if their names say nothing."""
    skeleton = replace(body_skeleton(), names=tuple(rename(name) for name in BODY_JOINTS))
    found, joints = find_roles(skeleton), find_rig(skeleton).roles
    for letter, side in (("L", "left"), ("R", "right")):
        arm, leg = found.arms[side], found.legs[side]
        assert [arm.top, arm.middle, arm.tip] == [joints[f"{letter}_{part}"] for part in ("Shoulder", "Elbow", "Wrist")]
        assert [leg.top, leg.middle, leg.tip] == [joints[f"{letter}_{part}"] for part in ("Hip", "Knee", "Ankle")]
    assert found.arms["left"].tip == BODY_JOINTS.index("L_Wrist")
    assert any(cone.tint == "eye" for cone in build_shape(skeleton).cones) == (found.head is not None)


def test_extra_points_are_rigid_to_their_joints():
    motion = waving(20)
    shape = build_shape(motion.skeleton)
    points = shape_points(motion, shape)
    np.testing.assert_allclose(points[:, :22], motion.positions(), atol=1e-6)
    for index, (joint, offset) in enumerate(shape.points[22:], start=22):
        apart = np.linalg.norm(points[:, index] - points[:, joint], axis=1)
        np.testing.assert_allclose(apart, np.linalg.norm(offset), atol=1e-5)


def test_faces_are_nearly_level_at_rest():
    """Backs lean at rest, and joints of heads are behind their tops."""
    ends = ((15, (0.0, 0.18, 0.02)),)
    for skeleton in (TALKER_SKELETON, replace(TALKER_SKELETON, ends=ends), body_skeleton()):
        rotations = np.tile(np.eye(3, dtype=np.float32), (1, skeleton.joints, 1, 1))
        motion = Motion(rotations, np.zeros((1, 3), np.float32), skeleton, 30.0)
        shape = build_shape(skeleton)
        origin, up, left, right = shape.frames[shape.cones[[s.tint for s in shape.cones].index("eye")].start[0]]
        points = shape_points(motion, shape)[0]
        front = np.cross(points[left] - points[right], points[up] - points[origin])
        assert 0 < np.degrees(np.arcsin(front[1] / np.linalg.norm(front))) < 6


def test_eyes_look_where_the_head_turns():
    motion = waving(60)
    shape = build_shape(motion.skeleton)
    points = shape_points(motion, shape)
    origin, up, left, right = shape.frames[shape.cones[[s.tint for s in shape.cones].index("eye")].start[0]]
    y, x = points[:, up] - points[:, origin], points[:, left] - points[:, right]
    front = np.cross(x, y)
    turn = 0.4 * np.sin(2 * np.pi * np.arange(60) / 30)
    np.testing.assert_allclose(np.arctan2(front[:, 0], front[:, 2]), turn, atol=1e-4)


def test_parts_are_of_human_size_and_refer_to_what_exists():
    shape = build_shape(body_skeleton())
    for cone in shape.cones:
        assert 0.003 < min(cone.start_radius, cone.end_radius) <= max(cone.start_radius, cone.end_radius) < 0.17
        assert cone.frame < len(shape.frames)
        for anchor in (cone.start, cone.end):
            assert int(anchor[0]) < (len(shape.frames) if len(anchor) == 4 else len(shape.points))
    assert sum(cone.shades for cone in shape.cones) <= 14


def test_body_scales_with_the_skeleton():
    small, large = build_shape(body_skeleton()), build_shape(body_skeleton().scaled(2.0))
    for one, two in zip(small.cones, large.cones, strict=True):
        assert two.start_radius == pytest.approx(2 * one.start_radius, rel=1e-5)


def test_a_tree_without_names_is_drawn_bone_by_bone():
    offsets = np.float32([[0, 0, 0], [0, 0.5, 0], [0, 0.5, 0], [0.3, 0, 0]])
    shape = build_shape(Skeleton(offsets, ("a", "b", "c", "d"), (-1, 0, 1, 1), ends=((3, (0.2, 0.0, 0.0)),)))
    assert len(shape.cones) == 4
    assert len(shape.points) == 5


def test_a_figure_that_faces_away_is_turned_to_the_front():
    motion = waving(10)
    shape = build_shape(motion.skeleton)
    half_turn = np.diag([-1.0, 1.0, -1.0]).astype(np.float32)
    rotations = np.array(motion.rotations)
    rotations[:, 0] = half_turn @ rotations[:, 0]
    turned = Motion(rotations, motion.root, motion.skeleton, motion.fps)
    assert placement(motion, shape_points(motion, shape))["heading"] == 0.0
    assert abs(placement(turned, shape_points(turned, shape))["heading"]) == pytest.approx(np.pi, abs=1e-3)


@pytest.mark.parametrize("path", ["zeggs/067_Speech_2_x_1_0.bvh", "beat/2_scott_0_1_1.bvh"])
def test_real_rigs_with_fingers(shared, path):
    from a2g_jax.io.bvh import read_bvh

    motion = read_bvh(shared / path).clip(0, 40)
    shape = build_shape(motion.skeleton)
    assert find_roles(motion.skeleton) is not None
    # All ten fingers, thin; nothing like a balloon.
    fingers = [cone for cone in shape.cones if cone.start_radius < 0.013]
    assert len(fingers) >= 28
    assert max(max(cone.start_radius, cone.end_radius) for cone in shape.cones) < 0.17
    place = placement(motion, shape_points(motion, shape))
    assert 1.4 < place["height"] < 2.4
    assert abs(place["heading"]) < 0.61 or place["heading"] != 0.0


def test_a_root_on_the_floor_and_targets_of_hands_are_not_drawn(tmp_path):
    path = unreal().write(tmp_path / "rig.bvh")
    character = read_character(path)
    still = read_bvh(path)
    skeleton = upright_motion(still, character.rig).skeleton
    shape = build_shape(skeleton)
    root = skeleton.index("root")
    anchors = [anchor for cone in shape.cones for anchor in (cone.start, cone.end) if len(anchor) < 4]
    drawn = {shape.points[int(anchor[0])][0] for anchor in anchors}
    assert skeleton.index("lowerarm_l") in drawn
    assert not drawn & {root, *(joint for joint, name in enumerate(skeleton.names) if name.startswith("ik_"))}
