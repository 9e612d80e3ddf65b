"""Units by the limbs of a person; what is no human body; heads and necks of helper-bone rigs."""

import numpy as np
import pytest
from rigs_for_tests import Poses, Spec
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.anthropometry import find_unit, stature
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget import body_skeleton, find_rig, match_rigs, retarget
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.bvh import read_bvh, read_with_layout, write_bvh

UNITS = {"metres": 1.0, "centimetres": 100.0, "millimetres": 1000.0, "inches": 39.3701, "1/0.45 inch": 45 / 2.54,
         "feet": 3.28084, "decimetres": 10.0}  # fmt: skip


@pytest.mark.parametrize("unit", UNITS)
def test_units(unit, tmp_path):
    motion, _ = Spec(tips=True).build(Poses.random(3, 1))
    path = tmp_path / "a.bvh"
    write_bvh(path, motion, scale=UNITS[unit])
    shown, layout = read_with_layout(path)
    assert layout.unit.name.startswith(unit)
    assert layout.scale == pytest.approx(1 / UNITS[unit], rel=1e-4)
    assert shown.skeleton.offsets[1:].sum() == pytest.approx(np.asarray(motion.skeleton.offsets[1:]).sum(), rel=1e-3)
    rig = find_rig(shown)
    assert rig.unit_factor == 1.0
    found = [finding for finding in inspect(path).findings if finding.code == "unit"]
    assert len(found) == (unit not in ("metres", "centimetres"))
    assert all("m tall" in finding.message for finding in found)


def test_units_that_are_not_certain():
    assert find_unit(170.0, 0.01).metres == 0.01
    assert find_unit(110.0, 0.01).plain  # a child
    neither = find_unit(22.5, 0.01)  # 1.27 m in CMU's unit, 2.25 m in decimetres
    assert not neither.usual
    assert neither.metres == 0.01
    assert "no usual unit fits a person" in str(neither)
    motion, _ = Spec().build(Poses.random(2, 0))
    assert stature(motion.skeleton, find_rig(motion).roles) == pytest.approx(1.6, abs=0.1)
    assert stature(motion.skeleton, {}) is None


def tree(rows):
    names = [row[0] for row in rows]
    parents = tuple(names.index(row[1]) if row[1] else -1 for row in rows)
    return Skeleton(np.array([row[2] for row in rows], np.float32), tuple(names), parents)


def moving(skeleton, frames=40):
    rng = np.random.default_rng(0)
    turns = np.cumsum(rng.normal(size=(frames, skeleton.joints, 3)) * 0.01, axis=0)
    matrices = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(frames, -1, 3, 3)
    return Motion(matrices.astype(np.float32), np.zeros((frames, 3), np.float32), skeleton, 30.0)


def four_legs(name, tail):
    rows = [("Pelvis", "", (0, 0.6, 0)), ("Spine", "Pelvis", (0, 0.02, 0.2)), ("Spine1", "Spine", (0, 0.02, 0.25)),
            ("Neck", "Spine1", (0, 0.15, 0.15)), ("Head", "Neck", (0, 0.1, 0.15))]  # fmt: skip
    for side, x in (("L", 0.1), ("R", -0.1)):
        above = "Spine1"
        for part, offset in (("Clavicle", (x / 2, -0.05, 0.05)), ("UpperArm", (x / 2, -0.1, 0.03)),
                             ("Forearm", (0, -0.2, -0.05)), ("Hand", (0, -0.2, 0.02)),
                             ("Finger0", (0, -0.05, 0.05))):  # fmt: skip
            rows.append((f"{side} {part}", above, offset))
            above = f"{side} {part}"
        above = "Pelvis"
        for part, offset in (("Thigh", (x, -0.03, -0.05)), ("Calf", (0, -0.22, 0.08)), ("HorseLink", (0, -0.15, -0.1)),
                             ("Foot", (0, -0.12, 0)), ("Toe0", (0, -0.03, 0.08))):  # fmt: skip
            rows.append((f"{side} {part}", above, offset))
            above = f"{side} {part}"
    for number in range(3 if tail else 0):
        rows.append((f"Tail{number}", f"Tail{number - 1}" if number else "Pelvis", (0, -0.03, -0.1)))
    return tree([(name(a), name(b) if b else "", offset) for a, b, offset in rows])


