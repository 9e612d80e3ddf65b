"""Simple measures of speech, the same for generated and real audio."""

from typing import NamedTuple

import librosa
import numpy as np
from scipy import ndimage, signal

from a2g_jax.features.mel import MelConfig, active_level_db, log_mel

#: Sampling rate of envelopes and pitch, Hz.
RATE = 100.0


class Voice(NamedTuple):
    """Level-normalised sound, on a common time grid of :data:`RATE`."""

    mel: np.ndarray
    """(T, 64) dB, active speech at -23 dBFS."""
    level: np.ndarray
    """(T,) dB relative to active speech, smoothed by a Gaussian of 25 ms."""
    syllabic: np.ndarray
    """(T,) as ``level``, of 300 to 3000 Hz only: vowels stand out."""
    f0: np.ndarray
    """(T,) Hz, NaN where unvoiced (pYIN)."""


def analyse(audio: np.ndarray, sample_rate: int, quick: bool = False) -> Voice:
    """Mel bands, levels and pitch of a recording at 16 kHz; ``quick`` takes the pitch from single frames."""
    frames = int(len(audio) / sample_rate * RATE)
    audio = np.asarray(audio, np.float64) * 10 ** (-active_level_db(np.asarray(audio), sample_rate) / 20)
    band = signal.sosfiltfilt(signal.butter(2, (300, 3000), "band", fs=sample_rate, output="sos"), audio)
    if quick:
        f0 = frame_pitch(audio, sample_rate, frames)
    else:
        hop, limits = 160, {"fmin": 60, "fmax": 550}
        f0, _, _ = librosa.pyin(
            audio.astype(np.float32), sr=sample_rate, frame_length=1024, hop_length=hop, resolution=0.25, **limits
        )
        f0 = np.interp(np.arange(frames), np.arange(len(f0)) * hop * RATE / sample_rate, f0)
    mel = log_mel(audio.astype(np.float32), MelConfig(sample_rate=sample_rate), RATE, frames)
    return Voice(mel, _level(audio, sample_rate, frames), _level(band, sample_rate, frames), f0)


def frame_pitch(audio: np.ndarray, sample_rate: int, frames: int) -> np.ndarray:
    """(frames,) pitch in Hz at :data:`RATE`, NaN where unvoiced: autocorrelation of 40 ms (Boersma 1993), no path.

    Hundreds of times faster than pYIN; octave errors are rare where voices are clear.
    """
    half = int(0.02 * sample_rate)
    window = np.hanning(2 * half)
    padded = np.pad(np.asarray(audio, np.float64), half)
    rows = np.rint(np.arange(frames) / RATE * sample_rate).astype(int)
    blocks = padded[rows[:, None] + np.arange(2 * half)]
    blocks = (blocks - blocks.mean(axis=1, keepdims=True)) * window
    own = np.fft.irfft(np.abs(np.fft.rfft(window, 4 * half)) ** 2)
    correlation = np.fft.irfft(np.abs(np.fft.rfft(blocks, 4 * half, axis=1)) ** 2, axis=1)
    lags = np.arange(int(sample_rate / 550), min(int(sample_rate / 70), 2 * half - 1))
    strength = correlation[:, lags] / np.maximum(correlation[:, :1], 1e-12) / (own[lags] / own[0])
    # Of equal candidates the highest pitch: an octave lower costs 0.03.
    best = np.argmax(strength - 0.03 * np.log2(lags / lags[0]), axis=1)
    loud = correlation[:, 0] > 1e-3 * np.percentile(correlation[:, 0], 95)
    voiced = loud & (strength[np.arange(frames), best] > 0.5)
    return np.where(voiced, sample_rate / lags[best], np.nan)


