"""Spectrograms of windows, and stacked spectra, beside librosa's."""

import librosa
import numpy as np
import pytest

from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.features.mel_windows import MelWindowConfig, mel_windows


def noise(seconds: float, seed: int = 0) -> np.ndarray:
    """Audio with something in every band."""
    return np.random.default_rng(seed).normal(0.0, 0.1, round(seconds * 16000)).astype(np.float32)


def test_emotion_gestures_shape_and_librosas_values():
    audio = np.stack([noise(4.0, seed) for seed in (0, 1)])
    result = mel_windows(audio)
    assert result.shape == (2, 128, 124)
    for ours, samples in zip(result, audio, strict=True):
        mel = librosa.feature.melspectrogram(y=samples, sr=16000, n_fft=1024, hop_length=512, n_mels=128, center=False)
        np.testing.assert_allclose(ours, librosa.power_to_db(mel, top_db=80.0), atol=1e-3)


def test_quiet_bands_are_raised_to_the_floor_of_their_window():
    tone = np.sin(2 * np.pi * 440 * np.arange(64000) / 16000).astype(np.float32)
    result = mel_windows(tone, MelWindowConfig(range_db=40.0))
    assert result.max() - result.min() == pytest.approx(40.0, abs=1e-3)
    assert np.isfinite(mel_windows(np.zeros(64000, np.float32))).all()


def test_windows_of_another_length_are_refused():
    with pytest.raises(ValueError, match="expected windows of 64000 samples; got 63999"):
        mel_windows(np.zeros(63999, np.float32))


def test_four_spectra_a_frame_are_those_of_four_times_the_rate():
    audio = noise(2.0)
    stacked = MelConfig(window=400, low_hz=125.0, high_hz=7500.0, stack=4, level_db=None)
    plain = MelConfig(window=400, low_hz=125.0, high_hz=7500.0, level_db=None)
    rows = log_mel(audio, stacked, 15.0, 30)
    assert rows.shape == (30, 256) == (30, stacked.width)
    np.testing.assert_array_equal(rows.reshape(120, 64), log_mel(audio, plain, 60.0, 120))


def test_bands_lie_between_the_limits():
    low = np.sin(2 * np.pi * 60 * np.arange(16000) / 16000).astype(np.float32)
    limited = log_mel(low, MelConfig(low_hz=1000.0, level_db=None, range_db=200.0), 30.0, 30)
    whole = log_mel(low, MelConfig(level_db=None, range_db=200.0), 30.0, 30)
    assert whole[10].max() > limited[10].max() + 30
