"""Melody and loudness of a plan.

F0 follows the command-response model of Fujisaki & Hirose 1984:

    ln F0(t) = ln Fb + sum_i Ap_i Gp(t - T0_i) + sum_j Aa_j (Ga(t - T1_j) - Ga(t - T2_j))
    Gp(t) = alpha^2 t exp(-alpha t)                       for t >= 0, else 0
    Ga(t) = min(1 - (1 + beta t) exp(-beta t), gamma)     for t >= 0, else 0

with alpha = 3 /s, beta = 20 /s and gamma = 0.9. Energy is a contour in dB that peaks at each syllable's peak; accents
raise it, as they raise F0 and duration.
"""

import math

import numpy as np
from jaxtyping import Float
from scipy.signal import fftconvolve

from a2g_jax.talker.emotions import VoiceEmotion
from a2g_jax.talker.phones import PHONES, SILENT
from a2g_jax.talker.plan import phone_spans
from a2g_jax.talker.speakers import VoiceStyle
from a2g_jax.talker.speech import SpeechPlan

ALPHA, BETA, GAMMA = 3.0, 20.0, 0.9
ACCENT_DB = (0.0, 8.5)
"""Energy an accent adds, dB: ``ACCENT_DB[0] + ACCENT_DB[1] * accent`` for accents above zero."""

_TURNS = {"fall": -0.55, "continuation": 0.22, "question": 0.75}  # of the range, over the last 0.35 s
_NEPER_PER_SEMITONE = math.log(2.0) / 12.0
_WANDER = 0.08  # of the range: standard deviation of slow noise beside the commands
_SYLLABLE_DB, _PHRASE_DB = 1.3, 2.0  # standard deviations of the variation beside the accents
_PHRASE_LEAD = 0.25  # seconds by which a phrase command precedes the phrase


def phrase_response(t: Float[np.ndarray, " *T"]) -> Float[np.ndarray, " *T"]:
    """Gp of the model; t in seconds, result in 1/s."""
    t = np.maximum(t, 0.0)
    return ALPHA**2 * t * np.exp(-ALPHA * t)


def accent_response(t: Float[np.ndarray, " *T"]) -> Float[np.ndarray, " *T"]:
    """Ga of the model; t in seconds, result between 0 and gamma."""
    t = np.maximum(t, 0.0)
    return np.minimum(1.0 - (1.0 + BETA * t) * np.exp(-BETA * t), GAMMA)


def _between(times: Float[np.ndarray, " T"], start: float, end: float) -> slice:
    """The part of increasing ``times`` that lies between two moments."""
    low, high = np.searchsorted(times, (start, end))
    return slice(int(low), int(high))


def _phrase_curve(
    plan: SpeechPlan, reach: float, times: Float[np.ndarray, " T"], rng: np.random.Generator
) -> Float[np.ndarray, " T"]:
    """Phrase components of ln F0: reset at each phrase, most at a sentence's start; a fall or rise at its end."""
    curve = np.zeros(len(times))
    continues = False
    for phrase in plan.phrases:
        size = (0.62 if continues else 0.85) * reach * math.exp(0.15 * rng.standard_normal())
        continues = phrase.ending == "continuation"
        commands = [(phrase.start - _PHRASE_LEAD, size)]
        # Further, smaller commands keep long phrases from falling to the floor half way.
        commands += [(phrase.start + t, 0.45 * size) for t in np.arange(1.4, phrase.end - phrase.start - 0.8, 1.6)]
        for moment, height in commands:
            part = _between(times, moment, moment + 4.0)
            curve[part] += height * phrase_response(times[part] - moment)
        # Final lowering, or the rise of a question or a continuation.
        turn = _TURNS[phrase.ending] * reach * math.exp(0.25 * rng.standard_normal())
        part = _between(times, phrase.end - 0.35, phrase.end)
        curve[part] += turn * ((times[part] - phrase.end + 0.35) / 0.35) ** 2
    return curve


