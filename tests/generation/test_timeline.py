"""Pins: parsing, places, codes (``--pin-mode latent``), and how closely they are followed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.audio2gestures.latent_space import LatentSpace
from a2g_jax.generation.audio2gestures.pins import pin_codes, pin_weights
from a2g_jax.generation.pins.form import parse_pin
from a2g_jax.generation.pins.report import Ends, report_pins
from a2g_jax.generation.pins.request import Pin, check_pins, read_pin
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.onto import face, same_rest
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import demo_run


def part(motion, first, stop):
    """Frames of a motion."""
    return Motion(motion.rotations[first:stop], motion.root[first:stop], motion.skeleton, motion.fps)


@pytest.fixture(scope="module")
def clip():
    """Two seconds of gestures."""
    return part(talk(10.0, 77, speaker="felix").motion, 90, 150)


@pytest.fixture(scope="module")
def speech():
    return talk(8.0, 5)


@pytest.mark.parametrize(
    ("text", "path", "second", "length"),
    [("a.bvh@3.2", "a.bvh", 3.2, None), ("b@c.npz@0", "b@c.npz", 0.0, None), ("a+b.bvh@8+1.5", "a+b.bvh", 8.0, 1.5)],
)
def test_parse(text, path, second, length):
    assert parse_pin(text) == (Path(path), second, length)


@pytest.mark.parametrize(
    "text", ["a.bvh", "a.bvh@", "@3", "a.bvh@-1", "a.bvh@soon", "a.bvh@inf", "a.bvh@3+", "a.bvh@3+x"]
)
def test_refused(text):
    with pytest.raises(InputError, match=r"such as wave\.bvh@3\.2"):
        parse_pin(text)


def test_pins_are_in_order_and_apart(clip):
    early, late = Pin("early", 1.0, clip), Pin("late", 4.0, clip)
    assert [pin.name for pin in check_pins([late, early], 240, 30.0)] == ["early", "late"]
    with pytest.raises(InputError, match=r"late@4: ends at 6\.00 s, the speech at 5\.00 s"):
        check_pins([late, early], 150, 30.0)
    with pytest.raises(InputError, match="must not overlap"):
        check_pins([early, Pin("other", 2.9, clip)], 240, 30.0)


def test_weights():
    weights = pin_weights(20, 8, 12, 3)
    np.testing.assert_array_equal(weights[8:12], 1.0)
    np.testing.assert_allclose(weights[5:8], weights[12:15][::-1])
    assert np.all(np.diff(weights[4:9]) > 0)
    assert weights[:5].max() == 0.0 == weights[15:].max()
    np.testing.assert_array_equal(pin_weights(20, 8, 12, 0) > 0, (np.arange(20) >= 8) & (np.arange(20) < 12))


def test_codes_are_the_clips_where_it_is_pinned_and_the_drawn_ones_elsewhere(clip, speech):
    space = LatentSpace(demo_run())
    codes = space.from_audio(speech.audio)
    own = space.from_motion(clip)
    pin = Pin("clip", 3.0, clip)
    mixed = pin_codes(space, codes, [pin], blend=0.2)
    at, length = codes.context + 90, clip.frames
    np.testing.assert_allclose(
        mixed.specific[at : at + length], own.specific[own.context : own.context + length], atol=1e-6
    )
    np.testing.assert_allclose(mixed.specific[: at - 7], codes.specific[: at - 7], atol=1e-6)
    np.testing.assert_allclose(mixed.specific[at + length + 7 :], codes.specific[at + length + 7 :], atol=1e-6)
    np.testing.assert_array_equal(mixed.shared, codes.shared)
    both = pin_codes(space, codes, [pin], blend=0.2, shared=1.0)
    np.testing.assert_allclose(both.shared[at : at + length], own.shared[own.context : own.context + length], atol=1e-6)


def test_close_pins_do_not_reach_into_each_other(clip, speech):
    """Each clip's own stretch has only its own code."""
    space = LatentSpace(demo_run())
    codes = space.from_audio(speech.audio)
    pins = [Pin("one", 1.0, clip), Pin("two", 3.1, clip)]
    mixed = pin_codes(space, codes, pins, blend=0.5)
    own = space.from_motion(clip)
    inside = own.specific[own.context : own.context + clip.frames]
    for pin in pins:
        at = codes.context + pin.first
        np.testing.assert_allclose(mixed.specific[at : at + clip.frames], inside, atol=1e-6)


def test_a_pin_is_followed_and_the_report_says_what_is_not(clip, speech):
    space = LatentSpace(demo_run())
    codes = space.from_audio(speech.audio)
    plain, pin = space.to_motion(codes), Pin("clip", 3.0, clip)
    moved = space.to_motion(pin_codes(space, codes, [pin], shared=1.0))
    (row,) = report_pins([pin], moved, plain, 1e4, "a test", Ends(22, 22))
    assert row["error_cm"] < 0.6 * row["unpinned_error_cm"]
    assert row["smooth"]
    assert row["followed"] == (row["wrist_error_cm"] <= 5.0 and row["wrist_worst_cm"] <= 10.0)
    (ignored,) = report_pins([pin], plain, plain, 1.0, "a test", Ends(22, 22))
    assert ignored["error_cm"] == ignored["unpinned_error_cm"]
    assert not ignored["followed"]
    assert not ignored["smooth"]


