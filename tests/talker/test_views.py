"""The talker in the layouts of BEAT, Speech2Gesture and TED, and with capture noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.data.corpus_writer import prepare_recording
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.retarget import find_rig, retarget, upper_body_rig
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.views import directions as ted
from a2g_jax.talker.views import upper_body as beat
from a2g_jax.talker.views.capture import add_jitter, joint_weights
from a2g_jax.talker.views.keypoints import KEYPOINTS, Camera, Detector, keypoints, write_s2g_windows
from a2g_jax.talker.views.landmarks import landmarks

SIDES = ("L", "R")


@pytest.fixture(scope="module")
def take():
    return talk(8.0, 2, speaker="ada", emotion="happiness", fingers=True)


@pytest.fixture(scope="module")
def bodily():
    return talk(4.0, 2, speaker="ada")


def slow_positions(motion):
    """Forward kinematics, one joint after the other, in double precision; the root at the origin."""
    skeleton = motion.skeleton
    turns, places = [np.asarray(motion.rotations[:, 0], np.float64)], [np.zeros((motion.frames, 3))]
    for joint in range(1, skeleton.joints):
        above = skeleton.parents[joint]
        places.append(places[above] + np.einsum("tij,j->ti", turns[above], skeleton.offsets[joint].astype(np.float64)))
        turns.append(turns[above] @ motion.rotations[:, joint].astype(np.float64))
    return np.stack(places, axis=1)


# --- BEAT's upper body


def test_upper_body_is_where_the_talker_is(take):
    view = beat.upper_body(take.motion)
    assert view.fps == 15.0
    assert view.frames == 120
    source = take.motion.clip(0, take.motion.frames)
    source = replace(source, rotations=source.rotations[::2], root=source.root[::2], fps=15.0)
    here, there = slow_positions(view), slow_positions(source)
    names = source.skeleton.names
    there = there - there[:, [names.index("Spine3")]]
    shared = [(joint, names.index(name)) for joint, name in enumerate(beat.SOURCES) if name]
    assert len(shared) == 47 - 6
    for joint, other in shared:
        np.testing.assert_allclose(here[:, joint], there[:, other], atol=1e-6, err_msg=names[other])
    world, before = view.world_rotations(), source.world_rotations()
    np.testing.assert_allclose(world[:, [a for a, _ in shared]], before[:, [b for _, b in shared]], atol=2e-6)
    np.testing.assert_allclose(view.root, source.positions()[:, names.index("Spine3")], atol=2e-6)


def test_a_recorded_rig_has_the_same_joints_and_rotations(take):
    """Generated talk in BEAT's format is what retargeting to the upper body makes of the talker."""
    view, rig = beat.upper_body(take.motion, 30.0), find_rig(take.motion)
    same = retarget(take.motion, upper_body_rig(rig), source=rig)
    assert view.skeleton.same_tree(same.skeleton)
    turning = [joint for joint, name in enumerate(beat.SOURCES) if name]
    np.testing.assert_allclose(slow_positions(view)[:, turning], slow_positions(same)[:, turning], atol=1e-4)
    # Hands and fingers have other rest poses there, a few degrees away.
    body = [joint for joint in turning if "Hand" not in view.skeleton.names[joint]]
    np.testing.assert_allclose(view.rotations[:, body], same.rotations[:, body], atol=1e-4)


def test_metacarpals_lie_in_the_palm_and_do_not_move(take):
    view = beat.upper_body(take.motion)
    places = slow_positions(view)
    for side in SIDES:
        word = {"L": "Left", "R": "Right"}[side]
        hand = view.skeleton.index(f"{word}Hand")
        for finger in ("Ring", "Pinky", "Index"):
            joint = view.skeleton.index(f"{word}Hand{finger}")
            assert view.skeleton.parents[joint] in (hand, view.skeleton.index(f"{word}HandRing"))
            np.testing.assert_array_equal(view.rotations[:, joint], np.broadcast_to(np.eye(3), (view.frames, 3, 3)))
            knuckle = np.linalg.norm(places[:, joint + 1] - places[:, hand], axis=1)
            assert np.all(np.linalg.norm(places[:, joint] - places[:, hand], axis=1) < 0.4 * knuckle)


