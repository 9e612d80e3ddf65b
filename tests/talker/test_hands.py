"""Finger motion of the generated corpus: the skeleton, hand shapes, and that the other joints do not change."""

import numpy as np
import pytest

from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.talker.gestures import gesticulate
from a2g_jax.talker.joint_limits import joint_angles, limit_excess
from a2g_jax.talker.plan import plan_speech
from a2g_jax.talker.recordings import resample_motion, talk
from a2g_jax.talker.skeleton import FINGERS, TALKER_HANDS_SKELETON, TALKER_SKELETON
from a2g_jax.talker.styles import SPEAKER_STYLES

SPEAKERS = tuple(SPEAKER_STYLES)


def draw(seed=0, seconds=12.0, speaker="ada", emotion="neutral", fps=30.0, fingers=True):
    plan = plan_speech(seconds, speaker, emotion, np.random.default_rng(seed))
    return gesticulate(plan, np.random.default_rng(seed + 1), fps, fingers)


def bends(seeds, family, speaker="ada"):
    """Mean flexion of knuckles and middle joints (index, middle, ring, little) at the strokes of a family, degrees."""
    rows = []
    for seed in seeds:
        motion, truth = draw(seed, 20.0, speaker)
        angles = joint_angles(motion)
        for unit in truth.units:
            for order, index in enumerate(unit.strokes):
                stroke = truth.strokes[index]
                if stroke.family != family or stroke.apex > 19.5:
                    continue
                letter = "L" if stroke.hand == "left" else "R"
                frame = round((stroke.apex + 0.1) * 30)
                fingers = ("Index", "Middle", "Ring", "Pinky")
                rows.append(
                    [order]
                    + [angles[f"{letter}_{finger}1", "flexion"][frame] for finger in fingers]
                    + [angles[f"{letter}_{finger}2", "flexion"][frame] for finger in fingers]
                )
    return np.array(rows)


def test_skeleton_has_the_smplx_order_and_adult_hands():
    skeleton = TALKER_HANDS_SKELETON
    assert skeleton.names[:22] == BODY_JOINTS
    assert skeleton.joints == 52
    assert skeleton.names[22:25] == ("L_Index1", "L_Index2", "L_Index3")
    assert [name[2:-1] for name in skeleton.names[22:37:3]] == ["Index", "Middle", "Pinky", "Ring", "Thumb"]
    assert [name.replace("R_", "L_", 1) for name in skeleton.names[37:]] == list(skeleton.names[22:37])
    np.testing.assert_array_equal(skeleton.offsets[:22], TALKER_SKELETON.offsets)
    np.testing.assert_array_equal(skeleton.offsets[37:] * [-1, 1, 1], skeleton.offsets[22:37])
    ends = dict(skeleton.ends)
    reach = np.zeros(3)
    joint = skeleton.index("L_Middle3")
    tip = np.array(ends[joint])
    while joint != skeleton.index("L_Wrist"):
        reach, joint = reach + skeleton.offsets[joint], skeleton.parents[joint]
    assert np.linalg.norm(reach + tip) == pytest.approx(0.185, abs=0.003)
    # Palms down: thumbs in front of the hand, little fingers behind.
    assert skeleton.offsets[skeleton.index("L_Thumb1")][2] > 0 > skeleton.offsets[skeleton.index("L_Pinky1")][2]
    for finger in FINGERS:
        assert skeleton.index(f"R_{finger}3") in ends


@pytest.mark.parametrize("speaker", SPEAKERS)
def test_body_is_the_same_with_and_without_fingers(speaker):
    plain, truth = draw(3, speaker=speaker, emotion="anger", fingers=False)
    hands, same = draw(3, speaker=speaker, emotion="anger")
    assert plain.skeleton is TALKER_SKELETON
    assert hands.skeleton is TALKER_HANDS_SKELETON
    np.testing.assert_array_equal(plain.rotations, hands.rotations[:, :22])
    np.testing.assert_array_equal(plain.root, hands.root)
    assert truth == same


def test_fingers_are_paths_in_time():
    slow, _ = draw(2, fps=30.0)
    fast, _ = draw(2, fps=120.0)
    np.testing.assert_allclose(fast.rotations[::4][: slow.frames], slow.rotations, atol=2e-6)
    again, _ = draw(2, fps=30.0)
    np.testing.assert_array_equal(slow.rotations, again.rotations)


def test_fingers_move_and_stay_within_their_ranges():
    for seed, speaker in enumerate(SPEAKERS):
        motion, _ = draw(seed, speaker=speaker)
        rotations = np.asarray(motion.rotations, np.float64)[:, 22:]
        np.testing.assert_allclose(
            rotations @ np.swapaxes(rotations, -1, -2), np.broadcast_to(np.eye(3), rotations.shape), atol=2e-6
        )
        assert limit_excess(motion)[:, 22:].max() == 0.0
        change = np.swapaxes(rotations[:-1], -1, -2) @ rotations[1:]
        angle = np.rad2deg(np.arccos(np.clip((np.trace(change, axis1=-2, axis2=-1) - 1) / 2, -1, 1))) * 30.0
        assert np.all(angle.max(axis=0) > 5.0)
        assert angle.max() < 900.0


def test_end_joints_follow_middle_joints():
    motion, _ = draw(1)
    angles = joint_angles(motion)
    for finger in ("Index", "Middle", "Ring", "Pinky"):
        middle, end = angles[f"R_{finger}2", "flexion"], angles[f"R_{finger}3", "flexion"]
        np.testing.assert_allclose(end, 2.0 / 3.0 * middle, atol=0.01)


def test_pointing_hands_stretch_the_index_only():
    rows = bends(range(5), "point", "david")
    assert len(rows) > 5
    knuckles, middles = rows[:, 1:5].mean(axis=0), rows[:, 5:].mean(axis=0)
    assert knuckles[0] < 22.0
    assert middles[0] < 25.0
    assert np.all(middles[1:] > 55.0)


def test_lists_count_up():
    rows = bends(range(5), "list", "david")
    assert len(rows) > 5
    first, third = rows[rows[:, 0] == 0], rows[rows[:, 0] == 2]
    assert np.all(first[:, 6:9].mean(axis=0) > 45.0)
    # Index, middle and ring are up at the third, the little finger is not.
    assert np.all(third[:, 5:8].mean(axis=0) < 40.0)
    assert third[:, 8].mean() > 45.0


def test_offers_are_more_open_than_beats():
    assert bends(range(4), "offer")[:, 1:].mean() < bends(range(4), "beat")[:, 1:].mean() - 5.0


def test_a_recording_keeps_its_fingers_when_resampled():
    plain = talk(4.0, 5)
    hands = talk(4.0, 5, fingers=True)
    np.testing.assert_array_equal(plain.motion.rotations, hands.motion.rotations[:, :22])
    np.testing.assert_array_equal(plain.audio, hands.audio)
    first, truth = resample_motion(plain, 1)
    second, same = resample_motion(hands, 1)
    assert first.skeleton.joints == 22
    assert second.skeleton.joints == 52
    assert truth == same
    np.testing.assert_array_equal(first.rotations, second.rotations[:, :22])