def _accent_curve(
    plan: SpeechPlan, reach: float, times: Float[np.ndarray, " T"], rng: np.random.Generator
) -> Float[np.ndarray, " T"]:
    """Accent components of ln F0: large on accented syllables, small on merely stressed ones."""
    curve = np.zeros(len(times))
    for syllable in plan.syllables:
        strength = syllable.accent if syllable.accent > 0 else 0.2 * syllable.stress * rng.random()
        if strength == 0.0:
            continue
        size = (0.12 + 0.8 * strength) * reach
        rise = syllable.peak - 0.11 + 0.015 * rng.standard_normal()
        fall = max(syllable.peak + 0.05, syllable.end - 0.08) + 0.015 * rng.standard_normal()
        part = _between(times, rise, fall + 0.5)
        curve[part] += size * (accent_response(times[part] - rise) - accent_response(times[part] - fall))
    return curve


def _consonant_curve(plan: SpeechPlan, times: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Vowels start higher after voiceless obstruents and lower after voiced ones (Hombert, Ohala & Ewan 1979)."""
    curve = np.zeros(len(times))
    for syllable in plan.syllables:
        first = PHONES[syllable.phones[0]]
        if first.kind in ("vowel", "nasal", "approximant"):
            continue
        start = next(begin for symbol, begin, _ in phone_spans(syllable) if PHONES[symbol].is_vowel)
        step = 0.05 if first.voiced_db <= SILENT else -0.04
        part = _between(times, start - 0.03, start + 0.15)
        curve[part] += step * np.exp(-np.abs(times[part] - start) / 0.035)
    return curve


def _slow_noise(count: int, step: float, rng: np.random.Generator) -> Float[np.ndarray, " T"]:
    """Noise of unit variance that changes within about 0.3 s; ``step`` is its sample spacing in seconds."""
    window = np.hanning(max(3, int(0.6 / step)))
    knots = rng.standard_normal(count + len(window) - 1)
    return fftconvolve(knots, window / np.sqrt(np.sum(window**2)), mode="valid")


def pitch_contour(
    plan: SpeechPlan,
    style: VoiceStyle,
    emotion: VoiceEmotion,
    times: Float[np.ndarray, " T"],
    rng: np.random.Generator,
    consonants: bool = True,
) -> Float[np.ndarray, " T"]:
    """F0 in Hz at evenly spaced times (seconds). Its median over speech is the speaker's, moved by emotion.

    Args:
        plan: the speech.
        style: the speaker's voice.
        emotion: changes of it.
        times: where F0 is wanted.
        rng: of the variation beside the plan.
        consonants: with the effect of obstruents; only for phones in :data:`~a2g_jax.talker.phones.PHONES`.
    """
    reach = style.f0_range_semitones * emotion.f0_range_factor * _NEPER_PER_SEMITONE
    log_f0 = _phrase_curve(plan, reach, times, rng) + _accent_curve(plan, reach, times, rng)
    if consonants:
        log_f0 += _consonant_curve(plan, times)
    log_f0 += _WANDER * reach * _slow_noise(len(times), float(times[1] - times[0]), rng)
    spoken = np.zeros(len(times), bool)
    for phrase in plan.phrases:
        spoken[_between(times, phrase.start, phrase.end)] = True
    base = math.log(style.median_f0_hz) + emotion.f0_shift_semitones * _NEPER_PER_SEMITONE
    if spoken.any():
        log_f0 -= np.median(log_f0[spoken])
    # Even excited voices seldom leave the octave above their median: compress values beyond 10 semitones.
    knee = 10.0 * _NEPER_PER_SEMITONE
    log_f0 = np.where(log_f0 > knee, knee + 0.3 * np.tanh((log_f0 - knee) / 0.3), log_f0) + base
    # Slow variation beside the commands: "flutter" as three incommensurate sinusoids (Klatt & Klatt 1990).
    for rate in (12.7, 7.1, 4.7):
        log_f0 += 0.002 * emotion.jitter_factor * np.sin(2.0 * math.pi * (rate * times + rng.random()))
    return np.exp(log_f0)


def creak_contour(
    plan: SpeechPlan, times: Float[np.ndarray, " T"], rng: np.random.Generator
) -> Float[np.ndarray, " T"]:
    """Creakiness of the voice, 0 to 1: half of the falling phrases end in creak (irregular pulses at half the rate)."""
    curve = np.zeros(len(times))
    for phrase in plan.phrases:
        length = rng.uniform(0.08, 0.22)
        if phrase.ending == "fall" and rng.random() < 0.5:
            part = _between(times, phrase.end - length - 0.05, phrase.end)
            curve[part] = np.clip((times[part] - phrase.end + length + 0.05) / 0.05, 0.0, 1.0)
    return curve


def energy_contour(
    plan: SpeechPlan, times: Float[np.ndarray, " T"], rng: np.random.Generator
) -> Float[np.ndarray, " T"]:
    """Level in dB relative to an unaccented stressed vowel, at the given times; peaks at every syllable's peak."""
    peaks = [syllable.peak for syllable in plan.syllables]
    chance = _SYLLABLE_DB * rng.standard_normal(len(peaks))
    levels = [dB + (0.0 if s.stress else -1.5) for s, dB in zip(plan.syllables, chance.tolist(), strict=True)]
    level = np.interp(times, peaks, levels)
    for phrase in plan.phrases:
        part = _between(times, phrase.start, phrase.end)
        share = (times[part] - phrase.start) / (phrase.end - phrase.start)
        level[part] += _PHRASE_DB * rng.standard_normal() + 1.5 - 3.0 * share
        part = _between(times, phrase.end - 0.2, phrase.end)
        level[part] -= 6.0 * ((times[part] - phrase.end + 0.2) / 0.2) ** 2
    for syllable in plan.syllables:
        peak = syllable.peak
        # Every syllable has a maximum of its own.
        half = max(peak - syllable.onset, syllable.end - peak)
        part = _between(times, syllable.onset, syllable.end)
        level[part] -= 10.0 * np.minimum(((times[part] - peak) / half) ** 2, 1.0)
        if syllable.accent > 0.0:
            rise, fall = 0.055, max(0.065, 0.4 * (syllable.end - peak))
            part = _between(times, peak - 4.0 * rise, peak + 4.0 * fall)
            away = times[part] - peak
            boost = ACCENT_DB[0] + ACCENT_DB[1] * syllable.accent
            level[part] += boost * np.exp(-0.5 * (away / np.where(away < 0.0, rise, fall)) ** 2)
    return level


def accent_gain(plan: SpeechPlan, times: Float[np.ndarray, " T"], rng: np.random.Generator) -> Float[np.ndarray, " T"]:
    """Gain in dB for speech that has its own energy: accents raise it as in :func:`energy_contour`, phrases fall.

    Args:
        plan: the speech.
        times: increasing, seconds.
        rng: of the level of phrases.
    """
    gain = np.zeros(len(times))
    for phrase in plan.phrases:
        part = _between(times, phrase.start, phrase.end)
        share = (times[part] - phrase.start) / (phrase.end - phrase.start)
        gain[part] += _PHRASE_DB * rng.standard_normal() + 1.5 - 3.0 * share
    for syllable in plan.syllables:
        if syllable.accent > 0.0:
            peak = syllable.peak
            rise, fall = max(0.055, 0.6 * (peak - syllable.onset)), max(0.065, 0.4 * (syllable.end - peak))
            part = _between(times, peak - 4.0 * rise, peak + 4.0 * fall)
            away = times[part] - peak
            boost = ACCENT_DB[0] + ACCENT_DB[1] * syllable.accent
            gain[part] += boost * np.exp(-0.5 * (away / np.where(away < 0.0, rise, fall)) ** 2)
    return gain