def hand(side, wrist, parent, sign):
    rows = [(wrist, parent, (0.1 * sign, 0, 0))]
    for number, finger in enumerate(("Thumb", "Index", "Middle", "Ring", "Pinky")):
        above = wrist
        for bone in (1, 2, 3):
            first = bone == 1
            rows.append((f"{side}Hand{finger}{bone}", above,
                         (sign * (0.08 if first else 0.03), 0, 0.02 * (2 - number) * first)))  # fmt: skip
            above = rows[-1][0]
    return rows


def face():
    rows = [("head", "", (0, 1.6, 0)), ("jaw", "head", (0, -0.05, 0.05)), ("tongue", "jaw", (0, 0, 0.02))]
    for side, x in (("l", 0.03), ("r", -0.03)):
        rows += [(f"{part}_{side}", "head", (x, 0.03, 0.08)) for part in ("eye", "cheek", "brow")]
        rows += [(f"brow2_{side}", f"brow_{side}", (0, 0.01, 0)), (f"brow3_{side}", f"brow2_{side}", (0, 0.01, 0))]
    return rows


def table():
    rows = [("top", "", (0, 0.7, 0))]
    for leg, (x, z) in enumerate(((0.5, 0.5), (-0.5, 0.5), (0.5, -0.5), (-0.5, -0.5))):
        for part, above, offset in (("a", "top", (x, 0, z)), ("b", "a", (0, -0.35, 0)), ("c", "b", (0, -0.35, 0))):
            rows.append((f"leg{leg}{part}", above if above == "top" else f"leg{leg}{above}", offset))
    return rows


NO_BODIES = {
    "a horse of Biped": four_legs(lambda name: f"Bip01 {name}", True),
    "a horse without a tail": four_legs(lambda name: f"Bip01 {name}", False),
    "a horse without names": four_legs(lambda name: f"joint{abs(hash(name)) % 10**9}", True),
    "a hand": tree(hand("Left", "LeftHand", "", 1)),
    "two hands": tree([("root", "", (0, 0, 0)), *hand("Left", "LeftHand", "root", 1),
                       *hand("Right", "RightHand", "root", -1)]),
    "a face": tree(face()),
    "a sword of Biped": tree([("Bip01", "", (0, 1, 0)), ("Bip01 Prop1", "Bip01", (0, 0, 0)),
                              ("Bip01 Prop2", "Bip01 Prop1", (0, 0.9, 0))]),
    "a table": tree(table()),
}  # fmt: skip


@pytest.mark.parametrize("what", NO_BODIES)
def test_no_human_body(what, tmp_path):
    with pytest.raises(InputError, match="thing: no human body"):
        find_rig(moving(NO_BODIES[what]), name="thing")
    write_bvh(tmp_path / "a.bvh", moving(NO_BODIES[what]))
    (found,) = [finding for finding in inspect(tmp_path / "a.bvh").findings if finding.code == "no-body"]
    assert found.message.startswith("no human body")


def test_people_in_odd_poses_are_bodies():
    """Seated, bent forward, with a ponytail."""
    poses = Poses.random(6, 2)
    motion, joints = Spec(dialect="biped").build(poses)
    rotations = np.array(motion.rotations)
    seat = Rotation.from_euler("x", -90, degrees=True).as_matrix()
    for side in "LR":
        rotations[:, joints[f"{side}_Hip"]] = seat
        rotations[:, joints[f"{side}_Knee"]] = seat.T
    seated = Motion(rotations.astype(np.float32), motion.root, motion.skeleton, 30.0)
    assert find_rig(seated).roles["L_Elbow"] == joints["L_Elbow"]


