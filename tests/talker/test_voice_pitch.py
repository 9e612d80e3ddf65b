"""The generated corpus's melody: the Fujisaki model, speakers, accents, emotions and the ends of phrases."""

import numpy as np
import pytest
from voice_for_tests import measured_f0, render, streams_of

from a2g_jax.talker.articulation import TRACK_RATE
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.plan import plan_speech
from a2g_jax.talker.prosody import accent_response, creak_contour, phrase_response, pitch_contour
from a2g_jax.talker.speakers import SPEAKERS, session_voice


def test_fujisaki_responses_have_their_known_maxima():
    time = np.linspace(-1.0, 3.0, 4001)
    phrase = phrase_response(time)
    assert time[np.argmax(phrase)] == pytest.approx(1.0 / 3.0, abs=2e-3)  # at 1 / alpha
    assert phrase.max() == pytest.approx(3.0 / np.e, rel=1e-4)  # alpha / e
    assert np.all(phrase[time < 0.0] == 0.0)
    assert accent_response(time).max() == pytest.approx(0.9)


def test_speakers_differ_in_pitch_and_its_median_is_theirs():
    medians = {}
    for seed, (name, style) in enumerate(SPEAKERS.items()):
        plan, audio = render(name, seconds=20.0, seed=seed)
        medians[name] = float(np.median(measured_f0(plan, audio)))
        # Syllable peaks carry the accents, so they lie somewhat above the median of all voiced frames.
        assert 0.93 < medians[name] / style.median_f0_hz < 1.25
    female, male = ("ada", "chiara", "elif"), ("bruno", "david", "felix")
    assert min(medians[name] for name in female) > 1.1 * max(medians[name] for name in male)
    assert np.all(np.diff(sorted(medians.values())) > 5.0)


def test_accents_raise_the_pitch():
    plan, audio = render("felix", seconds=30.0, seed=5)
    f0 = measured_f0(plan, audio)
    accent = np.array([s.accent for s in plan.syllables])
    assert np.median(f0[accent > 0.5]) > 1.1 * np.median(f0[accent == 0.0])


def test_emotions_move_the_voice_as_documented():
    measured = {}
    for name, emotion in VOICE_EMOTIONS.items():
        plan = plan_speech(40.0, "ada", name, np.random.default_rng(4))
        times = np.arange(0.0, 40.0, 0.01)
        log_f0 = np.log2(pitch_contour(plan, SPEAKERS["ada"], emotion, times, np.random.default_rng(4)))
        spoken = np.any([(times >= p.start) & (times < p.end) for p in plan.phrases], axis=0)
        phonation = sum(p.end - p.start for p in plan.phrases)
        low, middle, high = np.percentile(log_f0[spoken], (10, 50, 90))
        measured[name] = {"level": middle, "range": high - low, "rate": len(plan.syllables) / phonation}
    neutral = measured["neutral"]
    for name, emotion in VOICE_EMOTIONS.items():
        for key, direction in (
            ("level", emotion.f0_shift_semitones / 12.0),
            ("range", np.log(emotion.f0_range_factor)),
            ("rate", np.log(emotion.rate_factor)),
        ):
            if abs(direction) > 0.1:
                assert np.sign(measured[name][key] - neutral[key]) == np.sign(direction), (name, key)


def test_rendered_pitch_follows_the_contour():
    for speaker, seed in (("felix", 5), ("ada", 6), ("bruno", 7)):
        plan, audio = render(speaker, seconds=15.0, seed=seed)
        streams = streams_of(speaker, "neutral", 15.0, seed)
        times = np.arange(15 * int(TRACK_RATE) + 1) / TRACK_RATE
        voice, mood = session_voice(SPEAKERS[speaker], streams[0]), VOICE_EMOTIONS["neutral"]
        contour = pitch_contour(plan, voice, mood, times, streams[4])
        contour *= 0.55 ** creak_contour(plan, times, streams[3])
        wanted = np.interp([s.peak for s in plan.syllables], times, contour)
        error = np.abs(12.0 * np.log2(measured_f0(plan, audio) / wanted))
        assert np.median(error) < 0.3
        assert np.mean(error < 1.0) > 0.85


def test_phrases_end_low_or_high_as_planned():
    last = {"fall": [], "continuation": [], "question": []}
    for seed in range(4):
        plan = plan_speech(60.0, "ada", "neutral", np.random.default_rng(seed))
        times = np.arange(0.0, 60.0, 0.01)
        f0 = pitch_contour(plan, SPEAKERS["ada"], VOICE_EMOTIONS["neutral"], times, np.random.default_rng(seed))
        for phrase in plan.phrases:
            last[phrase.ending].append(np.log2(f0[int(phrase.end * 100) - 1]))
    assert np.mean(last["fall"]) < np.mean(last["continuation"]) < np.mean(last["question"])
    assert plan.phrases[-1].ending == "fall"
