"""Every fault is found by its own check, and by no other; sound recordings raise no warning."""

from dataclasses import replace

import numpy as np
import pytest
from recordings_for_tests import CAST, RATE, clean, codes, frozen, long_talk, turned, write_pair

from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.inspection.audio_checks import Speech, check_audio, clipped_share
from a2g_jax.inspection.inspect import inspect
from a2g_jax.inspection.motion_checks import check_finite, check_motion
from a2g_jax.inspection.sync import RATE as RATE_OF_OFFSETS
from a2g_jax.inspection.sync import at_rate, check_lengths, check_offset, energy_db, measure_offset, wrist_positions
from a2g_jax.io.bvh import write_bvh

HALF_TURN = np.diag([1.0, -1.0, -1.0])


def faults(motion):
    return check_motion(motion, find_rig(motion))


@pytest.mark.parametrize("number", range(len(CAST)))
def test_sound_recordings_raise_no_warning(number, tmp_path):
    bvh, wav = write_pair(tmp_path, clean(number))
    report = inspect(bvh, wav)
    assert report.warnings == 0, report.text()
    assert report.facts["together"]["lengths (s)"] == {"motion": 20.0, "audio": 20.0}


@pytest.mark.parametrize("rate", [60.0, 29.97 / 2, 24.0])
def test_wrong_rate(rate, tmp_path):
    """A motion of another rate with 30 fps in its header."""
    moved = resample(clean(0).motion, rate)
    bvh, wav = write_pair(tmp_path, replace(clean(0), motion=replace(moved, fps=30.0)))
    report = inspect(bvh, wav)
    assert codes(report.findings) == {"frame-time"}
    (found,) = (finding for finding in report.findings if finding.severity == "warning")
    assert found.value == pytest.approx(rate, rel=0.01)
    assert f"Frame Time: {1 / found.value:.8f}" in found.fix


def test_broadcast_rate():
    """29.97 fps read as 30 is found in ten minutes; a recorder that stops a second later is no fault."""
    seconds = 600.0
    (found,) = check_lengths(round(seconds * 30000 / 1001), 30.0, seconds)
    assert found.code == "frame-time"
    assert found.value == pytest.approx(30000 / 1001)
    assert check_lengths(round((seconds + 1.3) * 30), 30.0, seconds) == []
    (other,) = check_lengths(round(0.7 * seconds * 30), 30.0, seconds)
    assert other.code == "length"


@pytest.mark.parametrize("late", [0.5, -0.5, 3.0])
def test_offset(late):
    """Half a second or more, either way."""
    wrists = at_rate(wrist_positions(long_talk().motion, find_rig(long_talk().motion)), 30.0)
    energy, cut = energy_db(long_talk().audio, RATE, 64.0), round(abs(late) * RATE_OF_OFFSETS)
    offset = measure_offset(energy[cut:], wrists) if late > 0 else measure_offset(energy, wrists[cut:])
    (found,) = check_offset(offset)
    assert found.code == "offset"
    assert found.value == pytest.approx(late, abs=0.1)