def rigify(stretch=""):
    """Rigify's deform bones: the neck and the head are spines by name."""
    motion, joints = Spec(dialect="blender", necks=2, spines=3).build(Poses.random(4, 4))
    names = list(motion.skeleton.names)
    spines = [joint for joint, name in enumerate(names) if name.startswith(("spine", "neck"))] + [joints["Head"]]
    for number, joint in enumerate(spines, start=1):
        names[joint] = f"DEF-spine.{number:03d}"
    names[joints["Pelvis"]] = "DEF-spine"
    names = [name if name.startswith("DEF") else f"DEF-{name}" for name in names]
    skeleton = Skeleton(motion.skeleton.offsets, tuple(names), motion.skeleton.parents)
    return Motion(motion.rotations, motion.root, skeleton, 30.0), joints


def test_neck_and_head_of_rigify():
    motion, joints = rigify()
    rig = find_rig(motion)
    assert rig.roles["Head"] == joints["Head"]
    assert rig.roles["Neck"] == motion.skeleton.parents[motion.skeleton.parents[joints["Head"]]]
    assert not rig.by_shape
    plain, _ = Spec().build(Poses.random(4, 4))
    match = match_rigs(find_rig(plain), rig)
    assert match.warnings() == []
    assert joints["Head"] in {pair.target for pair in match.pairs}


@pytest.mark.parametrize(("mark", "middle"), [("{}.x", ("neck", "head", "root")), ("{}_M", ("Neck", "Head", "Root"))])
def test_marks_of_the_middle(mark, middle):
    motion, joints = Spec(dialect="blender").build(Poses.random(3, 1))
    names = list(motion.skeleton.names)
    for part, name in zip(("Neck", "Head", "Pelvis"), middle, strict=True):
        where = joints["Head"] if part == "Head" else joints.get(part, motion.skeleton.parents[joints["Head"]])
        names[where] = mark.format(name)
    rig = find_rig(Skeleton(motion.skeleton.offsets, tuple(names), motion.skeleton.parents))
    assert rig.roles["Head"] == joints["Head"]


def test_a_head_that_is_not_found_is_warned_of():
    motion, joints = Spec().build(Poses.random(3, 1))
    names = list(motion.skeleton.names)
    for joint in (joints["Head"], motion.skeleton.parents[joints["Head"]]):
        names[joint] = f"thing{joint}"
    headless = Skeleton(motion.skeleton.offsets, tuple(names), motion.skeleton.parents)
    plain = find_rig(motion)
    (text,) = match_rigs(plain, find_rig(headless)).warnings()
    assert "no neck and no head" in text
    assert match_rigs(plain, plain).warnings() == []


def test_hands_share_a_row():
    motion, _ = Spec(fingers=True).build(Poses.random(3, 1))
    rig = find_rig(motion)
    rows = [line for line in match_rigs(rig, rig).table().splitlines() if "fingers" in line]
    assert len(rows) == 2
    assert "15 joints below LeftHand" in rows[0]
    assert "name (15)" in rows[0]
    assert "LeftHandIndex1" not in match_rigs(rig, rig).table()


@pytest.mark.parametrize("tips", [True, False])
def test_to_the_body_and_back_returns_the_root(tips, tmp_path):
    """Also for rigs whose feet have no end sites, as EBMDB and Talking With Hands: they sank by 2 cm."""
    motion, _ = Spec(dialect="hands", tips=tips, lowered=45.0, proportions=3).build(Poses.random(5, 1))
    source = find_rig(motion)
    write_bvh(tmp_path / "body.bvh", retarget(motion, body_skeleton(source), source=source))
    back = retarget(read_bvh(tmp_path / "body.bvh"), source)
    np.testing.assert_allclose(back.root, motion.root, atol=2e-6)
