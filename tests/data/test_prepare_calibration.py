"""``a2g prepare`` leaves calibration poses out, bridges flips, says so, and smooths motion where that is requested."""

from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.data.featurise import prepare_recording, without_calibration
from a2g_jax.data.prepare import prepare_data_set
from a2g_jax.data.settings import Features
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk

FEATURES = Features()


def with_pose(recording, frames, prepended):
    """A T-pose in place of the first frames, or before them."""
    motion = recording.motion
    pose = np.tile(np.eye(3, dtype=np.float32), (frames, motion.skeleton.joints, 1, 1))
    start = 0 if prepended else frames
    rotations = np.concatenate([pose, np.asarray(motion.rotations)[start:]])
    root = np.concatenate([np.tile(np.asarray(motion.root)[:1], (frames, 1)), np.asarray(motion.root)[start:]])
    return replace(recording, motion=replace(motion, rotations=rotations, root=root), sources=("a.wav", "a.bvh"))


@pytest.fixture(scope="module")
def recording():
    return talk(6.0, 3, name="take")


def test_in_place_of_the_first_frame(recording):
    changed = with_pose(recording, 1, False)
    prepared = prepare_recording(changed, FEATURES)
    (note,) = prepared.notes
    assert "take: frame 0 of the motion (0.03 s and its speech) left out" in note
    assert prepared.annotations["calibration"] == {"frames": 1, "with_audio": True}
    plain = prepare_recording(recording, FEATURES)
    np.testing.assert_allclose(prepared.pose, plain.pose[1:], atol=1e-5)
    assert len(prepared.audio) == len(prepared.pose)
    assert plain.notes == ()
    assert "calibration" not in plain.annotations


def test_before_the_speech(recording):
    """Audio that is as long as the performance stays whole."""
    left, notes = without_calibration(with_pose(recording, 30, True))
    assert "frames 0 to 29" in notes[0]
    assert "before the speech" in notes[0]
    assert len(left.audio) == len(recording.audio)
    np.testing.assert_array_equal(left.motion.rotations, recording.motion.rotations)
    left, _ = without_calibration(with_pose(recording, 30, False))
    assert len(left.audio) == len(recording.audio) - recording.sample_rate


def test_the_command_says_so_and_smooths(recording, tmp_path, capsys):
    source = tmp_path / "takes"
    for number in range(3):
        taken = with_pose(recording, 1, False) if number == 1 else recording
        write_bvh(source / f"take{number}.bvh", taken.motion)
        write_audio(source / f"take{number}.wav", taken.audio, taken.sample_rate)
    plain = prepare_data_set("folder", source, tmp_path / "plain", FEATURES, workers=1)
    assert "take1: frame 0" in capsys.readouterr().err
    smooth = prepare_data_set("folder", source, tmp_path / "smooth", FEATURES, workers=1, smooth=3.0)
    again = prepare_data_set("folder", source, tmp_path / "again", FEATURES, workers=1)
    one, two, three = (np.asarray(corpus.pose) for corpus in (plain, smooth, again))
    assert one.shape == two.shape
    assert 1e-4 < np.abs(one - two).max() < 0.2
    np.testing.assert_array_equal(one, three)


def test_flips_are_bridged_and_named(recording):
    """A corpus with them has networks that flip hands, too."""
    wrist = recording.motion.skeleton.names.index("L_Wrist")
    rotations = np.array(recording.motion.rotations)
    rotations[60:64, wrist] = rotations[60:64, wrist] @ np.diag([1.0, -1.0, -1.0]).astype(np.float32)
    taken = replace(recording, sources=("a.wav", "a.bvh"))
    flipped = replace(taken, motion=replace(taken.motion, rotations=rotations))
    prepared, plain = prepare_recording(flipped, FEATURES), prepare_recording(taken, FEATURES)
    (note,) = prepared.notes
    assert note.startswith("take: turns faster than 1800 degrees a second are bridged; frames by joint: L_Wrist (")
    assert prepared.annotations["motion_fps"] == recording.motion.fps
    assert plain.notes == ()
    changed = np.any(prepared.pose != plain.pose, axis=(1, 2))
    assert 4 <= changed.sum() < 20
    assert np.abs(np.diff(prepared.pose, axis=0)).max() < 1.0 < np.abs(np.diff(represented(flipped), axis=0)).max()


def represented(recording):
    return prepare_recording(replace(recording, sources=()), FEATURES).pose
