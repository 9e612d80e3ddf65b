"""Relaxed hands: the same on every rig, whatever its hands are at rest."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent))
from rigs_for_tests import Poses, Spec, places

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget import find_rig, match_rigs, retarget, with_relaxed_hands
from a2g_jax.geometry.retarget.relaxed import relaxed_rotations
from a2g_jax.io.bvh import read_bvh
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON, TALKER_SKELETON
from experiments.characters.rigs import EXPORTERS

WITH_FINGERS = [make for make in EXPORTERS if make.__name__ not in ("xsens", "cmu")]


def hand(rig, local, side):
    """Directions of the bones of each finger in the frame of the hand."""
    motion = Motion(local[None].astype(np.float32), np.zeros((1, 3), np.float32), rig.skeleton, 30.0)
    where = places(motion)[0]
    world = local.copy()
    for joint, parent in enumerate(rig.skeleton.parents):
        if parent >= 0:
            world[joint] = world[parent] @ local[joint]
    wrist = rig.roles[f"{side}_Wrist"]
    frame = world[wrist] @ rig.align[wrist]
    found = {}
    for finger in ("Index", "Middle", "Ring", "Pinky", "Thumb"):
        joints = [rig.roles[f"{side}_{finger}{number}"] for number in (1, 2, 3)]
        bones = np.diff(where[joints], axis=0) @ frame
        found[finger] = bones / np.linalg.norm(bones, axis=1)[:, None]
    return found


@pytest.mark.parametrize("make", WITH_FINGERS, ids=lambda make: make.__name__)
def test_fingers_bend_to_the_palm_alike_on_every_rig(make, tmp_path):
    rig = find_rig(read_bvh(make().write(tmp_path / "a.bvh")))
    relaxed = relaxed_rotations(rig)
    assert relaxed is not None
    for side, out in (("L", 1.0), ("R", -1.0)):
        bones = hand(rig, relaxed, side)
        for finger, (first, second) in {"Index": (16, 38), "Middle": (21, 47), "Pinky": (26, 55)}.items():
            down = np.degrees(np.arcsin(-bones[finger][:, 1]))
            np.testing.assert_allclose(down, (first, second), atol=0.1)
            assert np.all(bones[finger][:, 0] * out > 0.4)
        # The thumb lies beside the index finger, below it.
        assert np.all(bones["Thumb"][:, 2] > 0.3)
        assert np.all(bones["Thumb"][:, 1] < -0.2)


def test_both_hands_mirror_each_other():
    rig = find_rig(TALKER_HANDS_SKELETON)
    relaxed = relaxed_rotations(rig)
    left, right = hand(rig, relaxed, "L"), hand(rig, relaxed, "R")
    for finger in left:
        np.testing.assert_allclose(left[finger] * (-1, 1, 1), right[finger], atol=1e-3)


def test_only_fingers_turn_and_bones_keep_their_roll():
    rig = find_rig(TALKER_HANDS_SKELETON)
    relaxed = relaxed_rotations(rig)
    fingers = {joint for role, joint in rig.roles.items() if role[-1].isdigit()}
    for joint in range(rig.skeleton.joints):
        if joint not in fingers:
            np.testing.assert_allclose(relaxed[joint], rig.rest[joint], atol=1e-12)
    # Index and middle finger bend about the axis across the palm, z of the hand here.
    for name in ("L_Middle2", "L_Middle3"):
        turn = relaxed[rig.roles[name]]
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        assert abs(axis[2]) / np.linalg.norm(axis) > 0.99


def test_fingers_that_the_source_moves_are_left_alone():
    source, _ = Spec(fingers=True).build(Poses.random(4, 1))
    target, _ = Spec("unreal", fingers=True, lowered=45.0).build(Poses.random(2, 2))
    match = match_rigs(find_rig(source), find_rig(target))
    assert with_relaxed_hands(match) is match
    plain, relaxed = retarget(source, match), retarget(source, with_relaxed_hands(match))
    np.testing.assert_array_equal(plain.rotations, relaxed.rotations)


def test_a_source_without_fingers_gets_relaxed_ones_and_none_on_request():
    source = Motion(
        np.tile(np.eye(3, dtype=np.float32), (3, 22, 1, 1)), np.zeros((3, 3), np.float32), TALKER_SKELETON, 30.0
    )
    target, joints = Spec("unreal", fingers=True, lowered=45.0).build(Poses.random(2, 2))
    match = match_rigs(find_rig(source), find_rig(target))
    plain, relaxed = retarget(source, match), retarget(source, with_relaxed_hands(match))
    finger, elbow = joints["L_Index2"], joints["L_Elbow"]
    assert np.abs(plain.rotations[:, finger] - relaxed.rotations[:, finger]).max() > 0.2
    np.testing.assert_array_equal(plain.rotations[:, elbow], relaxed.rotations[:, elbow])
    np.testing.assert_array_equal(plain.root, relaxed.root)


def test_a_rig_without_fingers_has_none_to_curl():
    assert relaxed_rotations(find_rig(TALKER_SKELETON)) is None