def test_offset_of_files(tmp_path):
    moved = replace(long_talk(), audio=long_talk().audio[RATE // 2 :], motion=long_talk().motion.clip(0, 1905))
    bvh, wav = write_pair(tmp_path, moved)
    report = inspect(bvh, wav)
    assert codes(report.findings) == {"offset"}, report.text()
    assert "Cut 0.5" in report.findings[-1].fix


def test_offsets_of_unrelated_or_short_recordings_are_not_significant():
    """The speech backwards is unrelated; a short one has no offset."""
    motion = long_talk().motion
    wrists = at_rate(wrist_positions(motion, find_rig(motion)), 30.0)
    related = measure_offset(energy_db(long_talk().audio, RATE, 64.0), wrists)
    assert related.significant
    assert check_offset(related) == []
    near = measure_offset(energy_db(long_talk().audio[RATE // 8 :], RATE, 60.0), wrists)
    assert near.seconds - related.seconds == pytest.approx(0.125, abs=0.03)
    assert check_offset(near) == []
    other = measure_offset(energy_db(long_talk().audio[::-1].copy(), RATE, 64.0), wrists)
    assert not other.significant
    assert check_offset(other) == []
    assert measure_offset(energy_db(long_talk().audio, RATE, 15.0), wrists) is None
    assert measure_offset(np.zeros(2000), wrists) is None
    assert check_offset(None) == []


@pytest.mark.parametrize("joint", ["L_Elbow", "R_Wrist"])
def test_frozen_joint(joint):
    motion = clean(0).motion
    (found,) = (x for x in faults(frozen(motion, joint, 200, 320)) if x.severity == "warning")
    assert (found.code, found.place.joint, found.place.frame) == ("frozen", joint, 200)
    assert found.value == pytest.approx(119 / 30)
    assert codes(faults(frozen(motion, joint, 0, motion.frames))) == {"frozen"}


def test_still_legs_and_one_still_spine_are_no_fault():
    motion = clean(1).motion
    for joint in ("L_Hip", "R_Hip", "L_Knee", "R_Knee", "Spine2", "L_Collar"):
        motion = frozen(motion, joint, 0, motion.frames)
    (found,) = faults(motion)
    assert (found.severity, found.code, found.value) == ("info", "static", 8.0)
    head = frozen(frozen(motion, "Head", 0, 100), "Neck", 0, 100)
    assert codes(faults(head)) == {"frozen"}
    # Still for as long as everything is: a pause of the recording, not of a joint.
    paused = replace(motion, rotations=np.repeat(np.asarray(motion.rotations)[:1], 60, 0), root=motion.root[:60])
    assert [x.message for x in faults(paused)] == ["nothing moves."]


@pytest.mark.parametrize("frames", [slice(300, 301), slice(300, 340)])
def test_flip(frames):
    (found,) = (x for x in faults(turned(clean(2).motion, "R_Wrist", frames, HALF_TURN)) if x.severity == "warning")
    assert (found.code, found.place.joint) == ("flip", "R_Wrist")
    assert found.place.frame in (frames.start - 1, frames.stop - 1)


def test_angles_that_wrap_are_no_flip(tmp_path):
    """Angles beside 180 degrees, written between -180 and 180, as many exporters do."""
    motion = clean(3).motion
    bvh, _ = write_pair(tmp_path, replace(clean(3), motion=turned(motion, "L_Wrist", slice(None), HALF_TURN)))
    lines = bvh.read_text().split("\n")
    first = next(at for at, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    rows = np.array([line.split() for line in lines[first:] if line], float)
    rows[:, 3:] = (rows[:, 3:] + 180) % 360 - 180
    bvh.write_text("\n".join(lines[:first] + [" ".join(f"{x:.5f}" for x in row) for row in rows]) + "\n")
    report = inspect(bvh)
    assert report.warnings == 0, report.text()
    assert "euler-wrap" in {finding.code for finding in report.findings}


def test_leap_of_the_root():
    motion = clean(4).motion
    root = np.asarray(motion.root) + np.float32([1, 0, 0]) * (np.arange(motion.frames) >= 250)[:, None]
    (found,) = (x for x in faults(replace(motion, root=root.astype(np.float32))) if x.severity == "warning")
    assert (found.code, found.place.frame) == ("jump", 249)


@pytest.mark.parametrize("every", [2, 3])
def test_repeated_frames(every):
    motion = clean(5).motion
    rows = np.arange(motion.frames) // every * every
    repeated = replace(motion, rotations=np.asarray(motion.rotations)[rows], root=np.asarray(motion.root)[rows])
    (found,) = (x for x in faults(repeated) if x.severity == "warning")
    assert found.code == "repeated"
    assert found.value == pytest.approx(1 - 1 / every, abs=0.01)


def test_clipping():
    audio = clean(0).audio
    loud = np.clip(audio * (4 / np.abs(audio).max()), -1, 1).astype(np.float32)
    assert codes(check_audio(Speech(loud, RATE))) == {"clipping"}
    # Clipped before it was made quieter, and rounded to 16 bits.
    assert codes(check_audio(Speech((np.rint(0.3 * loud * 32767) / 32768).astype(np.float32), RATE))) == {"clipping"}


def test_loud_is_not_clipped():
    """The tops of a tone are single samples, and those of clean speech are few."""
    tone = np.sin(2 * np.pi * 440.0 * np.arange(RATE) / RATE).astype(np.float32)
    assert clipped_share(tone) == (0.0, 0)
    speech = clean(2).audio
    assert clipped_share(speech / np.abs(speech).max())[0] < 1e-4


def test_silence():
    audio = clean(1).audio.copy()
    audio[3 * RATE : 10 * RATE] *= 1e-4
    (found,) = check_audio(Speech(audio, RATE))
    assert found.code == "silence"
    assert found.value == pytest.approx(7.0, abs=0.5)
    assert found.place.seconds == pytest.approx(3.0, abs=0.5)


def test_offset_of_samples_and_faint_speech():
    audio = clean(2).audio
    (found,) = check_audio(Speech(audio * np.float32(0.5) + np.float32(0.05), RATE))
    assert (found.severity, found.code) == ("info", "dc")
    assert found.value == pytest.approx(0.05, abs=1e-3)
    assert codes(check_audio(Speech(audio * np.float32(0.003), RATE))) == {"faint"}


def test_nan():
    motion = clean(0).motion
    rotations = np.asarray(motion.rotations).copy()
    rotations[7, 3, 1, 2] = np.nan
    (found,) = check_motion(replace(motion, rotations=rotations))
    assert found.code == "nan"
    assert "[7, 3, 1, 2]" in found.message
    assert check_finite(np.ones((2, 2)), "x") == []


@pytest.mark.parametrize(("claimed", "there"), [(600, 597), (590, 600)])
def test_header_frame_count(claimed, there, tmp_path):
    bvh, wav = write_pair(tmp_path, clean(0))
    text = bvh.read_text()
    head, motion = text.split("MOTION\n")
    lines = motion.split("\n")
    bvh.write_text(head + f"MOTION\nFrames: {claimed}\n" + "\n".join(lines[1 : 2 + there]) + "\n")
    report = inspect(bvh, wav)
    assert codes(report.findings) == {"frame-count"}
    assert f"{claimed} frames and there are {there}" in report.findings[0].message
    assert report.facts["motion"]["frames"] == there


def test_lines_that_are_cut_short_and_nan_in_text(tmp_path):
    bvh, _ = write_pair(tmp_path, clean(0))
    lines = bvh.read_text().rstrip("\n").split("\n")
    cut = [*lines[:-1], lines[-1][:40]]
    bvh.write_text("\n".join(cut) + "\n")
    report = inspect(bvh)
    assert codes(report.findings) == {"columns"}
    assert report.facts["motion"]["frames"] == 599
    words = lines[-50].split()
    bvh.write_text("\n".join([*lines[:-50], " ".join(["nan", *words[1:]]), *lines[-49:]]) + "\n")
    report = inspect(bvh)
    assert codes(report.findings) == {"nan"}
    assert report.facts["motion"]["frames"] == 550
    bvh.write_text("\n".join([*lines[:-50], " ".join(["x", *words[1:]]), *lines[-49:]]) + "\n")
    report = inspect(bvh)
    assert codes(report.findings) == {"numbers"}
    assert "motion" not in report.facts


def test_real_takes(shared):
    """What is warned of in the real recordings is true: two wrists of the ZeroEGGS take leap in one frame."""
    for name, truth in (("beat/2_scott_0_1_1", set()), ("zeggs/067_Speech_2_x_1_0", {"flip"})):
        report = inspect(shared / f"{name}.bvh", shared / f"{name}.wav")
        assert codes(report.findings) == truth
    flips = {(x.place.joint, x.place.frame): round(x.value) for x in report.findings if x.code == "flip"}
    assert flips == {("RightHand", 2015): 109, ("LeftHand", 1730): 177}
    assert "motion +0.02 s" in report.facts["together"]["offset"]


def test_resampling_brings_no_fault(tmp_path):
    """Half the rate turns twice as far a frame; fast gestures stay no flips."""
    for number in (1, 2, 5):
        motion = resample(clean(number).motion, 12.0)
        write_bvh(tmp_path / "slow.bvh", motion)
        assert inspect(tmp_path / "slow.bvh").warnings == 0
