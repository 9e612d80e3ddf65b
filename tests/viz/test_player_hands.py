import numpy as np
import pytest

from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON, TALKER_SKELETON
from a2g_jax.talker.views.upper_body import upper_body_skeleton
from a2g_jax.viz.player.hands import find_fingers
from a2g_jax.viz.player.roles import find_roles, rest_positions
from a2g_jax.viz.player.shape import build_shape

BEAT = upper_body_skeleton(TALKER_HANDS_SKELETON)


@pytest.mark.parametrize(
    ("skeleton", "wrist"), [(TALKER_HANDS_SKELETON, "L_Wrist"), (BEAT, "LeftHand"), (BEAT, "RightHand")]
)
def test_five_fingers_of_three_bones_with_one_thumb_and_one_little_finger(skeleton, wrist):
    fingers = find_fingers(skeleton, skeleton.index(wrist), rest_positions(skeleton))
    assert [len(finger.joints) for finger in fingers] == [3] * 5
    names = {skeleton.names[finger.joints[0]]: finger for finger in fingers}
    assert [name for name, finger in names.items() if finger.thumb] == [n for n in names if "T1" in n or "Thumb1" in n]
    assert [name for name, finger in names.items() if finger.small] == [n for n in names if "P1" in n or "Pinky1" in n]


def test_a_wrist_without_fingers_has_none():
    assert find_fingers(TALKER_SKELETON, TALKER_SKELETON.index("L_Wrist"), rest_positions(TALKER_SKELETON)) == []


def finger_cones(skeleton: Skeleton) -> list:
    """Thin cones of skin: bones of fingers."""
    shape = build_shape(skeleton)
    return [cone for cone in shape.cones if cone.tint == "skin" and cone.flat == 1.0 and cone.end_radius < 0.0115]


@pytest.mark.parametrize("skeleton", [TALKER_SKELETON, TALKER_HANDS_SKELETON, BEAT])
def test_every_body_is_drawn_with_thirty_finger_bones(skeleton):
    assert len(finger_cones(skeleton)) >= 30


def test_drawn_fingers_move_with_their_joints():
    shape = build_shape(TALKER_HANDS_SKELETON)
    used = {int(anchor[0]) for cone in shape.cones for anchor in (cone.start, cone.end) if len(anchor) == 1}
    joints = {index for index, name in enumerate(TALKER_HANDS_SKELETON.names) if name[-1] in "123" and name[1] == "_"}
    assert {j for j in joints if "Spine" not in TALKER_HANDS_SKELETON.names[j]} <= used


def test_an_upper_body_has_a_head_and_an_upright_chest():
    roles = find_roles(BEAT)
    assert BEAT.names[roles.head] == "Neck1"
    assert BEAT.names[roles.neck] == "Neck"
    assert any(cone.tint == "eye" for cone in build_shape(BEAT).cones)


def test_the_thumb_is_found_without_its_name():
    names = tuple(name.replace("Thumb", "Digit") for name in TALKER_HANDS_SKELETON.names)
    plain = Skeleton(np.asarray(TALKER_HANDS_SKELETON.offsets), names, TALKER_HANDS_SKELETON.parents)
    fingers = find_fingers(plain, plain.index("R_Wrist"), rest_positions(plain))
    assert [plain.names[finger.joints[0]] for finger in fingers if finger.thumb] == ["R_Digit1"]