def test_ends_are_finger_tips(take):
    view = beat.upper_body(take.motion)
    owners = sorted(view.skeleton.names[joint] for joint, _ in view.skeleton.ends)
    fingers = ("Middle", "Ring", "Pinky", "Index", "Thumb")
    assert owners == sorted(["Neck1", *(f"{side}Hand{finger}3" for side in ("Left", "Right") for finger in fingers)])


def test_pose_values_are_the_first_two_columns(take):
    view = beat.upper_body(take.motion)
    values = beat.pose_values(view)
    assert values.shape == (120, 282)
    elbow = view.skeleton.index("RightForeArm")
    np.testing.assert_array_equal(values[7, 6 * elbow : 6 * elbow + 3], view.rotations[7, elbow, :, 0])
    np.testing.assert_array_equal(values[7, 6 * elbow + 3 : 6 * elbow + 6], view.rotations[7, elbow, :, 1])


def test_order_is_that_of_beat(shared):
    real = read_bvh(shared / "beat" / "2_scott_0_1_1.bvh")

    names = list(real.skeleton.names)
    order = [names.index(name) for name in beat.UPPER_BODY_JOINTS]
    assert order == sorted(order)
    for joint, above in enumerate(beat.UPPER_BODY_PARENTS[1:], start=1):
        up = real.skeleton.parents[order[joint]]
        while up not in order:
            up = real.skeleton.parents[up]
        assert order.index(up) == above
    # Rest poses agree: bones of the same side point the same way, within what bodies differ by.
    ours = beat.upper_body_skeleton(talk(2.0, 0, fps=5.0, fingers=True).motion.skeleton)
    for joint, name in enumerate(ours.names):
        arm = name.endswith("Arm") and "Fore" not in name
        if joint and (arm or ("Hand" in name and name[-1] in "d23")):
            a, b = ours.offsets[joint], real.skeleton.offsets[order[joint]]
            cosine = a @ b / np.linalg.norm(a) / np.linalg.norm(b)
            assert cosine > 0.7, name


def test_upper_body_becomes_a_corpus_and_a_file(take, tmp_path):
    recording = beat.upper_body_recording(take)
    prepared = prepare_recording(recording, Features(fps=15.0, joints="all"))
    assert prepared.pose.shape == (120, 47, 6)
    np.testing.assert_array_equal(prepared.pose.reshape(120, 282), beat.pose_values(recording.motion))
    assert prepared.emotion == "happiness"
    write_bvh(tmp_path / "view.bvh", recording.motion)
    again = read_bvh(tmp_path / "view.bvh")
    assert again.skeleton.names == beat.UPPER_BODY_JOINTS
    np.testing.assert_allclose(again.positions(), recording.motion.positions(), atol=1e-4)


def test_words_and_syllables_ride_along_in_frames(take):
    recording = beat.upper_body_recording(take)
    frames = recording.annotations["frames"]
    assert frames["fps"] == 15.0
    assert [word for word, _, _ in frames["words"]] == [word.text for word in take.words]
    for (_, first, stop), word in zip(frames["words"], take.words, strict=True):
        assert abs(first / 15 - word.start) <= 1 / 30 + 1e-9
        assert abs(stop / 15 - word.end) <= 1 / 15 + 1e-9
    syllables = take.annotations["speech"]["syllables"]
    assert len(frames["syllables"]) == len(syllables)
    assert all(0 <= first < stop <= 120 for _, first, stop in frames["syllables"] + frames["words"])
    assert recording.annotations["gestures"] == take.annotations["gestures"]


def test_views_with_fingers_need_fingers(bodily):
    for view in (beat.upper_body, keypoints, lambda motion: ted.directions(motion, ted.TED_EXPRESSIVE)):
        with pytest.raises(InputError, match="make it with fingers=True"):
            view(bodily.motion)


# --- Keypoints


def test_keypoints_are_what_a_camera_sees(take):
    camera = Camera(focal=1500.0, distance=3.0, height=1.2)
    found = keypoints(take.motion, camera=camera)
    assert found.shape == (120, 49, 2)
    points = landmarks(resample(take.motion, 15.0))

    def projected(point):
        """The camera as a 3 x 4 matrix: intrinsics times pose."""
        pose = np.array([[1.0, 0, 0, 0], [0, -1.0, 0, 1.2], [0, 0, -1.0, 3.0]])
        u, v, w = np.diag([1500.0, 1500.0, 1.0]) @ pose @ np.append(point, 1.0)
        return np.array([u / w, v / w])

    for frame in (0, 33, 119):
        neck = projected((points["L_Shoulder"][frame] + points["R_Shoulder"][frame]) / 2)
        for index, name in ((1, "R_Shoulder"), (3, "R_Wrist"), (5, "L_Elbow"), (11, "L_Thumb3_End"), (47, "R_Pinky3")):
            np.testing.assert_allclose(found[frame, index], projected(points[name][frame]) - neck, atol=1e-9)


