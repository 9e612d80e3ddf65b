"""The generated corpus's audio: what is rendered is what was planned, at every rate, and near real speech."""

import itertools

import numpy as np
import pytest
from voice_for_tests import RATE, active_db, energy_db, render, rendered_peaks, streams_of

from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.mel import log_mel as log_mel_frames
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.plan import plan_speech
from a2g_jax.talker.speakers import SPEAKERS, session_voice
from a2g_jax.talker.voice import SPEECH_DBFS, synthesise


@pytest.mark.parametrize("rate", [16000, 22050, 24000, 48000])
def test_audio_has_exactly_the_planned_length(rate):
    plan, audio = render("elif", seconds=4.321, rate=rate)
    assert audio.shape == (round(4.321 * rate),)
    assert audio.dtype == np.float32
    assert np.all(np.isfinite(audio))
    assert 0.05 < np.max(np.abs(audio)) < 1.0
    assert len(plan.phrases) >= 1


@pytest.mark.parametrize("rate", [22050, 24000, 44100, 48000])
def test_sample_rates_give_the_same_speech(rate):
    plan, reference = render("chiara", seconds=6.0, seed=2)
    other_plan, audio = render("chiara", seconds=6.0, seed=2, rate=rate)
    assert plan == other_plan
    size = round(6.0 * 6000)  # what lies below 3 kHz, where little is noise
    low = [np.fft.irfft(np.fft.rfft(signal)[: size // 2 + 1], size) for signal in (reference, audio)]
    assert np.corrcoef(low)[0, 1] > 0.97
    spectrum = np.square(np.abs(np.fft.rfft(audio)))
    hertz = np.fft.rfftfreq(len(audio), 1.0 / rate)
    bands = [10.0 * np.log10(spectrum[(hertz >= a) & (hertz < b)].mean()) for a, b in ((6000, 8000), (8000, 11000))]
    assert 2.0 < bands[0] - bands[1] < 15.0  # frication continues above 8 kHz, softer


def test_same_seed_same_audio_other_seed_other_audio():
    plan, audio = render(seconds=5.0, seed=7)
    again_plan, again = render.__wrapped__(seconds=5.0, seed=7)
    other_plan, other = render(seconds=5.0, seed=8)
    assert plan == again_plan
    assert np.array_equal(audio, again)
    assert plan != other_plan
    assert not np.array_equal(audio, other)


@pytest.mark.parametrize(
    ("speaker", "emotion"),
    list(zip(sorted(SPEAKERS), ("happiness", "sadness", "anger", "neutral", "fear", "disgust"), strict=True)),
)
def test_energy_peaks_where_the_plan_says_and_accents_are_heard(speaker, emotion):
    plan, audio = render(speaker, emotion, seconds=30.0, seed=11)
    found = rendered_peaks(plan, audio)
    claimed = np.array([s.peak for s in plan.syllables])
    accent = np.array([s.accent for s in plan.syllables])
    strong = accent > 0.5
    errors = np.abs(found[:, 0] - claimed)
    assert np.mean(errors[strong] < 0.03) > 0.95
    assert np.max(errors[strong]) < 0.05
    assert np.mean(errors < 0.03) > 0.85  # unaccented syllables, too, for the most part
    assert 5.0 < np.median(found[strong, 1]) - np.median(found[accent == 0.0, 1]) < 12.0
    # The peaks' levels alone separate accented from unaccented syllables.
    pairs = found[strong, 1][:, None] > found[accent == 0.0, 1][None, :]
    assert np.mean(pairs) > 0.94


def test_level_follows_speaker_and_emotion():
    for speaker, emotion in (("ada", "neutral"), ("bruno", "sadness"), ("felix", "anger")):
        plan, audio = render(speaker, emotion, seconds=15.0, seed=3)
        voice = session_voice(SPEAKERS[speaker], streams_of(speaker, emotion, 15.0, 3)[0])
        wanted = SPEECH_DBFS + voice.loudness_db + plan.strength * VOICE_EMOTIONS[emotion].loudness_db
        assert active_db(plan, audio) == pytest.approx(wanted, abs=0.7)


def test_emotions_are_as_loud_as_their_order_says():
    level = {
        name: np.mean([active_db(*render("david", name, seconds=5.0, seed=seed)) for seed in range(8)])
        for name in ("sadness", "neutral", "happiness", "anger")
    }
    assert level["sadness"] < level["neutral"] - 2.0
    assert level["neutral"] < level["happiness"] < level["anger"]


def test_pauses_are_quiet_but_not_digital_silence():
    plan, audio = render("david", seconds=30.0, seed=6)
    level, time = energy_db(audio)
    for before, after in itertools.pairwise(plan.phrases):
        inside = (time > before.end + 0.03) & (time < after.start - 0.03)
        assert np.max(level[inside]) < -35.0
        assert np.min(level[inside]) > -75.0


def test_energy_peaks_lie_at_the_planned_peaks_over_many_voices():
    errors = []
    for seed, (speaker, emotion) in enumerate(itertools.product(SPEAKERS, VOICE_EMOTIONS)):
        plan, audio = render(speaker, emotion, seconds=4.0, seed=seed)
        assert np.all(np.isfinite(audio))
        assert np.max(np.abs(audio)) < 1.0
        errors += list(np.abs(rendered_peaks(plan, audio)[:, 0] - [s.peak for s in plan.syllables]))
    assert np.median(errors) < 0.015
    assert np.percentile(errors, 90) < 0.03


def test_accents_are_predictable_from_log_mel_energy():
    features, accents = [], []
    for seed, speaker in enumerate((*SPEAKERS, *SPEAKERS)):
        plan, audio = render(speaker, seconds=12.0, seed=50 + seed)
        mel = log_mel_frames(audio, MelConfig(), 30.0, 360)
        mel = (mel - mel.mean(0)) / mel.std(0)
        at = np.rint([s.peak * 30.0 for s in plan.syllables]).astype(int)
        window = mel[np.clip(at[:, None] + np.arange(-4, 5), 0, 359)].reshape(len(at), 9, 16, 4).mean(-1)
        features.append(np.concatenate([window.reshape(len(at), -1), np.ones((len(at), 1))], 1))
        accents.append([s.accent for s in plan.syllables])
    known, truth = np.concatenate(features[:9]), np.concatenate(accents[:9])
    weights = np.linalg.solve(known.T @ known + 30.0 * np.eye(known.shape[1]), known.T @ truth)
    guess, truth = np.concatenate(features[9:]) @ weights, np.concatenate(accents[9:])
    assert np.corrcoef(guess, truth)[0, 1] > 0.7  # about 0 by chance


def test_rejects_telephone_rates_and_less():
    plan = plan_speech(3.0, "ada", "neutral", np.random.default_rng(0))
    with pytest.raises(InputError, match="8000"):
        synthesise(plan, np.random.default_rng(0), 4000)


def log_mel(audio):
    """Log-mel (dB) of the active frames, after normalising the active level: 64 bands, 2048-point windows, 30 fps."""
    level, _ = energy_db(audio)
    audio = audio * 10.0 ** (-(20.0 + np.percentile(level, 90)) / 20.0)
    frames = np.lib.stride_tricks.sliding_window_view(audio, 2048)[::533]
    power = np.abs(np.fft.rfft(frames * np.hanning(2048))) ** 2
    edges = 700.0 * (np.exp(np.linspace(0.0, np.log(1.0 + 8000.0 / 700.0), 66)) - 1.0)
    frequency = np.fft.rfftfreq(2048, 1.0 / RATE)
    triangles = [np.interp(frequency, edges[band : band + 3], (0.0, 1.0, 0.0)) for band in range(64)]
    decibels = 10.0 * np.log10(np.array(triangles) @ power.T + 1e-10)
    loudness = decibels.max(axis=0)
    return decibels[:, loudness > np.percentile(loudness, 95) - 25.0]


def test_log_mel_statistics_are_near_real_speech(shared):
    import soundfile

    real = []
    for name in ("speech/jfk.wav", "beat/2_scott_0_1_1.wav", "zeggs/067_Speech_2_x_1_0.wav"):
        audio, rate = soundfile.read(shared / name, dtype="float32")
        assert rate == RATE
        real.append(log_mel(audio[: 40 * RATE]))
    ours = [log_mel(render(speaker, seconds=20.0, seed=1)[1]) for speaker in SPEAKERS]
    mean_gap = np.mean([m.mean(1) for m in ours], axis=0) - np.mean([m.mean(1) for m in real], axis=0)
    std_gap = np.mean([m.std(1) for m in ours], axis=0) - np.mean([m.std(1) for m in real], axis=0)
    assert np.mean(np.abs(mean_gap)) < 6.0
    assert np.mean(np.abs(std_gap)) < 5.0
