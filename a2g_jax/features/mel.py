"""Log-mel spectrograms aligned exactly with the frames of the motion."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import fft

from a2g_jax.features.mel_filters import hann, mel_filters
from a2g_jax.features.offset import without_offset
from a2g_jax.features.samples import mono_samples

#: Frames transformed at once: bounds memory to about 60 MB for audio of any length.
_CHUNK = 4096


@dataclass(frozen=True)
class MelConfig:
    """Settings of log-mel features; defaults as in Audio2Gestures (Sec. 5.3.1), with levels normalised."""

    sample_rate: int = 16000
    """Samples per second, to which audio is resampled first."""
    bands: int = 64
    """Number of mel bands (Slaney's scale and area normalisation, as librosa's default)."""
    window: int = 2048
    """Length of the Hann window and of the Fourier transform, in samples."""
    level_db: float | None = -23.0
    """Level to which active speech is normalised, in dB relative to full scale; None for no normalisation."""
    range_db: float = 60.0
    """Dynamic range: bands further below the loudest one are raised to this floor (librosa's ``top_db``)."""
    low_hz: float = 0.0
    """Lower edge of the lowest band."""
    high_hz: float | None = None
    """Upper edge of the highest band; None is half the sample rate."""
    stack: int = 1
    """Spectra per motion frame, evenly spaced from its time on and concatenated to one row."""

    @property
    def width(self) -> int:
        """Number of values in a row."""
        return self.bands * self.stack


def active_level_db(audio: Float[np.ndarray, " N"], sample_rate: int) -> float:
    """Level of active speech in dB relative to full scale, similar to ITU-T P.56.

    Mean power of the 25 ms frames that are less than 25 dB below the loud ones (95th percentile), so pauses and room
    noise do not count.
    """
    size = max(1, int(0.025 * sample_rate))
    count = len(audio) // size
    if len(audio) == 0:
        power = np.zeros(1)
    elif count == 0:
        power = np.mean(np.square(audio, dtype=np.float64), keepdims=True)
    else:
        power = np.mean(np.square(audio[: count * size].reshape(count, size), dtype=np.float64), axis=1)
    loud = np.percentile(power, 95)
    active = power[power >= loud * 10**-2.5]
    return float(10 * np.log10(max(active.mean() if active.size else 0.0, 1e-20)))


def log_mel(audio: Any, config: MelConfig, fps: float, frames: int) -> Float[np.ndarray, "frames width"]:
    """Log-mel energies in dB, one row for each motion frame (with ``config.stack`` spectra in it).

    The window of frame k is centred on time ``k / fps``, rounded to the nearest sample for every frame, so the features
    never drift from the motion; with a fixed integer hop they would (0.1 s in 166 s at 30 fps and 16 kHz). The audio is
    padded with zeros, and a constant offset is removed before (:mod:`a2g_jax.features.offset`).

    Args:
        audio: (N,), mono samples at ``config.sample_rate``.
        frames: number of rows; motion of the same length has ``round(seconds * fps)``.

    Raises:
        InputError: several channels, or NaN.
    """
    samples = mono_samples(audio)
    rows = _log_mel_rows(samples, config, fps * config.stack, frames * config.stack)
    return rows.reshape(frames, config.width)


def _log_mel_rows(
    audio: Float[np.ndarray, " N"], config: MelConfig, fps: float, frames: int
) -> Float[np.ndarray, "frames bands"]:
    audio = without_offset(audio, config.sample_rate)
    if config.level_db is not None:
        gain = 10 ** ((config.level_db - active_level_db(audio, config.sample_rate)) / 20)
        audio = audio * np.float32(gain)
    half = config.window // 2
    centres = np.rint(np.arange(frames) * (config.sample_rate / fps)).astype(np.int64)
    after = max(0, (int(centres[-1]) if frames else 0) + half - len(audio))
    padded = np.pad(audio, (half, after))
    windows = np.lib.stride_tricks.sliding_window_view(padded, config.window)
    shape = hann(config.window)
    filters = mel_filters(config.sample_rate, config.window, config.bands, config.low_hz, config.high_hz).T
    rows = np.empty((frames, config.bands), np.float32)
    for start in range(0, frames, _CHUNK):
        some = windows[centres[start : start + _CHUNK]] * shape
        spectrum = fft.rfft(some, axis=1)
        rows[start : start + _CHUNK] = (spectrum.real**2 + spectrum.imag**2) @ filters
    decibels = 10 * np.log10(np.maximum(rows, 1e-10))
    # At least -100 again: on some machines a logarithm in single precision rounds below it.
    return np.maximum(decibels, max(-100.0, decibels.max(initial=-100.0) - config.range_db)).astype(np.float32)
