"""Recordings with several channels: two speakers, a dead channel, channels that cancel out; and how to choose one."""

import numpy as np
import pytest
import soundfile

from a2g_jax.errors import InputError
from a2g_jax.io.audio import load_audio, read_audio
from a2g_jax.io.reading import parse_channel, reading
from a2g_jax.talker.recordings import talk

RATE = 16000
RANDOM = np.random.default_rng(0)


@pytest.fixture(scope="module")
def voices():
    """Two people, eight seconds each."""
    return tuple(talk(8.0, seed, speaker=name).audio for seed, name in ((5, "ada"), (6, "bruno")))


def codes(folder, *channels, rate=RATE, subtype="FLOAT"):
    soundfile.write(folder / "a.wav", np.stack(channels, axis=1), rate, subtype=subtype)
    return [note.code for note in load_audio(folder / "a.wav").notes()]


def leaked(first, second):
    """Each microphone hears the other speaker 15 dB lower, who waits for his turn."""
    turns = (np.arange(len(first)) // (2 * RATE)) % 2
    first, second = first * (turns == 0), second * (turns == 1)
    noise = 1e-3 * RANDOM.normal(size=(2, len(first)))
    return first + 0.18 * second + noise[0], second + 0.18 * first + noise[1]


def test_two_speakers(voices, tmp_path):
    assert codes(tmp_path, *voices) == ["channels"]
    assert codes(tmp_path, *leaked(*voices)) == ["channels"]
    assert codes(tmp_path, voices[0], 0.2 * voices[1], 0.1 * voices[0]) == ["channels"]
    (note,) = load_audio(tmp_path / "a.wav").notes()
    assert "channel 1 and channel 2 differ" in str(note)
    assert "--channel 1 or --channel 2" in str(note)


def test_one_speaker_raises_no_note(voices, tmp_path):
    """The same speech twice: quieter, later, in a room, with noise, in 16 bits, with a constant offset."""
    voice = voices[0]
    room = np.convolve(voice, RANDOM.normal(size=4000) * np.exp(-np.arange(4000) / 800) * 0.05 + np.eye(1, 4000)[0])
    others = {
        "same": voice,
        "quieter": 0.3 * voice,
        "later": np.roll(voice, 40),
        "room": room[: len(voice)],
        "noise": voice + 3e-3 * RANDOM.normal(size=len(voice)),
        "offset": voice + 0.05,
    }
    for name, other in others.items():
        assert codes(tmp_path, 0.5 * voice, 0.5 * other, subtype="PCM_16") == [], name


@pytest.mark.parametrize("other", [0.0, 1e-4, 0.05])
def test_a_dead_channel(voices, tmp_path, other):
    """Silent, faint noise, or a constant offset."""
    silent = np.full(len(voices[0]), other) if other != 1e-4 else other * RANDOM.normal(size=len(voices[0]))
    assert codes(tmp_path, silent, voices[0]) == ["dead-channel"]
    note = str(load_audio(tmp_path / "a.wav").notes()[0])
    assert "left is dead" in note
    assert "--channel right" in note


def test_channels_that_cancel_out(voices, tmp_path):
    assert codes(tmp_path, voices[0], -0.8 * voices[0]) == ["channels-cancel"]
    soundfile.write(tmp_path / "a.wav", np.stack([voices[0], -voices[0]], axis=1), RATE, subtype="FLOAT")
    with pytest.raises(InputError, match=r"cancel out; choose one with --channel\."):
        read_audio(tmp_path / "a.wav")
    np.testing.assert_array_equal(read_audio(tmp_path / "a.wav", channel=2), -voices[0])


def test_one_channel_is_clipped(voices, tmp_path):
    voice = voices[0] / np.abs(voices[0]).max()
    assert codes(tmp_path, np.clip(4 * voice, -1, 1), 0.5 * voice) == ["clipped-channel"]


def test_choosing(voices, tmp_path):
    soundfile.write(tmp_path / "a.wav", np.stack(voices, axis=1), RATE, subtype="FLOAT")
    np.testing.assert_array_equal(read_audio(tmp_path / "a.wav", channel=1), voices[0])
    with reading(channel=2) as choices:
        np.testing.assert_array_equal(read_audio(tmp_path / "a.wav"), voices[1])
    assert choices.notes == []
    with reading() as choices:
        read_audio(tmp_path / "a.wav")
        read_audio(tmp_path / "a.wav")
    assert len(choices.notes) == 1
    with pytest.raises(InputError, match="has 2 channels, and channel 3 was chosen"):
        read_audio(tmp_path / "a.wav", channel=3)


def test_names_of_channels():
    assert [parse_channel(text) for text in ("left", "Right", "1", "12")] == [1, 2, 1, 12]
    for text in ("0", "-1", "middle", "1.5", "", "²"):
        with pytest.raises(InputError, match="expected left, right or a number from 1 on"):
            parse_channel(text)


def test_levels(voices, tmp_path):
    """Quiet floating-point speech is read; levels beyond full scale are named; overshoot of codecs is not."""
    voice = voices[0]
    for subtype, gain in (("FLOAT", 1e-3), ("FLOAT", 1e-5), ("PCM_24", 1e-3)):
        soundfile.write(tmp_path / "a.wav", gain * voice, RATE, subtype=subtype)
        np.testing.assert_allclose(read_audio(tmp_path / "a.wav"), gain * voice, atol=2e-7)
    soundfile.write(tmp_path / "a.wav", 1e-8 * voice, RATE, subtype="FLOAT")
    with pytest.raises(InputError, match="below -120 dB"):
        read_audio(tmp_path / "a.wav")
    for gain in (1.5, 50):
        soundfile.write(tmp_path / "a.wav", gain * voice / np.abs(voice).max(), RATE, subtype="FLOAT")
        (note,) = load_audio(tmp_path / "a.wav").notes()
        assert note.code == "full-scale"
        assert note.value == pytest.approx(gain)
    soundfile.write(tmp_path / "a.ogg", voice / np.abs(voice).max(), RATE)
    assert load_audio(tmp_path / "a.ogg").notes() == []


@pytest.mark.parametrize("samples", [1, 50, 300])
def test_files_shorter_than_a_block_of_the_measurement(voices, tmp_path, samples):
    part = voices[0][8000 : 8000 + samples] + np.float32(0.1)
    assert codes(tmp_path, part, part) == []
    assert len(read_audio(tmp_path / "a.wav")) == samples
