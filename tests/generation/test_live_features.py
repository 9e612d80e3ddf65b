"""Causal features: resampling, level, offset and floor of speech that arrives in pieces."""

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig, active_level_db, log_mel
from a2g_jax.generation.live.features import LiveFeatures
from a2g_jax.generation.live.loudness import Loudness
from a2g_jax.generation.live.rates import Groups
from a2g_jax.io.audio import resampled
from a2g_jax.talker.recordings import talk

RATES = (8000, 11025, 16000, 22050, 44100, 47999, 48000, 96000)


def tone(hertz, rate, seconds=1.0):
    return np.sin(2 * np.pi * hertz * np.arange(round(seconds * rate)) / rate).astype(np.float32)


@pytest.mark.parametrize("rate", RATES)
def test_a_tone_keeps_its_time_and_level(rate):
    out = np.concatenate(Groups(rate, 16000, 160).push(tone(1000, rate)))
    middle = slice(500, 15000)
    np.testing.assert_allclose(out[middle], tone(1000, 16000)[: len(out)][middle], atol=2e-3)


@pytest.mark.parametrize("rate", [44100, 48000, 96000])
def test_nothing_is_folded_back(rate):
    out = np.concatenate(Groups(rate, 16000, 160).push(tone(9500, rate)))
    assert np.abs(out[500:15000]).max() < 2e-3


@pytest.mark.parametrize("rate", RATES)
def test_resampling_does_not_depend_on_the_pieces(rate):
    rng = np.random.default_rng(0)
    samples = rng.standard_normal(rate // 2).astype(np.float32)
    whole = np.concatenate(Groups(rate, 16000, 160).push(samples))
    one = Groups(rate, 16000, 160)
    pieces = np.split(samples, np.sort(rng.integers(0, len(samples), 30)))
    np.testing.assert_array_equal(np.concatenate([group for piece in pieces for group in one.push(piece)]), whole)
    assert len(one._kept) < one.group


@pytest.mark.parametrize("rate", RATES)
def test_outputs_arrive_within_the_stated_latency(rate):
    one, made, step = Groups(rate, 16000, 160), 0, rate // 250
    for number in range(1, 1500):
        made += 160 * len(one.push(np.zeros(step, np.float32)))
        assert made / 16000 >= number * step / rate - one.latency
    assert made > 0


@pytest.mark.parametrize("rate", [0, -1, 7999, 192001, True, 16000.5])
def test_rates_of_no_microphone(rate):
    with pytest.raises(InputError, match="sample_rate"):
        LiveFeatures(MelConfig(), 30.0, rate)


@pytest.mark.parametrize("gain_db", [-30.0, 0.0, 6.0])
def test_the_level_is_that_of_the_recording_soon(gain_db):
    audio = talk(20.0, 3).audio * 10 ** (gain_db / 20)
    loudness = Loudness(16000)
    errors = []
    for start in range(0, len(audio) - loudness.size, loudness.size):
        loudness.add(audio[start : start + loudness.size])
        errors.append(loudness.level_db - active_level_db(audio, 16000))
    assert np.abs(errors[round(10 / 0.025) :]).max() < 4.0


def test_pauses_and_noise_do_not_change_the_level():
    rng = np.random.default_rng(0)
    audio = talk(10.0, 3).audio
    loudness = Loudness(16000)
    for block in audio.reshape(-1, loudness.size):
        loudness.add(block)
    before = loudness.level_db
    for amplitude in (0.0, 1e-3, 0.0, 2e-3):
        for _ in range(round(60 / 0.025)):
            loudness.add((amplitude * rng.standard_normal(loudness.size)).astype(np.float32))
        assert loudness.level_db == pytest.approx(before, abs=2.0)


def test_a_stream_that_begins_with_noise_does_not_amplify_it():
    rng = np.random.default_rng(0)
    loudness = Loudness(16000)
    for _ in range(round(60 / 0.025)):
        loudness.add((1e-3 * rng.standard_normal(loudness.size)).astype(np.float32))
    assert loudness.gain_db(-23.0) < 6.0


@pytest.mark.parametrize(("config", "fps"), [(MelConfig(), 30.0), (MelConfig(bands=32, window=1024, stack=2), 15.0)])
def test_features_are_nearly_those_of_the_recording(config, fps):
    audio = talk(20.0, 5).audio
    frames = round(20 * fps)
    whole = log_mel(audio, config, fps, frames)
    live = np.array(LiveFeatures(config, fps, 16000).push(np.pad(audio, (0, 8000))))[:frames]
    assert live.shape == whole.shape
    # Speech, not the floor, after the first seconds.
    loud = (whole > -10) & (np.arange(frames)[:, None] > 5 * fps)
    assert np.abs(live - whole)[loud].max() < 6.0
    assert np.median(np.abs(live - whole)[loud]) < 2.0


def test_other_rates_have_the_same_features():
    audio = talk(5.0, 5).audio
    config = MelConfig(bands=16)
    plain = np.array(LiveFeatures(config, 30.0, 16000).push(audio))
    other = np.array(LiveFeatures(config, 30.0, 44100).push(resampled(audio, 16000, 44100)))
    count = min(len(plain), len(other))
    assert np.median(np.abs(plain[:count] - other[:count])) < 0.1


def test_a_constant_offset_has_no_effect():
    audio = talk(5.0, 5).audio
    config = MelConfig(bands=16)
    plain = np.array(LiveFeatures(config, 30.0, 16000).push(audio))
    moved = np.array(LiveFeatures(config, 30.0, 16000).push(audio + np.float32(0.2)))
    np.testing.assert_allclose(moved, plain, atol=0.5)


def test_a_long_shout_does_not_raise_the_floor_for_ever():
    config = MelConfig(bands=16)
    features = LiveFeatures(config, 30.0, 16000)
    features.push(np.random.default_rng(0).uniform(-1, 1, 16000).astype(np.float32))
    after = features.push(np.zeros(16000 * 120, np.float32))
    assert after[-1].max() < after[20].max() - 3.0 or after[20].max() <= features.quiet.max() + 1.0
    assert after[-1].max() == pytest.approx(float(features.quiet.max()), abs=1.0)


def test_features_after_ten_hours_are_those_of_the_first_second():
    """Counters are whole numbers, and the time of a spectrum is exact: nothing drifts."""
    config, audio = MelConfig(bands=16), talk(2.0, 5).audio
    fresh, late = LiveFeatures(config, 30.0, 16000), LiveFeatures(config, 30.0, 16000)
    late._made += 36000 * 30
    late._first += 36000 * 16000
    late._metered += 36000 * 16000
    np.testing.assert_array_equal(np.array(late.push(audio)), np.array(fresh.push(audio)))
