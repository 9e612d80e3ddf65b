"""A constant offset changes no features; recordings without one keep their bits."""

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.features.offset import sample_offset, without_offset
from a2g_jax.features.samples import mono_samples
from a2g_jax.talker.demo_speech import demo_speech
from a2g_jax.talker.recordings import talk

RATE = 16000


@pytest.fixture(scope="module")
def speeches():
    """The package's English speech, and two invented ones, the second in a room."""
    return [demo_speech().audio, talk(8.0, 3).audio, talk(8.0, 4, speaker="david", room=True).audio]


@pytest.mark.parametrize("offset", [0.3, 0.02, -0.1, 0.003])
@pytest.mark.parametrize("gain", [1.0, 0.01])
def test_features_do_not_see_an_offset(speeches, offset, gain):
    for speech in speeches:
        moved = (gain * (speech + offset)).astype(np.float32)
        assert sample_offset(moved, RATE) == pytest.approx(gain * offset, abs=gain * 1e-3)
        plain, other = (log_mel(audio, MelConfig(), 30.0, 200) for audio in (speech, moved))
        # With the offset in them, the lowest bands are tens of decibels higher.
        assert np.abs(other - plain).mean() < 0.02
        assert np.abs(other - plain)[:, 4:].max() < 0.5


def test_recordings_without_an_offset_keep_their_bits(speeches):
    for speech in speeches:
        assert without_offset(speech, RATE) is speech
    noise = 0.1 * np.random.default_rng(0).normal(size=4 * RATE).astype(np.float32)
    assert without_offset(noise, RATE) is noise
    for hertz in (50, 60, 100):  # hum
        hum = speeches[1] + 0.02 * np.sin(2 * np.pi * hertz * np.arange(len(speeches[1])) / RATE).astype(np.float32)
        assert without_offset(hum, RATE) is hum


def test_digital_silence_stays_silent(speeches):
    moved = np.concatenate([np.zeros(2 * RATE, np.float32), speeches[1] + np.float32(0.05)])
    centred = without_offset(moved, RATE)
    assert not centred[: 2 * RATE].any()
    np.testing.assert_allclose(centred[2 * RATE :], speeches[1], atol=1e-3)


def test_what_is_too_short_or_silent_has_none():
    for audio in (np.zeros(0), np.ones(100), np.zeros(RATE), np.full(3000, 0.1)):
        assert sample_offset(audio.astype(np.float32), RATE) == 0.0
    assert sample_offset(np.full(RATE, 0.1, np.float32), RATE) == pytest.approx(0.1)


class TestArrays:
    def test_types(self):
        wave = np.sin(np.arange(1000) / 9)
        expected = wave.astype(np.float32)
        assert mono_samples(expected) is expected
        for kind, atol in ((np.int16, 1e-4), (np.int32, 1e-6), (np.uint8, 2e-2)):
            half = 2.0 ** (8 * np.dtype(kind).itemsize - 1) - 1
            scaled = np.rint(wave * half + (half + 1 if kind is np.uint8 else 0)).astype(kind)
            np.testing.assert_allclose(mono_samples(scaled), expected, atol=atol)
        np.testing.assert_array_equal(mono_samples(wave[:, None]), expected)
        np.testing.assert_array_equal(mono_samples(wave[None]), expected)
        np.testing.assert_array_equal(mono_samples(list(wave)), expected)

    @pytest.mark.parametrize(
        ("audio", "named"),
        [
            (np.zeros((48000, 2)), r"shape \(48000, 2\), 2 channels, .* audio\.mean\(axis=1\), .* audio\[:, 0\]"),
            (np.zeros((2, 48000)), r"shape \(2, 48000\), 2 channels, .* audio\.mean\(axis=0\), .* audio\[0\]"),
            (np.zeros((2, 3, 4)), "expected numbers of shape"),
            (np.zeros(4, complex), "expected numbers of shape"),
            (np.array(["a"]), "expected numbers of shape"),
            (np.array([0.0, np.nan]), "sample 1 is NaN"),
        ],
    )
    def test_one_clear_error(self, audio, named):
        with pytest.raises(InputError, match=named):
            log_mel(audio, MelConfig(), 30.0, 10)