def test_keypoint_layout(take):
    found = keypoints(take.motion)
    assert not found[:, 0].any()
    np.testing.assert_array_equal(found[:, 6], found[:, 7])
    np.testing.assert_array_equal(found[:, 3], found[:, 28])
    assert KEYPOINTS[7:28] == tuple(name.replace("R_", "L_") for name in KEYPOINTS[28:])
    # The right shoulder is left in the image; elbows are below shoulders, and y points down.
    assert np.all(found[:, 1, 0] < 0)
    assert np.all(found[:, 4, 0] > 0)
    assert np.all(found[:, [2, 5], 1].mean(axis=0) > found[:, [1, 4], 1].mean(axis=0))
    # Fingers are chains of four from the knuckle to the tip.
    hands = found[:, 7:].reshape(120, 2, 21, 2)
    fingers = hands[:, :, 1:].reshape(120, 2, 5, 4, 2)
    assert np.linalg.norm(np.diff(fingers, axis=3), axis=-1).max() < 60


def test_detector_errs_as_stated():
    rng = np.random.default_rng(0)
    still = np.tile(rng.uniform(-300, 300, (1, 49, 2)), (6000, 1, 1))
    noisy, confidence = Detector(jitter=2.0, loss=0.01).detect(still, np.random.default_rng(1))
    lost = confidence == 0.0
    assert not (noisy[:, 0] - still[:, 0]).any()
    assert (noisy - still)[~lost][:, 0].std() > 2.0
    assert (noisy - still)[:, 1:7].std() == pytest.approx(2.0, rel=0.05)
    assert (noisy - still)[:, 7:].std() == pytest.approx(4.0, rel=0.05)
    assert lost[:, 1:7].mean() == pytest.approx(0.01, rel=0.3)
    assert lost[:, 7:].mean() == pytest.approx(0.03, rel=0.15)
    assert not lost[0].any()
    where = np.argwhere(lost)
    np.testing.assert_array_equal(noisy[where[:, 0], where[:, 1]], noisy[where[:, 0] - 1, where[:, 1]])
    assert np.all((confidence >= 0) & (confidence <= 1))


def test_detector_is_worse_on_fast_points():
    moving = np.zeros((4000, 49, 2))
    moving[:, 10, 0] = 30.0 * np.arange(4000)
    noisy, confidence = Detector(loss=0.01).detect(moving, np.random.default_rng(1))
    detected = confidence > 0
    fast, slow = (np.std((noisy - moving)[:, joint][detected[:, joint]]) for joint in (10, 11))
    assert fast > 2 * slow
    assert (~detected[:, 10]).mean() > 1.5 * (~detected[:, 11]).mean()
    again, _ = Detector(loss=0.01).detect(moving, np.random.default_rng(1))
    np.testing.assert_array_equal(noisy, again)


def test_perfect_detector_changes_nothing(take):
    points = keypoints(take.motion)
    same, confidence = Detector(jitter=0.0, blur=0.0, loss=0.0).detect(points, np.random.default_rng(0))
    np.testing.assert_array_equal(same, points)
    assert np.all(confidence == 1.0)


def test_s2g_windows(take, tmp_path):
    points = keypoints(take.motion)
    paths = write_s2g_windows(tmp_path / "ada" / "train" / "npz", "take", points, take.audio, 16000)
    assert len(paths) == len(range(0, 120 - 63, 5))
    with np.load(paths[2], allow_pickle=False) as window:
        assert window["pose"].shape == (64, 2, 49)
        np.testing.assert_allclose(window["pose"][5, 1], points[15, :, 1])
        assert len(window["audio"]) == 67200
        start = round(10 / 15 * 16000)
        np.testing.assert_array_equal(window["audio"], take.audio[start : start + 67200].astype(np.float32))
    with pytest.raises(InputError, match="22050 Hz"):
        write_s2g_windows(tmp_path, "take", points, take.audio, 22050)
    with pytest.raises(InputError, match="take: its audio ends at 2.00 s"):
        write_s2g_windows(tmp_path, "take", points, take.audio[:32000], 16000)


