import struct

import numpy as np
import pytest
import soundfile

from a2g_jax.errors import InputError
from a2g_jax.io.audio import audio_info, read_audio, write_audio


def tone(seconds=0.5, rate=16000, level=0.5, hertz=440.0):
    return (level * np.sin(2 * np.pi * hertz * np.arange(round(seconds * rate)) / rate)).astype(np.float32)


def wav_bytes(samples, rate=16000, bits=16, data_size=None, extra=b"", form=1):
    """A WAV file assembled by hand."""
    body = samples.tobytes() if isinstance(samples, np.ndarray) else samples
    size = len(body) if data_size is None else data_size
    fmt = struct.pack("<HHIIHH", form, 1, rate, rate * bits // 8, bits // 8, bits)
    chunks = b"fmt " + struct.pack("<I", 16) + fmt + extra + b"data" + struct.pack("<I", size) + body
    return b"RIFF" + struct.pack("<I", (4 + len(chunks)) & 0xFFFFFFFF) + b"WAVE" + chunks


@pytest.mark.parametrize(
    ("name", "subtype", "tolerance"),
    [
        ("a.wav", "PCM_U8", 1e-2),
        ("a.wav", "PCM_16", 5e-5),
        ("a.wav", "PCM_24", 1e-6),
        ("a.wav", "PCM_32", 1e-6),
        ("a.wav", "FLOAT", 1e-7),
        ("a.wav", "DOUBLE", 1e-7),
        ("a.wav", "ULAW", 3e-2),
        ("a.flac", "PCM_16", 5e-5),
        ("a.flac", "PCM_24", 1e-6),
        ("a.aiff", "PCM_16", 5e-5),
        ("a.ogg", "VORBIS", 5e-2),
        ("a.rf64", "PCM_16", 5e-5),
    ],
)
def test_formats(tmp_path, name, subtype, tolerance):
    path, samples = tmp_path / name, tone()
    write_audio(path, samples, 16000, subtype=subtype)
    result = read_audio(path)
    assert result.dtype == np.float32
    assert result.shape == samples.shape
    np.testing.assert_allclose(result, samples, atol=tolerance)
    info = audio_info(path)
    assert (info.sample_rate, info.channels, info.frames, info.subtype) == (16000, 1, 8000, subtype)
    assert info.seconds == 0.5
    assert list(tmp_path.iterdir()) == [path]


def test_mp3(tmp_path):
    if "MP3" not in soundfile.available_formats():
        pytest.skip("this libsndfile reads no MP3")
    path, samples = tmp_path / "a.mp3", tone()
    write_audio(path, samples, 16000, subtype=None)
    result = read_audio(path)
    assert abs(len(result) - len(samples)) < 2400
    assert np.abs(np.fft.rfft(result[:8000])).argmax() == pytest.approx(220, abs=2)


def test_channels_are_averaged(tmp_path):
    left, right = tone(hertz=200), tone(hertz=300, level=0.1)
    soundfile.write(tmp_path / "a.wav", np.stack([left, right], axis=1), 16000, subtype="FLOAT")
    np.testing.assert_allclose(read_audio(tmp_path / "a.wav"), (left + right) / 2, atol=1e-6)
    assert audio_info(tmp_path / "a.wav").channels == 2


@pytest.mark.parametrize("rate", [8000, 11025, 22050, 24000, 44100, 48000, 96000, 192000])
def test_rates(tmp_path, rate):
    write_audio(tmp_path / "a.wav", tone(1.001, rate), rate, subtype="FLOAT")
    result, expected = read_audio(tmp_path / "a.wav"), tone(1.001)
    assert len(result) == round(round(1.001 * rate) * 16000 / rate)
    inside = slice(400, -400)  # the filter rings at the ends
    np.testing.assert_allclose(result[inside], expected[: len(result)][inside], atol=2e-3)


def test_resampling_keeps_the_time_of_events(tmp_path):
    samples = np.zeros(48000, np.float32)
    samples[24000] = 1
    write_audio(tmp_path / "a.wav", samples, 48000)
    assert np.abs(read_audio(tmp_path / "a.wav")).argmax() == 8000


def test_a_single_sample(tmp_path):
    write_audio(tmp_path / "a.wav", np.array([0.5], np.float32), 48000)
    assert read_audio(tmp_path / "a.wav").shape == (1,)


def test_lengths_that_a_stream_could_not_know(tmp_path):
    path, samples = tmp_path / "a.wav", (tone() * 32767).astype("<i2")
    path.write_bytes(wav_bytes(samples, data_size=0xFFFFFFFF))
    assert len(read_audio(path)) == 8000


def test_other_chunks_come_before_the_samples(tmp_path):
    path, samples = tmp_path / "a.wav", (tone() * 32767).astype("<i2")
    path.write_bytes(wav_bytes(samples, extra=b"LIST" + struct.pack("<I", 5) + b"INFOx\0"))
    assert len(read_audio(path)) == 8000
    path.write_bytes(path.read_bytes()[:-1000])
    with pytest.raises(InputError, match="cut short"):
        read_audio(path)


SAMPLES = (tone() * 32767).astype("<i2")
FLOATS = tone().astype("<f4")


def with_value(value):
    samples = FLOATS.copy()
    samples[4000] = value
    return wav_bytes(samples, bits=32, form=3)


def flac_bytes(tmp_path):
    noise = np.random.default_rng(0).uniform(-0.5, 0.5, 80000).astype(np.float32)
    write_audio(tmp_path / "whole.flac", noise, 16000)
    data = (tmp_path / "whole.flac").read_bytes()
    (tmp_path / "whole.flac").unlink()
    return data


BROKEN = {
    "empty": (b"", "is empty"),
    "no samples": (wav_bytes(b""), "contains no samples"),
    "text": (b"this is a transcript\n" * 10, "is text, not audio"),
    "binary": (bytes(range(256)) * 4, "is not audio that can be read"),
    "only RIFF": (b"RIFF\x24", "cut short inside its header"),
    "header only": (wav_bytes(SAMPLES)[:30], "no 'data' chunk"),
    "cut": (
        wav_bytes(SAMPLES)[:-2000],
        "the header says 16000 bytes of samples and the file has 14000",
    ),
    "lying header": (wav_bytes(SAMPLES, data_size=2_000_000_000), "is cut short"),
    "damaged format": (wav_bytes(SAMPLES, form=0x7777), "is a damaged audio file"),
    "NaN": (with_value(np.nan), "NaN or infinity at 0.250 s"),
    "infinity": (with_value(-np.inf), "NaN or infinity at 0.250 s"),
    "integers as floats": (wav_bytes(FLOATS * 32768, bits=32, form=3), "scale them to -1 to 1"),
    "zeros": (wav_bytes(np.zeros(8000, "<i2")), "is silent"),
    "nearly zeros": (wav_bytes(np.full(8000, 10, "<i2")), "is silent"),
    "low rate": (wav_bytes(SAMPLES, rate=10), "sample rate of 10 Hz"),
    "AVI": (b"RIFF\0\0\0\0AVI " + bytes(100), "damaged audio"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files(tmp_path, name):
    data, message = BROKEN[name]
    path = tmp_path / "a.wav"
    path.write_bytes(data)
    with pytest.raises(InputError, match=message) as caught:
        read_audio(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_broken_flac(tmp_path):
    data = flac_bytes(tmp_path)
    path = tmp_path / "a.flac"
    for part in (data[: len(data) // 2], data[:60], data[:20000] + bytes(1000) + data[21000:]):
        path.write_bytes(part)
        with pytest.raises(InputError):
            read_audio(path)


def test_paths_that_are_no_files(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_audio(tmp_path / "none.wav")
    with pytest.raises(InputError, match="is a folder"):
        read_audio(tmp_path)
    (tmp_path / "a.raw").write_bytes(b"1234")
    with pytest.raises(InputError, match="raw samples have no header"):
        read_audio(tmp_path / "a.raw")
    with pytest.raises(InputError, match="raw samples have no header"):
        audio_info(tmp_path / "a.raw")


def test_too_long(tmp_path):
    write_audio(tmp_path / "a.wav", tone(2.0), 16000)
    assert len(read_audio(tmp_path / "a.wav", max_seconds=2.0)) == 32000
    with pytest.raises(InputError, match="is 2 s long, and the limit is 2 s"):
        read_audio(tmp_path / "a.wav", max_seconds=1.9)


def test_channels_that_cancel_out(tmp_path):
    soundfile.write(tmp_path / "a.wav", np.stack([tone(), -tone()], axis=1), 16000, subtype="FLOAT")
    with pytest.raises(InputError, match="channels cancel out"):
        read_audio(tmp_path / "a.wav")


@pytest.mark.parametrize(
    ("name", "samples", "subtype", "message"),
    [
        ("a.wav", [], "PCM_16", "no samples"),
        ("a.wav", [0.0, np.nan], "PCM_16", "NaN or infinity at 1.000 s"),
        ("a.txt", [0.5], "PCM_16", "is not an audio format"),
        ("a", [0.5], "PCM_16", "is not an audio format"),
        ("a.raw", [0.5], "PCM_16", "is not an audio format"),
        ("a.ogg", [0.5], "PCM_16", "has no encoding PCM_16; it has VORBIS"),
        ("a.flac", [0.5], "PCM_16", "cannot be written"),
    ],
)
def test_writing_refuses(tmp_path, name, samples, subtype, message):
    rate = 2_000_000_000 if name == "a.flac" else 1
    with pytest.raises(InputError, match=message):
        write_audio(tmp_path / name, np.array(samples, np.float32), rate, subtype=subtype)
    assert list(tmp_path.iterdir()) == []


def test_loud_samples_are_clipped_and_not_wrapped(tmp_path):
    write_audio(tmp_path / "a.wav", np.array([2.0, -2.0, 1.0], np.float64), 16000)
    np.testing.assert_allclose(read_audio(tmp_path / "a.wav"), [1, -1, 1], atol=1e-4)


def test_same_samples_same_bytes(tmp_path):
    for name in ("a.wav", "b.wav"):
        write_audio(tmp_path / name, tone(), 16000)
    assert (tmp_path / "a.wav").read_bytes() == (tmp_path / "b.wav").read_bytes()


@pytest.mark.parametrize(
    ("take", "samples"),
    [("beat/2_scott_0_1_1.wav", 1_025_558), ("zeggs/067_Speech_2_x_1_0.wav", 1_101_333), ("speech/jfk.wav", 176_000)],
)
def test_real_takes(shared, take, samples):
    audio = read_audio(shared / take)
    assert audio.shape == (samples,)
    assert 0.1 < np.abs(audio).max() <= 1
