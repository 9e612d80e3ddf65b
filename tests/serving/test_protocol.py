"""Messages of ``/live``: what is refused, and what frames look like."""

import json
from dataclasses import dataclass, field

import numpy as np
import pytest

from a2g_jax.geometry.motion import Motion
from a2g_jax.serving.live import protocol
from a2g_jax.serving.live.protocol import Hello, Refusal, checked_sampling, decode_audio, parse_hello
from a2g_jax.talker.recordings import talk


def test_the_shortest_first_message():
    assert parse_hello('{"sample_rate": 44100.0}') == Hello(44100)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "expected a JSON object"),
        ("[1]", "got a list"),
        ("[" * 5000, "expected a JSON object"),
        ('{"sample_rate": ' + "9" * 5000 + "}", "expected a JSON object"),
        ('{"sample_rate": NaN}', "expected a JSON object"),
        ("{}", "sample_rate is missing"),
        ('{"sample_rate": "48000"}', "sample_rate: expected a number"),
        ('{"sample_rate": true}', "sample_rate: expected a number"),
        ('{"sample_rate": 0}', "sample_rate: expected"),
        ('{"sample_rate": 1e300}', "sample_rate: expected"),
        ('{"sample_rate": 48000, "rate": 1}', "unknown field 'rate'"),
        ('{"sample_rate": 48000, "type": "end"}', 'expected {"type": "hello"'),
        ('{"sample_rate": 48000, "channels": 2}', "channels: expected 1"),
        ('{"sample_rate": 48000, "encoding": "mp3"}', "encoding: expected s16le or f32le"),
        ('{"sample_rate": 48000, "encoding": ["s16le"]}', "encoding: expected"),
        ('{"sample_rate": 48000, "reply": {}}', "reply: expected"),
        ('{"sample_rate": 48000, "seed": -1}', "seed: expected"),
        ('{"sample_rate": 48000, "seed": 1.5}', "seed: expected"),
        ('{"sample_rate": 48000, "lookahead": "0"}', "lookahead: expected"),
        ('{"sample_rate": 48000, "lookahead": 1e9}', "lookahead: expected"),
        ('{"sample_rate": 48000, "sampling": []}', "sampling: expected"),
        ('{"sample_rate": 48000}' + " " * 20000, "more than 16384 characters"),
    ],
)
def test_first_messages_that_are_refused(text, reason):
    with pytest.raises(Refusal) as caught:
        parse_hello(text)
    assert reason in caught.value.reason
    assert "\n" not in caught.value.reason
    assert len(caught.value.short.encode()) <= 123


@dataclass(frozen=True)
class Settings:
    """Sampling settings of a model."""

    temperature: float = 1.0
    denoise: bool = False
    keep: int | None = None
    controls: tuple[str, ...] = ()
    gains: tuple[str, ...] = field(default=(), metadata={"measured": True})


def test_sampling_settings_have_the_types_of_the_models():
    good = {"temperature": 1, "denoise": True, "keep": 3, "controls": ["energy=0.9"]}
    assert checked_sampling(Settings(), good) == {**good, "controls": ("energy=0.9",)}
    for bad in (
        {"temperature": "hot"},
        {"temperature": True},
        {"denoise": 1},
        {"keep": 1.5},
        {"keep": 2**31},
        {"temperature": 10**400},
        {"temperature": float("inf")},
        {"controls": "energy=0.9"},
        {"controls": [1]},
        {"gains": ["a=1"]},
        {"other": 1},
    ):
        with pytest.raises(Refusal, match="sampling"):
            checked_sampling(Settings(), bad)


def test_audio_of_both_encodings():
    np.testing.assert_array_equal(decode_audio(np.array([-32768, 16384], "<i2").tobytes(), "s16le"), [-1.0, 0.5])
    np.testing.assert_array_equal(decode_audio(np.array([0.25, 1e9], "<f4").tobytes(), "f32le"), [0.25, 8.0])
    for data, encoding in ((b"123", "s16le"), (b"123456", "f32le")):
        with pytest.raises(Refusal, match="no whole number"):
            decode_audio(data, encoding)
    with pytest.raises(Refusal, match="sample 1 is NaN"):
        decode_audio(np.array([0, np.nan], "<f4").tobytes(), "f32le")


def test_binary_frames_are_those_of_json():
    motion = talk(2.0, 1).motion
    data = protocol.frames_binary(motion, 70)
    first, rows = protocol.read_binary(data, 3 + 4 * motion.skeleton.joints)
    assert (first, len(rows), len(data)) == (70, motion.frames, 8 + 4 * rows.size)
    frames = json.loads(protocol.frames_json(motion, 70))["frames"]
    assert frames[3]["index"] == 73
    assert frames[3]["time"] == pytest.approx(73 / motion.fps)
    np.testing.assert_allclose(rows[3, :3], frames[3]["root"], atol=1e-5)
    turns = rows[3, 3:].reshape(-1, 4)
    np.testing.assert_allclose(turns, frames[3]["rotations"], atol=1e-6)
    assert (turns[:, 3] >= 0).all()
    x, y, z, w = turns[5]
    np.testing.assert_allclose(
        np.asarray(motion.rotations)[3, 5, :, 0],
        [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
        atol=1e-5,
    )


def test_no_frames_are_no_rows():
    motion = talk(2.0, 1).motion
    empty = Motion(motion.rotations[:0], motion.root[:0], motion.skeleton, motion.fps)
    assert protocol.frames_binary(empty, 5) == np.array([5, 0], "<u4").tobytes()
