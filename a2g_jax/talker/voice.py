"""Source-filter synthesis of a speech plan.

Voiced sound is one impulse response per glottal pulse (source spectrum times vocal tract), overlap-added at jittered
pulse times; aspiration and frication are noise shaped frame by frame. Every pulse and frame is scaled to its planned
level, so loudness does not depend on the formants: a syllable's energy peaks at its planned time.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import fft

from a2g_jax.errors import InputError
from a2g_jax.talker.articulation import SILENT, TRACK_RATE, Tracks, articulate
from a2g_jax.talker.emotions import VOICE_EMOTIONS, VoiceEmotion, scaled
from a2g_jax.talker.prosody import creak_contour, energy_contour, pitch_contour
from a2g_jax.talker.speakers import SPEAKERS, VoiceStyle, session_voice
from a2g_jax.talker.speech import SpeechPlan
from a2g_jax.talker.tract import glottal_spectrum, noise_spectrum, tract_response, upper_formants

SPEECH_DBFS = -23.0
"""Active level (RMS over phrases) of a neutral speaker, dB relative to full scale."""
ROOM_DBFS = -65.0
"""Level of the room's noise floor."""

_RESPONSE_SECONDS = 0.032
_LEAD_SECONDS = 0.008  # room for the anticausal part of the glottal pulse
_CHUNK = 512  # pulses or frames at a time: their spectra stay in the processor's cache
_AUDIBLE_DB = SILENT + 1.0
_LEVEL_SECONDS = 0.04
_BREATH_DBFS = -43.0
_REFERENCE_HZ = 8000.0  # levels are of the band below it, so that they do not depend on the sample rate
CREAK_F0, _CREAK_JITTER, _CREAK_DB = 0.55, 0.07, 2.0


@dataclass(frozen=True)
class _Grid:
    """Frequencies of the short spectra."""

    sample_rate: int
    n_fft: int
    frequency: Float[np.ndarray, " F"]

    @staticmethod
    def of(sample_rate: int) -> "_Grid":
        n_fft = fft.next_fast_len(int(_RESPONSE_SECONDS * sample_rate), real=True)
        return _Grid(sample_rate, n_fft, fft.rfftfreq(n_fft, 1.0 / sample_rate).astype(np.float32))


def _amplitude(track_db: np.ndarray, level_db: np.ndarray | float = 0.0) -> np.ndarray:
    """Amplitude of a source at its track's level plus the prosody's; nothing where the track is silent."""
    return np.where(track_db > _AUDIBLE_DB, 10.0 ** ((track_db + level_db) / 20.0), 0.0).astype(np.float32)


def _band_power(spectrum: np.ndarray, grid: _Grid) -> Float[np.ndarray, " P"]:
    """Sum of squares of the signals with these half-spectra (Parseval), as far as they lie below 8 kHz."""
    spectrum = spectrum[:, : int(np.searchsorted(grid.frequency, _REFERENCE_HZ, side="right"))]
    power = (spectrum.real**2 + spectrum.imag**2) if np.iscomplexobj(spectrum) else spectrum**2
    return (2.0 * power.sum(axis=1) - power[:, 0]) / grid.n_fft


