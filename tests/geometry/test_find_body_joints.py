"""Finding the body joints of rigs by their names."""

import numpy as np
import pytest

from a2g_jax.geometry.body_joints import find_body_joints, find_wrists
from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton
from a2g_jax.io.bvh import read_bvh

SIDE = ("UpLeg", "Leg", "Foot", "ToeBase"), ("Shoulder", "Arm", "ForeArm", "Hand")


def rig(bones):
    """A skeleton from (name, name of the parent or None)."""
    names = [name for name, _ in bones]
    parents = tuple(-1 if parent is None else names.index(parent) for _, parent in bones)
    return Skeleton(np.zeros((len(bones), 3), np.float32), tuple(names), parents)


def humanoid(spines=4, prefix="", necks=("Neck", "Neck1"), root="Hips"):
    """The names that BEAT, ZeroEGGS and Mixamo use."""
    trunk = [root, *("Spine" + (str(n) if n else "") for n in range(spines)), *necks, "Head", "HeadEnd"]
    bones = [(trunk[0], None), *zip(trunk[1:], trunk, strict=False)]
    chest = trunk[spines]
    for side in ("Right", "Left"):
        for limb, top in ((SIDE[1], chest), (SIDE[0], root)):
            names = [side + part for part in limb]
            bones += zip(names, [top, *names], strict=False)
        bones += [(f"{side}HandIndex1", f"{side}Hand"), (f"{side}ForeArmEnd", f"{side}ForeArm")]
    return rig([(prefix + name, parent and prefix + parent) for name, parent in bones])


EXPECTED = ["Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine2", "LeftFoot", "RightFoot"]
EXPECTED += ["Spine3", "LeftToeBase", "RightToeBase", "Neck", "LeftShoulder", "RightShoulder", "Head"]
EXPECTED += ["LeftArm", "RightArm", "LeftForeArm", "RightForeArm", "LeftHand", "RightHand"]


def found_names(skeleton):
    joints = find_body_joints(skeleton)
    return None if joints is None else [skeleton.names[joint] for joint in joints]


def test_humanoid_names():
    assert found_names(humanoid()) == EXPECTED


@pytest.mark.parametrize("prefix", ["mixamorig:", "Character1|", "a:b:"])
def test_prefixes(prefix):
    names = found_names(humanoid(spines=3, necks=("Neck",), prefix=prefix))
    expected = [{"Spine2": "Spine1", "Spine3": "Spine2"}.get(name, name) for name in EXPECTED]
    assert names == [prefix + name for name in expected]


def test_case_and_separators_do_not_matter():
    plain = humanoid()
    names = tuple(name.replace("Left", "left_").lower() for name in plain.names)
    assert find_body_joints(Skeleton(plain.offsets, names, plain.parents)) == find_body_joints(plain)


@pytest.mark.parametrize(("spines", "middle"), [(3, "Spine1"), (4, "Spine2"), (5, "Spine2"), (6, "Spine3")])
def test_spines_are_counted(spines, middle):
    names = found_names(humanoid(spines=spines))
    assert [names[3], names[6], names[9]] == ["Spine", middle, f"Spine{spines - 1}"]


@pytest.mark.parametrize(
    "rename",
    [
        lambda name: name,
        lambda name: name.lower(),
        lambda name: name.replace("L_", "left_").replace("R_", "right_").lower(),  # as the smplx package has them
    ],
)
def test_smplx_names(rename):
    order = list(range(22))
    skeleton = Skeleton(np.zeros((22, 3), np.float32), tuple(map(rename, BODY_JOINTS)), BODY_PARENTS)
    assert find_body_joints(skeleton) == tuple(order)


def test_smplx_with_other_joints_in_between():
    names = ("Jaw", *BODY_JOINTS)
    skeleton = rig(
        [("World", None)]
        + [
            (name, "World" if parent < 0 else BODY_JOINTS[parent])
            for name, parent in zip(BODY_JOINTS, BODY_PARENTS, strict=True)
        ]
        + [("Jaw", "Head")]
    )
    assert len(names) + 1 == skeleton.joints
    assert find_body_joints(skeleton) == tuple(range(1, 23))


def test_unreal_names():
    bones = [("root", None), ("pelvis", "root"), ("spine_01", "pelvis"), ("spine_02", "spine_01")]
    bones += [("spine_03", "spine_02"), ("neck_01", "spine_03"), ("head", "neck_01")]
    for side in "lr":
        arm = [f"{part}_{side}" for part in ("clavicle", "upperarm", "lowerarm", "hand")]
        leg = [f"{part}_{side}" for part in ("thigh", "calf", "foot", "ball")]
        bones += [*zip(arm, ["spine_03", *arm], strict=False), *zip(leg, ["pelvis", *leg], strict=False)]
    names = found_names(rig(bones))
    assert names[0] == "pelvis"
    assert names[18:] == ["lowerarm_l", "lowerarm_r", "hand_l", "hand_r"]


@pytest.mark.parametrize("missing", ["Hips", "LeftArm", "RightHand", "Head", "Neck", "LeftToeBase", "Spine3"])
def test_a_missing_joint(missing):
    """Renamed out of recognition, it is missing; a spine's name means nothing, so that one is found all the same."""
    plain = humanoid(necks=("Neck",))
    skeleton = Skeleton(
        plain.offsets, tuple("Thing" if name == missing else name for name in plain.names), plain.parents
    )
    if missing == "Spine3":
        assert found_names(skeleton)[9] == "Thing"
    else:
        assert find_body_joints(skeleton) is None


def test_too_few_spines():
    assert find_body_joints(humanoid(spines=2)) is None


def test_a_tree_that_contradicts_its_names():
    plain = humanoid()
    parents = list(plain.parents)
    parents[plain.index("LeftHand")] = plain.index("Head")
    assert find_body_joints(Skeleton(plain.offsets, plain.names, tuple(parents))) is None


def test_no_body_at_all():
    assert find_body_joints(rig([("a", None), ("b", "a")])) is None


@pytest.mark.parametrize("name", ["zeggs/067_Speech_2_x_1_0.bvh", "beat/2_scott_0_1_1.bvh"])
def test_real_rigs(shared, name):
    motion = read_bvh(shared / name)
    joints = find_body_joints(motion.skeleton)
    assert [motion.skeleton.names[joint] for joint in joints] == EXPECTED
    # The names and the geometry agree: the left hand is on the left of an upright body at rest.
    rest = motion.positions()[:, list(joints)].mean(axis=0)
    place = dict(zip(BODY_JOINTS, rest, strict=True))
    assert place["Head"][1] > place["Spine1"][1] > place["L_Knee"][1] > place["L_Foot"][1]
    assert place["L_Shoulder"][0] > place["R_Shoulder"][0]


def test_wrists_of_upper_bodies_are_found_without_legs():
    whole = humanoid()
    body = find_body_joints(whole)
    assert find_wrists(whole) == (body[BODY_JOINTS.index("L_Wrist")], body[BODY_JOINTS.index("R_Wrist")])
    legs = {side + part for side in ("Left", "Right") for part in SIDE[0]}
    parents = {
        name: whole.names[parent] if parent >= 0 else None
        for name, parent in zip(whole.names, whole.parents, strict=True)
    }
    upper = rig([(name, parent) for name, parent in parents.items() if name not in legs])
    assert find_body_joints(upper) is None
    assert [upper.names[joint] for joint in find_wrists(upper)] == ["LeftHand", "RightHand"]
    assert find_wrists(rig([("Hips", None), ("LeftArm", "Hips"), ("LeftHand", "LeftArm")])) is None
