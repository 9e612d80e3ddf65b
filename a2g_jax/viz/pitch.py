"""Pitch of a voice for drawing: the fundamental frequency of voiced frames."""

import numpy as np
from jaxtyping import Float

#: Search range of the fundamental frequency, Hz.
LOWEST, HIGHEST = 60.0, 500.0
_WINDOW = 0.05
_PERIODIC = 0.5


def pitch_curve(audio: Float[np.ndarray, " N"], sample_rate: int, rate: float = 50.0) -> Float[np.ndarray, " T"]:
    """F0 in Hz at times ``k / rate``, NaN where the sound is silent or not periodic.

    The largest peak of the normalised autocorrelation of windows of 50 ms (Boersma 1993, without the path search), so
    octave errors are possible: for pictures, not for measurements.

    Args:
        audio: mono samples.
        sample_rate: samples per second.
        rate: values per second.
    """
    step = max(1, round(sample_rate / 8000))
    usable = len(audio) // step * step
    sound = audio[:usable].reshape(-1, step).mean(axis=1).astype(np.float64)
    sampling = sample_rate / step
    window, count = round(_WINDOW * sampling), int(len(audio) / sample_rate * rate)
    if count == 0:
        return np.zeros(0)
    padded = np.pad(sound, (window // 2, window))
    starts = np.minimum(np.round(np.arange(count) / rate * sampling).astype(int), len(padded) - window)
    frames = padded[starts[:, None] + np.arange(window)]
    frames = (frames - frames.mean(axis=1, keepdims=True)) * np.hanning(window)
    size = 2 ** int(np.ceil(np.log2(2 * window)))
    own = np.fft.irfft(np.abs(np.fft.rfft(np.hanning(window), size)) ** 2)[:window]
    power = np.fft.irfft(np.abs(np.fft.rfft(frames, size)) ** 2)[:, :window]
    energy = power[:, 0]
    low, high = int(sampling / HIGHEST), min(int(sampling / LOWEST) + 1, window - 2)
    likeness = power / np.maximum(energy[:, None], 1e-12) / np.maximum(own / own[0], 0.05)
    # A slight preference for short lags, since their multiples fit as well.
    lags = np.arange(window)
    scores = np.where((lags >= low) & (lags <= high), likeness - 0.02 * np.log2(np.maximum(lags, 1) / low), -1.0)
    best = np.argmax(scores, axis=1)
    rows = np.arange(count)
    left, middle, right = (likeness[rows, best + shift] for shift in (-1, 0, 1))
    bend = left - 2 * middle + right
    shift = np.where(np.abs(bend) > 1e-9, 0.5 * (left - right) / np.where(np.abs(bend) > 1e-9, bend, 1.0), 0.0)
    voiced = (middle > _PERIODIC) & (energy > 0.01 * np.percentile(energy, 95)) & (best > low)
    pitch = np.where(voiced, sampling / (best + np.clip(shift, -1, 1)), np.nan)
    return _without_jumps(pitch, round(0.4 * rate))


def _without_jumps(pitch: Float[np.ndarray, " T"], reach: int) -> Float[np.ndarray, " T"]:
    """NaN where the pitch is half an octave or more off the median of its neighbourhood: octave errors."""
    padded = np.pad(pitch, reach, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    # The median without the NaNs, which sort last.
    finite = np.isfinite(windows).sum(axis=1)
    middle = np.sort(windows, axis=1)[np.arange(len(pitch)), np.maximum(finite - 1, 0) // 2]
    kept = np.abs(np.log2(pitch / middle)) < 0.5
    alone = ~(np.roll(kept, 1) | np.roll(kept, -1))
    return np.where(kept & ~alone, pitch, np.nan)