class _Renderer:
    """State of one rendering that several sources share."""

    def __init__(
        self, tracks: Tracks, level: np.ndarray, style: VoiceStyle, emotion: VoiceEmotion, grid: _Grid
    ) -> None:
        self.tracks, self.level, self.style, self.emotion, self.grid = tracks, level, style, emotion, grid
        self.formants = (tracks.formants / style.tract_length).astype(np.float32)
        self.upper = upper_formants(grid.frequency, style.tract_length).astype(np.complex64)

    def at(self, track: np.ndarray, times: np.ndarray) -> np.ndarray:
        return np.interp(times, self.tracks.times, track).astype(np.float32)

    def tract(self, times: np.ndarray) -> np.ndarray:
        rows = np.rint(times * TRACK_RATE).astype(int).clip(0, len(self.tracks.times) - 1)
        nasal = self.tracks.nasal[rows].astype(np.float32)
        zero = (self.tracks.nasal_zero[rows] / self.style.tract_length).astype(np.float32)
        return tract_response(self.grid.frequency, self.formants[rows], nasal, zero, self.upper)

    def voiced(
        self, out: np.ndarray, f0: np.ndarray, phase: np.ndarray, creak: np.ndarray, rng: np.random.Generator
    ) -> None:
        """Add glottal pulses to ``out``."""
        style, emotion, grid = self.style, self.emotion, self.grid
        times = np.interp(np.arange(1.0, math.floor(phase[-1])), phase, self.tracks.times)
        pitch = self.at(f0, times)
        creaky = self.at(creak, times)
        jitter = style.jitter * emotion.jitter_factor + _CREAK_JITTER * creaky
        times = times + jitter * rng.standard_normal(len(times)) / pitch
        level = self.at(self.tracks.voiced_db + self.level, times)
        shimmer = style.shimmer_db * emotion.jitter_factor + _CREAK_DB * creaky
        level += shimmer.astype(np.float32) * rng.standard_normal(len(times)).astype(np.float32)
        keep = (self.at(self.tracks.voiced_db, times) > _AUDIBLE_DB) & (times > 0.0)
        times, pitch, level = times[keep], pitch[keep], level[keep]
        # Vocal effort: louder syllables are brighter too (Sluijter & van Heuven 1996).
        tilt = style.tilt_db_per_octave + emotion.tilt_db_per_octave + 0.3 * np.clip(level, -14.0, 8.0)
        tilt = tilt.astype(np.float32)
        rate = grid.sample_rate
        irregular = 2.0 * np.pi * np.clip((grid.frequency - 3500.0) / 3500.0, 0.0, 1.0)
        high = int(np.argmax(irregular > 0.0))
        for start in range(0, len(times), _CHUNK):
            part = slice(start, start + _CHUNK)
            spectrum = glottal_spectrum(grid.frequency, pitch[part], tilt[part])
            spectrum *= self.tract(times[part])
            scale = 10.0 ** (level[part] / 20.0) * np.sqrt(rate / (pitch[part] * _band_power(spectrum, grid)))
            first = (times[part] - _LEAD_SECONDS) * rate
            sample = np.floor(first).astype(np.int64)
            delay = ((first - sample) / rate + _LEAD_SECONDS).astype(np.float32)
            angle = (-2.0 * np.pi * delay)[:, None] * grid.frequency[None, :]
            # High up, real voices are noisy rather than periodic: their phases wander from pulse to pulse.
            wander = rng.random((len(angle), len(irregular) - high), dtype=np.float32) - np.float32(0.5)
            angle[:, high:] += irregular[high:] * wander
            spectrum *= scale[:, None] * np.exp(1j * angle)
            overlap_add(out, fft.irfft(spectrum, grid.n_fft, axis=1), sample)

    def noise(
        self,
        out: np.ndarray,
        amplitude: np.ndarray,
        frames: np.ndarray,
        hop: int,
        spectrum_of: Callable[[np.ndarray], np.ndarray],
        rng: np.random.Generator,
    ) -> None:
        """Add noise of unit power, shaped by ``spectrum_of(times)`` at the given frames, times ``amplitude``."""
        grid = self.grid
        length = 2 * hop
        window = np.sqrt(np.hanning(length + 1)[:-1]).astype(np.float32)
        shaped = np.zeros(len(out) + length + grid.n_fft, np.float32)
        for start in range(0, len(frames), _CHUNK):
            part = frames[start : start + _CHUNK]
            white = rng.standard_normal((len(part), length), dtype=np.float32) * window
            spectrum = spectrum_of(part * hop / grid.sample_rate)
            scale = (1.0 / np.sqrt(_band_power(spectrum, grid))).astype(np.float32)
            block = fft.irfft(fft.rfft(white, grid.n_fft, axis=1) * (spectrum * scale[:, None]), grid.n_fft, axis=1)
            overlap_add(shaped, block, part * hop - hop)
        out += shaped[: len(out)] * amplitude