def _level(audio: np.ndarray, sample_rate: int, frames: int) -> np.ndarray:
    # In two steps: mean power of 5 ms, then the Gaussian on those.
    size = sample_rate // 200
    power = np.square(audio[: len(audio) // size * size]).reshape(-1, size).mean(axis=1)
    power = ndimage.gaussian_filter1d(power, 0.025 * 200, mode="nearest")
    centres = (np.arange(len(power)) + 0.5) / 200
    return 10 * np.log10(np.interp(np.arange(frames) / RATE, centres, power) + 1e-9)


def syllable_peaks(voice: Voice) -> np.ndarray:
    """Times (s) of syllables: peaks of the 300-3000 Hz level that stand out by 2 dB and are no pause."""
    peaks, _ = signal.find_peaks(voice.syllabic, prominence=2.0, height=np.percentile(voice.syllabic, 95) - 25)
    return peaks / RATE


def pauses(voice: Voice) -> np.ndarray:
    """(T,) whether speech pauses: 25 dB below its loud parts for 0.2 s and more."""
    quiet = voice.level < np.percentile(voice.level, 95) - 25
    return ndimage.binary_opening(quiet, np.ones(round(0.2 * RATE)))


def modulation_peak(voice: Voice) -> float:
    """Frequency (Hz) at which the intensity envelope varies most, in third-octave bands from 0.8 to 16 Hz."""
    envelope = 10 ** (voice.syllabic / 10)
    frequency, power = signal.welch(envelope / envelope.mean(), RATE, nperseg=min(len(envelope), 800))
    centres = 0.8 * 2 ** (np.arange(14) / 3)
    edges = 2 ** (1 / 6)
    bands = [power[(frequency >= c / edges) & (frequency < c * edges)].sum() for c in centres]
    return float(centres[int(np.argmax(bands))])


def summary(voice: Voice) -> dict[str, float]:
    """Summary figures of one recording, for a table."""
    voiced = voice.f0[np.isfinite(voice.f0)]
    semitones = 12 * np.log2(voiced / np.median(voiced)) if len(voiced) else np.zeros(1)
    silent = pauses(voice)
    speaking = max(float(np.mean(~silent)) * len(silent) / RATE, 1e-3)
    return {
        "f0_median_hz": float(np.median(voiced)) if len(voiced) else float("nan"),
        "f0_spread_semitones": float(np.subtract(*np.percentile(semitones, (84, 16))) / 2),
        "voiced_share": float(np.mean(np.isfinite(voice.f0))),
        "log_mel_mean_db": float(voice.mel.mean()),
        "log_mel_std_db": float(voice.mel.std()),
        "log_mel_std_in_time_db": float(voice.mel.std(axis=0).mean()),
        "modulation_peak_hz": modulation_peak(voice),
        "syllable_rate_hz": len(syllable_peaks(voice)) / speaking,
        "pause_share": float(np.mean(silent)),
    }


def statistics(voice: Voice) -> np.ndarray:
    """Features of a recording for classifiers: mean and spread of 16 mel bands in speech, pitch, rate, pauses."""
    speech = ~pauses(voice)
    bands = voice.mel.reshape(len(voice.mel), 16, -1).mean(axis=2)
    active = bands[speech]
    voiced = 12 * np.log2(voice.f0[np.isfinite(voice.f0)] / 100.0)
    if len(voiced) < 2:
        voiced = np.zeros(2)
    change = np.diff(12 * np.log2(voice.f0 / 100.0))
    change = np.abs(change[np.isfinite(change)])
    figures = summary(voice)
    return np.concatenate(
        [
            active.mean(axis=0),
            active.std(axis=0),
            np.abs(np.diff(bands, axis=0)).mean(axis=0),
            np.percentile(voiced, (5, 25, 50, 75, 95)),
            [
                voiced.std(),
                np.median(change) if len(change) else 0.0,
                figures["voiced_share"],
                voice.level[speech].std(),
            ],
            [figures["syllable_rate_hz"], figures["pause_share"], figures["modulation_peak_hz"]],
        ]
    )


def frame_features(voice: Voice, times: np.ndarray) -> np.ndarray:
    """(T, 20) at given times: 16 mel bands, two levels, pitch (semitones above the recording's median), voicing.

    Unvoiced frames take the pitch between their neighbours. Every column is normalised over the recording.
    """
    at = np.arange(len(voice.level)) / RATE
    voiced = np.isfinite(voice.f0)
    pitch = np.zeros(len(at))
    if voiced.any():
        pitch = np.interp(at, at[voiced], 12 * np.log2(voice.f0[voiced] / np.median(voice.f0[voiced])))
    bands = voice.mel.reshape(len(voice.mel), 16, -1).mean(axis=2)
    rows = np.column_stack([bands, voice.level, voice.syllabic, pitch, voiced.astype(float)])
    rows = (rows - rows.mean(axis=0)) / (rows.std(axis=0) + 1e-6)
    where = np.clip(np.rint(np.asarray(times) * RATE).astype(int), 0, len(rows) - 1)
    return rows[where]