# --- TED's directions


@pytest.mark.parametrize(("layout", "joints", "bones"), [(ted.TED, 10, 9), (ted.TED_EXPRESSIVE, 43, 42)])
def test_directions(take, layout, joints, bones):
    assert (len(layout.points), len(layout.bones), len(layout.lengths)) == (joints, bones, bones)
    assert sorted(joint for _, joint in layout.bones) == list(range(1, joints))
    values = ted.directions(take.motion, layout)
    assert values.shape == (120, 3 * bones)
    np.testing.assert_allclose(np.linalg.norm(values.reshape(120, bones, 3), axis=-1), 1.0, atol=1e-12)

    positions = ted.view_positions(take.motion, layout)
    lengths = ted.bone_lengths(positions, layout)
    again = ted.positions_from_directions(values, layout, lengths, positions[:, 0])
    np.testing.assert_allclose(again, positions, atol=1e-12)
    # With constant lengths, as the authors draw poses: the directions come back.
    drawn = ted.positions_from_directions(values, layout)
    np.testing.assert_allclose(ted.directions_from_positions(drawn, layout), values, atol=1e-12)
    np.testing.assert_allclose(ted.bone_lengths(drawn, layout), np.tile(layout.lengths, (120, 1)), atol=1e-12)
    assert np.linalg.det(np.diag(layout.axes)) == 1.0


def test_directions_are_the_bones_of_the_talker(take):
    """Bone 4 (left elbow to wrist) of TED-Expressive and bone 5 of TED against forward kinematics."""
    half = resample(take.motion, 15.0)
    places, names = slow_positions(half), half.skeleton.names
    bone = places[:, names.index("L_Wrist")] - places[:, names.index("L_Elbow")]
    bone /= np.linalg.norm(bone, axis=1, keepdims=True)
    full = ted.directions(take.motion, ted.TED_EXPRESSIVE).reshape(120, 42, 3)
    np.testing.assert_allclose(full[:, 4], bone * [1, -1, -1], atol=1e-5)
    for number, above, joint in ((5, "L_Wrist", "L_Index1"), (15, "L_Ring1", "L_Ring2"), (36, "R_Thumb2", "R_Thumb3")):
        bones = places[:, names.index(joint)] - places[:, names.index(above)]
        bones /= np.linalg.norm(bones, axis=1, keepdims=True)
        np.testing.assert_allclose(full[:, number], bones * [1, -1, -1], atol=1e-4)
    small = ted.directions(take.motion, ted.TED).reshape(120, 9, 3)
    np.testing.assert_allclose(small[:, 5], bone * [-1, -1, 1], atol=1e-5)


def test_ted_looks_as_its_authors_mean():
    """The mean pose that TED's authors print: neck up (-y), left shoulder at -x, forearms forward (+z)."""
    take = talk(30.0, 1, speaker="chiara", fps=15.0)
    mean = ted.directions(take.motion, ted.TED).mean(axis=0).reshape(9, 3)
    expected = [(0, -1, 0), (0, -0.87, 0.43), (0, -0.88, -0.41), (-0.92, 0.31, 0), (-0.52, 0.81, 0.09), None]
    for bone, direction in enumerate(expected):
        if direction is not None:
            assert mean[bone] @ np.array(direction) / np.linalg.norm(mean[bone]) > 0.8, bone
    assert mean[5, 2] > 0.3
    assert mean[8, 2] > 0.3
    assert mean[6, 0] > 0.5