def overlap_add(out: np.ndarray, blocks: Float[np.ndarray, "P N"], starts: np.ndarray) -> None:
    """Add each block to ``out`` at its start; samples outside are dropped."""
    blocks = blocks.astype(np.float32, copy=False)
    low, high = int(starts.min()), int(starts.max()) + blocks.shape[1]
    index = (starts - low)[:, None] + np.arange(blocks.shape[1])
    total = np.bincount(index.ravel(), weights=blocks.ravel(), minlength=high - low)
    a, b = max(low, 0), min(high, len(out))
    out[a:b] += total[a - low : b - low].astype(np.float32)


def _levelling(voice: np.ndarray, wanted: np.ndarray, sample_rate: int) -> Float[np.ndarray, " N"]:
    """Slow gain that undoes the swell of the voice where a harmonic of F0 crosses a formant.

    ``wanted`` is the designed amplitude at :data:`TRACK_RATE`; the gain stays within 8 dB.
    """
    hop = sample_rate / TRACK_RATE
    power = np.concatenate([[0.0], np.cumsum(np.square(voice, dtype=np.float64))])
    edges = np.arange(len(wanted) + 1) * hop - 0.5 * hop
    frames = np.diff(np.interp(edges, np.arange(len(power)), power)) / hop
    window = np.hanning(int(_LEVEL_SECONDS * TRACK_RATE) + 2)[1:-1]
    window /= window.sum()
    measured = np.convolve(frames, window, mode="same")
    design = np.convolve(wanted**2, window, mode="same")
    audible = design > 10.0 ** (-40.0 / 10.0)
    gain = np.ones(len(wanted))
    gain[audible] = np.clip(np.sqrt(design[audible] / np.maximum(measured[audible], 1e-12)), 0.4, 2.5)
    return np.interp(np.arange(len(voice)), np.arange(len(gain)) * hop, gain).astype(np.float32)


