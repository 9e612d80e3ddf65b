"""Log-mel features against librosa, at exact frame times."""

import librosa
import numpy as np
import pytest

from a2g_jax.features.mel import MelConfig, active_level_db, log_mel

PLAIN = MelConfig(level_db=None)


def speech_like(seconds, seed=0, rate=16000):
    """Noise in bursts, with a hum."""
    random = np.random.default_rng(seed)
    time = np.arange(int(seconds * rate)) / rate
    bursts = np.maximum(np.sin(2 * np.pi * 1.3 * time), 0) ** 2
    return (0.2 * bursts * random.normal(size=len(time)) + 0.02 * np.sin(2 * np.pi * 150 * time)).astype(np.float32)


@pytest.mark.smoke
@pytest.mark.parametrize(("hop", "bands", "window"), [(512, 64, 2048), (640, 40, 1024)])
def test_equals_librosa_where_the_hop_is_whole(hop, bands, window):
    audio = speech_like(3)
    config = MelConfig(bands=bands, window=window, level_db=None)
    power = librosa.feature.melspectrogram(
        y=audio, sr=16000, n_fft=window, hop_length=hop, n_mels=bands, pad_mode="constant", center=True
    )
    expected = librosa.power_to_db(power, ref=1.0, amin=1e-10, top_db=60.0).T
    result = log_mel(audio, config, 16000 / hop, len(expected))
    assert result.dtype == np.float32
    np.testing.assert_allclose(result, expected, atol=1e-3)


def test_range_limits_the_floor():
    result = log_mel(speech_like(2), MelConfig(range_db=20.0, level_db=None), 30.0, 60)
    assert result.min() == pytest.approx(result.max() - 20.0, abs=1e-4)


def test_frames_do_not_drift():
    """Clicks on frames of the 166th second, where a fixed hop of 533 samples would be three frames late."""
    fps, rate = 30.0, 16000
    frames = [4950, 4963, 4975]
    audio = np.zeros(166 * rate, np.float32)
    for frame in frames:
        audio[round(frame / fps * rate)] = 1.0
    energy = log_mel(audio, PLAIN, fps, 166 * 30).sum(axis=1)
    for frame in frames:
        assert np.argmax(energy[frame - 6 : frame + 7]) == 6
        # Symmetric around the click, to the rounding of a frame's time to a sample.
        assert energy[frame - 1] == pytest.approx(energy[frame + 1], rel=0.01)


@pytest.mark.parametrize("frames", [0, 1, 29, 30, 31, 200])
def test_gives_the_requested_number_of_rows(frames):
    result = log_mel(speech_like(1), PLAIN, 30.0, frames)
    assert result.shape == (frames, 64)
    assert np.isfinite(result).all()


def test_beyond_the_end_is_silence():
    short, long = speech_like(1), np.pad(speech_like(1), (0, 16000))
    np.testing.assert_array_equal(log_mel(short, PLAIN, 30.0, 60), log_mel(long, PLAIN, 30.0, 60))


def test_a_frame_depends_on_its_window_only():
    audio = speech_like(2)
    changed = audio.copy()
    centre = round(30 / 30.0 * 16000)
    changed[: centre - 1024] = 0
    changed[centre + 1024 :] = 0
    wide = MelConfig(level_db=None, range_db=300.0)
    first, second = log_mel(audio, wide, 30.0, 60), log_mel(changed, wide, 30.0, 60)
    np.testing.assert_array_equal(first[30], second[30])
    assert np.abs(first[29] - second[29]).max() > 1e-3


def test_long_audio_is_the_same_on_both_sides_of_a_chunk_edge():
    fps = 100.0
    audio = speech_like(42)
    wide = MelConfig(level_db=None, range_db=300.0)
    whole = log_mel(audio, wide, fps, 4200)
    first = 4000
    part = log_mel(audio[int(first / fps * 16000) :], wide, fps, 200)
    # The first windows of the part reach back before it starts.
    np.testing.assert_allclose(part[10:], whole[first + 10 :], atol=1e-4)


class TestLevel:
    @pytest.mark.parametrize("gain", [0.01, 0.3, 4.0])
    def test_gain_does_not_matter(self, gain):
        audio = speech_like(2)
        config = MelConfig()
        np.testing.assert_allclose(
            log_mel(audio * np.float32(gain), config, 30.0, 60), log_mel(audio, config, 30.0, 60), atol=0.01
        )
        assert np.abs(log_mel(audio * np.float32(gain), PLAIN, 30.0, 60) - log_mel(audio, PLAIN, 30.0, 60)).max() > 5

    def test_of_a_sine_is_its_power(self):
        sine = 0.5 * np.sin(2 * np.pi * 440 * np.arange(16000) / 16000)
        assert active_level_db(sine.astype(np.float32), 16000) == pytest.approx(10 * np.log10(0.125), abs=0.1)

    def test_pauses_do_not_count(self):
        tone = 0.5 * np.sin(2 * np.pi * 440 * np.arange(16000) / 16000).astype(np.float32)
        pause = np.zeros(48000, np.float32)
        alone = active_level_db(tone, 16000)
        assert active_level_db(np.concatenate([tone, pause]), 16000) == pytest.approx(alone, abs=0.1)

    def test_is_brought_to_the_target(self):
        audio = speech_like(2)
        level = active_level_db(audio, 16000)
        loud = log_mel(audio, MelConfig(level_db=level + 6), 30.0, 60)
        np.testing.assert_allclose(loud, log_mel(audio, PLAIN, 30.0, 60) + 6, atol=0.01)

    @pytest.mark.parametrize("samples", [0, 10, 16000])
    def test_silence_gives_numbers(self, samples):
        audio = np.zeros(samples, np.float32)
        assert np.isfinite(active_level_db(audio, 16000))
        result = log_mel(audio, MelConfig(), 30.0, 30)
        np.testing.assert_array_equal(result, np.full((30, 64), -100.0, np.float32))


def test_real_speech_is_not_silence(shared):
    import soundfile

    audio, rate = soundfile.read(shared / "speech" / "jfk.wav", dtype="float32")
    result = log_mel(audio, MelConfig(), 30.0, round(len(audio) / rate * 30))
    assert result.shape == (330, 64)
    assert result.max() - result.min() == pytest.approx(60.0, abs=1e-3)
    assert 5 < result.std() < 30
