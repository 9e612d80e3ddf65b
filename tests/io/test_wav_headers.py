"""WAV headers that do not fit their samples: all samples are read, or the bytes are named; never "record it again"."""

import struct

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.io.audio import audio_info, load_audio, read_audio
from tests.io.wav_for_tests import tone, wav_bytes

SAMPLES = (tone(1.5) * 32767).astype("<i2")
LIST = b"LIST" + struct.pack("<I", 4) + b"INFO"

#: Headers, and whether a remark says that they were not finished.
UNFINISHED = {
    "size 0": (wav_bytes(SAMPLES, size=0), True),
    "size 0 after another chunk": (wav_bytes(SAMPLES, size=0, before=LIST), True),
    "both sizes 0": (wav_bytes(SAMPLES, size=0)[:4] + bytes(4) + wav_bytes(SAMPLES, size=0)[8:], True),
    "RIFF size 0": (wav_bytes(SAMPLES)[:4] + bytes(4) + wav_bytes(SAMPLES)[8:], False),
    "stopped after the first flush": (wav_bytes(SAMPLES, size=8000), True),
    "all ones": (wav_bytes(SAMPLES, size=0xFFFFFFFF), False),
    "all ones less the header": (wav_bytes(SAMPLES, size=0xFFFFFFFF - 36), False),
    "2 GiB less one": (wav_bytes(SAMPLES, size=0x7FFFFFFF), False),
    "2 GiB": (wav_bytes(SAMPLES, size=0x80000000), False),
    "RF64": (wav_bytes(SAMPLES, riff=b"RF64"), False),
    "RF64 without its size": (wav_bytes(SAMPLES, riff=b"RF64", long_size=0), True),
    "RF64 of ones": (wav_bytes(SAMPLES, riff=b"RF64", long_size=2**64 - 1), False),
    "BW64": (wav_bytes(SAMPLES, riff=b"BW64"), False),
    "BW64 without its size": (wav_bytes(SAMPLES, riff=b"BW64", long_size=0), True),
    "a list behind": (wav_bytes(SAMPLES) + LIST, False),
    "an ID3 tag behind": (wav_bytes(SAMPLES) + b"ID3" + bytes(30000), False),
    "zeros behind": (wav_bytes(SAMPLES) + bytes(30000), False),
}


@pytest.mark.parametrize("name", UNFINISHED)
def test_all_samples_are_read(tmp_path, name):
    data, remarked = UNFINISHED[name]
    path = tmp_path / "a.wav"
    path.write_bytes(data)
    sound = load_audio(path)
    np.testing.assert_array_equal(np.rint(sound.samples * 32768), SAMPLES)
    assert audio_info(path).frames == len(SAMPLES)
    notes = [str(note) for note in sound.notes()]
    assert bool(notes) == remarked
    assert not remarked or f"all {2 * len(SAMPLES)} bytes behind it are read" in notes[0]


@pytest.mark.parametrize(("bits", "form", "kind"), [(32, 3, "<f4"), (32, 1, "<i4"), (8, 7, "u1")])
def test_other_encodings_are_repaired_too(tmp_path, bits, form, kind):
    """Floating-point, 32 bits, mu-law; a last sample that is cut short is left out."""
    values = (
        tone(1.0).astype("<f4") if form == 3 else (np.arange(16000) % 251 * (2**20 if bits == 32 else 1)).astype(kind)
    )
    whole, broken = tmp_path / "whole.wav", tmp_path / "broken.wav"
    whole.write_bytes(wav_bytes(values, bits=bits, form=form))
    broken.write_bytes(wav_bytes(values, bits=bits, form=form, size=0) + b"\1" * (bits // 8 - 1))
    np.testing.assert_array_equal(read_audio(broken), read_audio(whole))


def test_two_channels_are_repaired_too(tmp_path):
    both = np.stack([SAMPLES, SAMPLES // 2], axis=1)
    (tmp_path / "a.wav").write_bytes(wav_bytes(both, channels=2, size=0))
    np.testing.assert_array_equal(np.rint(read_audio(tmp_path / "a.wav", channel=2) * 32768), SAMPLES // 2)


@pytest.mark.parametrize(
    ("data", "named"),
    [
        (wav_bytes(SAMPLES)[:-20000], "the header says 48000 bytes of samples and the file has 28000 (0.88 s)"),
        (wav_bytes(SAMPLES, riff=b"BW64")[:-20000], "the header says 48000 bytes of samples and the file has 28000"),
        (wav_bytes(SAMPLES)[:40], "its header ends after 40 bytes"),
        (wav_bytes(b"", size=0), "contains no samples"),
        (wav_bytes(b"", size=0) + LIST, "contains no samples"),
        (bytes(44) + SAMPLES.tobytes(), "its header was never written (zeros); samples may follow in the other 48000"),
        (b"RIFF\0\0\0\0WAVEdata" + struct.pack("<I", 48000) + SAMPLES.tobytes(), "has no sample format"),
    ],
)
def test_what_cannot_be_read_names_the_bytes(tmp_path, data, named):
    path = tmp_path / "a take.wav"
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_audio(path)
    message = str(caught.value)
    assert named in message
    assert "record it again" not in message.lower()
    assert "\n" not in message
    if "ffmpeg" in message:
        assert f"'{path}'" in message


@pytest.mark.parametrize("size", [3, 5, 17])
def test_a_chunk_of_odd_length_without_padding(tmp_path, size):
    """Many writers of tags forget the byte; the format of the samples or the samples themselves follow at once."""
    chunk = b"LIST" + struct.pack("<I", size) + b"INFOabcdefghijklmn"[:size]
    sound = wav_bytes(SAMPLES)
    (tmp_path / "before.wav").write_bytes(sound[:12] + chunk + sound[12:])
    (tmp_path / "between.wav").write_bytes(wav_bytes(SAMPLES, before=chunk))
    (tmp_path / "padded.wav").write_bytes(wav_bytes(SAMPLES, before=chunk + b"\0"))
    (tmp_path / "plain.wav").write_bytes(sound)
    expected = read_audio(tmp_path / "plain.wav")
    for name in ("before", "between", "padded"):
        np.testing.assert_array_equal(read_audio(tmp_path / f"{name}.wav"), expected)


def test_samples_in_two_parts_and_bytes_before_the_header_are_named(tmp_path):
    path = tmp_path / "a.wav"
    half = SAMPLES[:12000].tobytes()
    path.write_bytes(wav_bytes(SAMPLES[:12000]) + b"data" + struct.pack("<I", len(half)) + half)
    with pytest.raises(InputError, match="has its samples in several parts"):
        read_audio(path)
    path.write_bytes(bytes(64) + wav_bytes(SAMPLES))
    with pytest.raises(InputError, match=r"64 other bytes come before its header; remove them: tail -c \+65"):
        read_audio(path)