def breath_amplitude(plan: SpeechPlan, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Amplitude (RMS, full scale 1) of inhalations before phrases that follow a long enough pause."""
    amplitude = np.zeros(len(times), np.float32)
    ends = [0.0, *(phrase.end for phrase in plan.phrases)]
    for phrase, previous in zip(plan.phrases, ends, strict=False):
        gap = phrase.start - previous
        if gap < 0.35:
            continue
        length = min(0.45, 0.7 * gap)
        end = phrase.start - 0.06
        inside = (times > end - length) & (times < end)
        shape = np.sin(np.pi * ((times[inside] - end + length) / length) ** 1.4)
        amplitude[inside] = 10.0 ** ((_BREATH_DBFS + 3.0 * rng.standard_normal()) / 20.0) * shape
    return amplitude


def room_noise(count: int, sample_rate: int, rng: np.random.Generator) -> Float[np.ndarray, " N"]:
    """Soft noise that falls by 3 dB per octave, at :data:`ROOM_DBFS`."""
    size = fft.next_fast_len(count, real=True)
    spectrum = fft.rfft(rng.standard_normal(size, dtype=np.float32))
    frequency = fft.rfftfreq(size, 1.0 / sample_rate)
    noise = fft.irfft(spectrum * (1.0 / np.sqrt(np.maximum(frequency, 80.0) / 80.0)).astype(np.float32), size)[:count]
    return noise * np.float32(10.0 ** (ROOM_DBFS / 20.0) / np.sqrt(np.mean(noise**2)))


def limit_peaks(audio: np.ndarray) -> np.ndarray:
    """Compress peaks above 0.7 so that they stay below 0.99."""
    over = np.abs(audio) > 0.7
    audio[over] = np.sign(audio[over]) * (0.7 + 0.29 * np.tanh((np.abs(audio[over]) - 0.7) / 0.29))
    return audio


def active_rms(audio: np.ndarray, plan: SpeechPlan, sample_rate: int) -> float:
    parts = [audio[int(p.start * sample_rate) : int(p.end * sample_rate)] for p in plan.phrases]
    total = sum(float(np.dot(part, part)) for part in parts)
    return math.sqrt(total / max(1, sum(len(part) for part in parts)))


def synthesise(plan: SpeechPlan, rng: np.random.Generator, sample_rate: int = 16000) -> Float[np.ndarray, " N"]:
    """Audio of a plan: float32, ``round(seconds * sample_rate)`` samples, peak below 1.

    The active level is :data:`SPEECH_DBFS` plus the speaker's and the emotion's loudness. The same plan and
    generator give the same speech at any sample rate, with more or less treble; only the samples of its noises differ.

    Raises:
        InputError: a sample rate below 8 kHz.
    """
    if sample_rate < 8000:
        raise InputError(f"sample_rate is {sample_rate}: the voice needs at least 8000 Hz")
    # One stream for each use: the number of draws may depend on the sample rate.
    streams = rng.spawn(9)
    style = session_voice(SPEAKERS[plan.speaker], streams[0])
    emotion = scaled(VOICE_EMOTIONS[plan.emotion], plan.strength)
    count = round(plan.seconds * sample_rate)
    tracks = articulate(plan, emotion, streams[1])
    level = energy_contour(plan, tracks.times, streams[2])
    creak = creak_contour(plan, tracks.times, streams[3])
    f0 = pitch_contour(plan, style, emotion, tracks.times, streams[4]) * CREAK_F0**creak
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (f0[1:] + f0[:-1])) / TRACK_RATE])
    renderer = _Renderer(tracks, level, style, emotion, _Grid.of(sample_rate))
    audio = np.zeros(count, np.float32)
    renderer.voiced(audio, f0, phase, creak, streams[5])
    audio *= _levelling(audio, _amplitude(tracks.voiced_db, level), sample_rate)

    clock = np.arange(count) / sample_rate

    # Turbulence at the glottis: under the voice it comes in puffs, once a period.
    puff_db = level + style.breathiness_db + emotion.breathiness_db
    puffs = 0.6 + 0.4 * np.cos(2.0 * np.pi * np.interp(clock, tracks.times, phase)).astype(np.float32)
    steady = np.interp(clock, tracks.times, _amplitude(tracks.aspiration_db, level))
    puffing = np.interp(clock, tracks.times, _amplitude(tracks.voiced_db, puff_db))
    amplitude = (puffing * puffs + steady).astype(np.float32)
    hop = int(0.008 * sample_rate)
    audible = (tracks.voiced_db > _AUDIBLE_DB) | (tracks.aspiration_db > _AUDIBLE_DB)
    frames = _active_frames(audible, count, hop, sample_rate)
    renderer.noise(audio, amplitude, frames, hop, renderer.tract, streams[8])

    amplitude = np.interp(clock, tracks.times, _amplitude(tracks.noise_db, level)).astype(np.float32)
    hop = int(0.005 * sample_rate)
    frames = _active_frames(tracks.noise_db > _AUDIBLE_DB, count, hop, sample_rate)
    frequency = renderer.grid.frequency

    def frication(times: np.ndarray) -> np.ndarray:
        # Half the speakers' difference in size: cavities before the constriction differ less than whole tracts.
        size = math.sqrt(style.tract_length)
        centre = renderer.at(tracks.noise_hz, times) / np.float32(size)
        return noise_spectrum(frequency, centre, renderer.at(tracks.noise_width_hz, times))

    renderer.noise(audio, amplitude, frames, hop, frication, streams[6])

    wanted = 10.0 ** ((SPEECH_DBFS + style.loudness_db + emotion.loudness_db) / 20.0)
    audio *= np.float32(wanted / max(active_rms(audio, plan, sample_rate), 1e-9))

    breath = breath_amplitude(plan, tracks.times, streams[7])
    amplitude = np.interp(clock, tracks.times, breath).astype(np.float32)
    hop = int(0.008 * sample_rate)
    frames = _active_frames(breath > 0.0, count, hop, sample_rate)
    renderer.noise(audio, amplitude, frames, hop, renderer.tract, streams[8])
    audio += room_noise(count, sample_rate, streams[8])
    return limit_peaks(audio)


def _active_frames(active: np.ndarray, count: int, hop: int, sample_rate: int) -> np.ndarray:
    """Indices of the noise frames that touch an active stretch."""
    frames = np.arange(count // hop + 2)
    rows = np.rint(frames * hop / sample_rate * TRACK_RATE).astype(int).clip(0, len(active) - 1)
    spread = np.convolve(active, np.ones(9), mode="same") > 0
    return frames[spread[rows]]
