"""Pitch, durations and size of flat speech changed by overlapping its periods anew.

Pitch-synchronous overlap-add (Moulines & Charpentier 1990). It is exact here where it is usually frail: the speech has
one pitch throughout, so the phase of its fundamental gives the pitch marks.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy import fft
from scipy.signal import resample_poly

from a2g_jax.talker.voice import overlap_add

_LOWEST, _HIGHEST = 50.0, 450.0  # Hz
_VOICED = 0.08  # of the fundamental's usual amplitude
_NOISE_PERIOD = 0.004  # seconds between the grains of voiceless sound
_CLOCK = 2000.0  # Hz: time resolution of periods
_FINER = 2  # the source is read at this multiple of its rate, between samples


@dataclass(frozen=True)
class FlatSpeech:
    """Speech on one pitch, ready to be changed."""

    audio: Float[np.ndarray, " N"]
    sample_rate: int
    f0_hz: float
    marks: Float[np.ndarray, " M"]
    """Times of the voiced periods, seconds."""
    voiced: Bool[np.ndarray, " N"]


def flat_pitch(audio: Float[np.ndarray, " N"], sample_rate: int) -> float:
    """Pitch of speech that has only one, Hz: the largest autocorrelation."""
    size = fft.next_fast_len(2 * len(audio), real=True)
    correlation = fft.irfft(np.abs(fft.rfft(audio, size)) ** 2, size)
    lags = np.arange(int(sample_rate / _HIGHEST), int(sample_rate / _LOWEST))
    # The shortest of the lags that are nearly as good: the others are its multiples.
    good = correlation[lags] > 0.9 * correlation[lags].max()
    first = int(np.argmax(good))
    last = first + int(np.argmin(np.append(good[first:], False)))
    return sample_rate / float(lags[first + int(np.argmax(correlation[lags[first:last]]))])


def find_marks(audio: Float[np.ndarray, " N"], sample_rate: int) -> FlatSpeech:
    """Pitch marks where the fundamental has one fixed phase: the one at which the periods are loudest."""
    f0 = flat_pitch(audio, sample_rate)
    size = fft.next_fast_len(len(audio) + sample_rate // 10)
    frequency = fft.fftfreq(size, 1.0 / sample_rate)
    band = np.where(np.abs(frequency - f0) < 0.5 * f0, np.cos(np.pi * (frequency - f0) / f0) ** 2, 0.0)
    analytic = 2.0 * fft.ifft(fft.fft(audio, size) * band)[: len(audio)]
    amplitude, phase = np.abs(analytic), np.unwrap(np.angle(analytic)) / (2.0 * np.pi)
    voiced = amplitude > _VOICED * np.percentile(amplitude, 90)
    # Where in a period the energy is, as an average over the voiced sound.
    power = np.square(audio) * voiced
    loudest = np.angle(np.sum(power * np.exp(2j * np.pi * phase))) / (2.0 * np.pi)
    rising = np.maximum.accumulate(phase)
    numbers = np.arange(np.ceil(rising[0] - loudest), rising[-1] - loudest)
    samples = np.interp(numbers + loudest, rising, np.arange(len(audio)))
    kept = voiced[np.rint(samples).astype(int).clip(0, len(audio) - 1)]
    return FlatSpeech(audio, sample_rate, f0, samples[kept] / sample_rate, voiced)


def revoice(
    speech: FlatSpeech,
    source: Float[np.ndarray, " K"],
    target: Float[np.ndarray, " K"],
    times: Float[np.ndarray, " T"],
    f0: Float[np.ndarray, " T"],
    size: float,
    jitter: float,
    shimmer_db: float,
    rng: np.random.Generator,
) -> Float[np.ndarray, " L"]:
    """Speech with other times, pitch and size; as long as the last of ``target``, rounded up.

    Args:
        speech: what to change.
        source: increasing moments of the speech, seconds.
        target: their places in the result.
        times: moments of the result, from 0.
        f0: wanted pitch at ``times``, Hz.
        size: of the speaker: divides all formant frequencies.
        jitter: standard deviation of a period, as a share of it.
        shimmer_db: standard deviation of a period's level.
        rng: of jitter and shimmer.
    """
    rate = speech.sample_rate
    out = np.zeros(int(np.ceil(target[-1] * rate)) + 1, np.float32)
    clock = np.arange(int(target[-1] * _CLOCK) + 1) / _CLOCK
    rows = np.rint(np.interp(clock, target, source) * rate).astype(int).clip(0, len(speech.audio) - 1)
    pitch = np.where(speech.voiced[rows], np.interp(clock, times, f0), 1.0 / _NOISE_PERIOD)
    phase = np.concatenate([[0.0], np.cumsum(pitch[:-1])]) / _CLOCK
    new = np.interp(np.arange(1.0, np.floor(phase[-1])), phase, clock)
    if len(new) == 0:
        return out
    old = np.interp(new, target, source)
    voiced = speech.voiced[np.rint(old * rate).astype(int).clip(0, len(speech.audio) - 1)]
    voiced &= len(speech.marks) > 1
    if voiced.any():
        after = np.searchsorted(speech.marks, old).clip(1, len(speech.marks) - 1)
        nearer = old - speech.marks[after - 1] < speech.marks[after] - old
        old = np.where(voiced, speech.marks[after - nearer], old)
    period = np.where(voiced, 1.0 / np.interp(new, times, f0), _NOISE_PERIOD)
    half = np.where(voiced, 1.0 / speech.f0_hz, _NOISE_PERIOD)
    # Louder by the root of the period: as many periods as before have the same power.
    level = np.where(voiced, np.sqrt(period / half) * 10.0 ** (shimmer_db * rng.standard_normal(len(new)) / 20.0), 1.0)
    new = new + np.where(voiced, jitter * period * rng.standard_normal(len(new)), 0.0)

    reach = int(np.ceil(half.max() * rate)) + 1
    first = np.floor(new * rate).astype(np.int64) - reach
    offset = (first[:, None] + np.arange(2 * reach + 1)) / rate - new[:, None]
    window = 0.5 + 0.5 * np.cos(np.pi * np.clip(offset / half[:, None], -1.0, 1.0))
    fine = resample_poly(speech.audio, _FINER, 1).astype(np.float32)
    position = (old[:, None] + offset / size) * (rate * _FINER)
    below = np.floor(position).astype(np.int64)
    share = (position - below).astype(np.float32)
    below = below.clip(0, len(fine) - 2)
    grains = fine[below] * (1.0 - share) + fine[below + 1] * share
    overlap_add(out, (grains * window * level[:, None]).astype(np.float32), first)
    return out