def test_another_rig_and_rate_are_brought_to_the_runs(clip, tmp_path):
    write_bvh(tmp_path / "wave.bvh", talk(3.0, 4, fps=60.0, fingers=True).motion)
    pin = read_pin(f"{tmp_path / 'wave.bvh'}@1.5", demo_run())
    assert (pin.first, pin.motion.frames, pin.motion.skeleton.joints) == (45, 90, 22)
    write_bvh(tmp_path / "blink.bvh", part(clip, 0, 3))
    with pytest.raises(InputError, match=r"lasts 0\.10 s"):
        read_pin(f"{tmp_path / 'blink.bvh'}@1.5", demo_run())


def test_a_part_of_a_clip(clip, tmp_path):
    write_bvh(tmp_path / "wave.bvh", clip)
    pin = read_pin(f"{tmp_path / 'wave.bvh'}@1+0.5", demo_run())
    assert pin.motion.frames == 15
    np.testing.assert_allclose(pin.motion.rotations[:, 1:], clip.rotations[:15, 1:], atol=1e-4)
    with pytest.raises(InputError, match=r"lasts 2\.00 s; request no more"):
        read_pin(f"{tmp_path / 'wave.bvh'}@1+2.5", demo_run())


def test_longer_bones_stay_as_they_are_and_another_rest_pose_is_retargeted(clip):
    skeleton = clip.skeleton
    assert same_rest(skeleton, skeleton.scaled(1.3))
    offsets = np.array(skeleton.offsets)
    elbow = skeleton.names.index("L_Elbow")
    offsets[elbow] = offsets[elbow][[1, 0, 2]]
    assert not same_rest(skeleton, replace(skeleton, offsets=offsets))


def test_a_clip_is_turned_to_face_as_the_run_does(clip):
    facing = np.eye(3)
    straight, _ = face(clip, facing)
    turned, second = face(face(clip, rotation_y(70.0))[0], facing)
    np.testing.assert_allclose(turned.rotations, straight.rotations, atol=1e-6)
    assert second == pytest.approx(-70.0)

    # The best angle: none beside it is nearer.
    def away(motion):
        return np.square(motion.rotations[:, 0] - facing[None]).sum()

    for degrees in (-1.0, 1.0):
        other = replace(straight, rotations=straight.rotations.copy())
        other.rotations[:, 0] = rotation_y(degrees) @ straight.rotations[:, 0]
        assert away(other) > away(straight)


def rotation_y(degrees):
    """Matrix."""
    angle = np.deg2rad(degrees)
    return np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])


def test_a_clip_at_the_beginning_has_one_seam_and_a_wide_blend_is_measured_whole(speech):
    motion = speech.motion
    rough = replace(motion, rotations=motion.rotations.copy())
    # A jolt 0.6 s before frame 60, and one right at the motion's beginning.
    for at in (0, 42):
        rough.rotations[at, 3:] = rough.rotations[at + 40, 3:]
    pin = Pin("late", 2.0, part(motion, 0, 60))
    near, far = (report_pins([pin], rough, rough, 1e4, "", Ends(n, n))[0]["seam_jerk"] for n in (8, 22))
    assert far > 2.0 * near
    early = Pin("early", 0.0, part(motion, 0, 90))
    whole = Pin("whole", 0.0, motion)
    (start,), (all_of_it,) = (report_pins([p], rough, rough, 1e4, "", Ends(8, 8)) for p in (early, whole))
    assert start["seam_jerk"] < far
    assert all_of_it["seam_jerk"] == 0.0
    assert all_of_it["smooth"]


def test_from_the_command_line(clip, speech, tmp_path, capsys):
    write_audio(tmp_path / "speech.wav", speech.audio, 16000)
    write_bvh(tmp_path / "wave.bvh", clip)
    out = tmp_path / "out"
    command = ["generate", "demo", "--audio", str(tmp_path / "speech.wav"), "--samples", "2", "--out", str(out)]
    assert main([*command, "--pin", f"{tmp_path / 'wave.bvh'}@3", "--pin-mode", "latent"]) == 0
    assert capsys.readouterr().out.count("cm from the clip") == 2
    rows = json.loads((out / "pins.json").read_text())
    assert [len(sample) for sample in rows] == [1, 1]
    assert rows[0][0]["end"] == 5.0
    assert (out / "sample_01.bvh").exists()
    assert "pinned" in (out / "index.html").read_text()
    assert main([*command, "--pin", f"{tmp_path / 'wave.bvh'}@7"]) == 2
    assert "pin it earlier" in capsys.readouterr().err
    assert main([*command, "--pin-blend", "1"]) == 2
    assert "--pin-blend is for --pin" in capsys.readouterr().err