def test_layout_is_that_of_real_clips(shared):
    """Real TED-Expressive clips have the same bones in the same places, with the same axes."""
    real = np.concatenate([np.load(path)["dir_vec"] for path in sorted((shared / "ted").glob("*.npz"))])
    real = real.reshape(-1, 42, 3)
    take = talk(30.0, 1, speaker="chiara", fps=15.0, fingers=True)
    ours = ted.directions(take.motion, ted.TED_EXPRESSIVE).reshape(-1, 42, 3)
    for bone in (0, 1, 2, 3, 20, 37, 38, 39, 40, 41):
        a, b = real[:, bone].mean(axis=0), ours[:, bone].mean(axis=0)
        assert a @ b > 0.6 * np.linalg.norm(a) * np.linalg.norm(b), bone
    # Toward the camera is -z: forearms, nose. A finger bends into the hand, so its bones turn further and further.
    for clips in (real, ours):
        assert clips[:, [4, 21, 37], 2].mean(axis=0).max() < -0.3
        for first in (5, 8, 11, 14, 22, 25, 28, 31):
            bend = np.sum(clips[:, first] * clips[:, first + 1], axis=-1)
            far = np.sum(clips[:, first] * clips[:, first + 2], axis=-1)
            assert np.median(far) < np.median(bend) < 1.0
    # Thumbs are apart from the other fingers, which lie side by side.
    for clips in (real, ours):
        for wrist in (5, 22):
            knuckles = np.median(clips[:, wrist : wrist + 13 : 3] @ np.swapaxes(clips, 1, 2)[:, :, [wrist + 3]], axis=0)
            assert np.argmin(knuckles) == 4


# --- Capture noise


def test_no_jitter_is_the_motion_itself(take):
    same = add_jitter(take.motion, 0.0, np.random.default_rng(0))
    np.testing.assert_array_equal(same.rotations, take.motion.rotations)
    np.testing.assert_array_equal(same.root, take.motion.root)
    with pytest.raises(ValueError, match="0 or more"):
        add_jitter(take.motion, -1.0, np.random.default_rng(0))


def test_jitter_has_the_size_that_is_asked_for():
    still = talk(60.0, 2, fingers=True).motion
    still = replace(still, rotations=np.tile(np.eye(3, dtype=np.float32), (*still.rotations.shape[:2], 1, 1)))
    noisy = add_jitter(still, 1.0, np.random.default_rng(3))
    vectors = np.rad2deg(Rotation.from_matrix(noisy.rotations.reshape(-1, 3, 3)).as_rotvec())
    vectors = vectors.reshape(still.frames, -1, 3)
    # Pops are rare: a robust spread is that of the noise without them.
    spread = 1.4826 * np.median(np.abs(vectors), axis=(0, 2))
    np.testing.assert_allclose(spread, joint_weights(still.skeleton.parents), rtol=0.12)
    assert spread[still.skeleton.index("L_Wrist")] > 2 * spread[0]
    assert np.abs(vectors).max() > 8.0
    held = np.all(np.diff(noisy.rotations, axis=0) == 0, axis=(2, 3))
    assert 0.0005 < held.mean() < 0.01
    np.testing.assert_allclose(noisy.rotations @ np.swapaxes(noisy.rotations, 2, 3), np.eye(3) + 0 * noisy.rotations,
                               atol=1e-6)  # fmt: skip


def test_jitter_is_deterministic_and_the_same_without_fingers(take):
    first, second = (add_jitter(take.motion, 2.0, np.random.default_rng(seed)) for seed in (4, 4))
    np.testing.assert_array_equal(first.rotations, second.rotations)
    assert np.abs(add_jitter(take.motion, 2.0, np.random.default_rng(5)).rotations - first.rotations).max() > 0.01
    body = talk(8.0, 2, speaker="ada", emotion="happiness").motion
    np.testing.assert_array_equal(add_jitter(body, 2.0, np.random.default_rng(4)).rotations, first.rotations[:, :22])


def test_jitter_raises_jerk_with_its_strength(bodily):
    def jerk(motion):
        return np.sqrt(np.mean(np.diff(motion.positions()[:, 20:22], n=3, axis=0) ** 2))

    clean = jerk(bodily.motion)
    jerks = [jerk(add_jitter(bodily.motion, degrees, np.random.default_rng(1))) / clean for degrees in (0.5, 2.0, 5.0)]
    assert jerks[0] > 1.5
    assert jerks[1] > 2 * jerks[0]
    assert jerks[2] > 1.8 * jerks[1]


def test_skate_moves_the_root_over_the_floor_only(bodily):
    skating = add_jitter(bodily.motion, 0.0, np.random.default_rng(1), skate=0.02)
    drift = skating.root - bodily.motion.root
    assert not drift[:, 1].any()
    assert 0.001 < np.abs(drift).max() < 0.1
    np.testing.assert_array_equal(skating.rotations, bodily.motion.rotations)
