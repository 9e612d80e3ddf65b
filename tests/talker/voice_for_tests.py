"""Rendered speech of the generated corpus, and its energy, peaks and pitch."""

import functools

import numpy as np

from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.plan import plan_speech
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.talker.voice import synthesise

RATE = 16000


@functools.cache
def render(speaker="david", emotion="neutral", seconds=20.0, seed=0, rate=RATE):
    rng = np.random.default_rng(seed)
    plan = plan_speech(seconds, speaker, emotion, rng)
    audio = synthesise(plan, rng, rate)
    audio.flags.writeable = False  # shared between tests
    return plan, audio


def streams_of(speaker, emotion, seconds, seed):
    """The generators that `render` synthesises with, as they were before."""
    rng = np.random.default_rng(seed)
    plan_speech(seconds, speaker, emotion, rng)
    return rng.spawn(9)


def energy_db(audio, rate=RATE, seconds=0.03):
    """Sliding RMS in dB and the centre time of each window."""
    width = int(seconds * rate)
    total = np.concatenate([[0.0], np.cumsum(np.square(audio, dtype=np.float64))])
    power = (total[width:] - total[:-width]) / width
    return 10.0 * np.log10(power + 1e-12), (np.arange(len(power)) + 0.5 * width) / rate


def rendered_peaks(plan, audio, rate=RATE):
    """Time and level of the energy peak inside each syllable."""
    level, time = energy_db(audio, rate)
    found = []
    for syllable in plan.syllables:
        low, high = np.searchsorted(time, (syllable.onset, syllable.end))
        best = low + int(np.argmax(level[low:high]))
        found.append((time[best], level[best]))
    return np.array(found)


def active_db(plan, audio, rate=RATE):
    speech = np.concatenate([audio[int(p.start * rate) : int(p.end * rate)] for p in plan.phrases])
    return 10.0 * np.log10(np.mean(np.square(speech, dtype=np.float64)))


def measured_f0(plan, audio, rate=RATE):
    """Autocorrelation pitch (Hz) of the rendered audio around the syllables' peaks."""
    style = SPEAKERS[plan.speaker]
    centre = style.median_f0_hz * 2 ** (VOICE_EMOTIONS[plan.emotion].f0_shift_semitones / 12)
    found = []
    for syllable in plan.syllables:
        middle, half = int(syllable.peak * rate), int(0.025 * rate)
        frame = audio[middle - half : middle + half] * np.hanning(2 * half)
        correlation = np.fft.irfft(np.abs(np.fft.rfft(frame, 4 * half)) ** 2)
        lags = np.arange(int(rate / (2.2 * centre)), int(rate / (0.55 * centre)))
        # The window's own autocorrelation falls with the lag: divide it out, as Boersma 1993 does.
        window = np.fft.irfft(np.abs(np.fft.rfft(np.hanning(2 * half), 4 * half)) ** 2)
        found.append(rate / lags[np.argmax(correlation[lags] / window[lags])])
    return np.array(found)
