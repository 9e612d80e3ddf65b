"""What a speech sounds like in a few figures: those by which it is compared with the speech that a run was trained on.

They are measured in windows of six seconds, of the log-mel features that a model sees; only pitch needs the samples.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from a2g_jax.features.mel import MelConfig
from a2g_jax.features.mel_filters import mel_edges

#: Seconds of a window, and from one window to the next.
WINDOW, STEP = 6.0, 3.0
#: Least seconds of speech that are judged.
SHORTEST = 3.0
#: Decibels below the loud frames (95th percentile) at which a frame counts as a pause.
_PAUSE = 25.0
#: Least share of a window that is no pause.
_LEAST_ACTIVE = 0.2
#: Groups of mel bands whose changes are measured.
_GROUPS = 16
#: Hz.
_PITCH_LOW, _PITCH_HIGH = 60.0, 700.0
#: Seconds from one frame to the next, and least autocorrelation of a voiced one.
_HOP, _VOICED = 0.02, 0.6
#: Frames whose pitch is computed at a time.
_PIECE = 4096


class Spectra(NamedTuple):
    """Spectra of windows of a speech."""

    figures: dict[str, Float[np.ndarray, " W"]]
    """``level``, ``rate``, ``balance`` and ``change`` of each window."""
    profiles: Float[np.ndarray, "W bands"]
    """Mean of each band where there is speech, less the mean over bands, dB."""


def window_spectra(rows: Float[np.ndarray, "T width"], mel: MelConfig, fps: float) -> Spectra:
    """Figures of the windows of log-mel features; none if they are shorter than :data:`SHORTEST`.

    - ``level``: standard deviation of the level over time, dB;
    - ``rate``: peaks of the level that stand out by 3 dB, per second that is no pause;
    - ``balance``: sound above 1 kHz relative to that below, dB;
    - ``change``: standard deviation over time of the shares of 16 groups of bands, dB.

    Args:
        rows: log-mel energies, dB, not normalised by statistics.
        fps: rows per second.
    """
    rate = fps * mel.stack
    spectra = np.asarray(rows, np.float64).reshape(-1, mel.bands)
    high = mel.sample_rate / 2 if mel.high_hz is None else mel.high_hz
    treble = mel_edges(mel.bands, mel.low_hz, high)[1:-1] >= 1000.0
    found: dict[str, list[float]] = {name: [] for name in ("level", "rate", "balance", "change")}
    profiles = []
    if len(spectra) < SHORTEST * rate:
        return Spectra({name: np.zeros(0) for name in found}, np.zeros((0, mel.bands)))
    size, step = min(round(WINDOW * rate), len(spectra)), round(STEP * rate)
    loud, floor = float(np.percentile(_level(spectra), 95)), float(spectra.min())
    for start in range(0, len(spectra) - size + 1, step):
        some = spectra[start : start + size]
        level = np.maximum(_level(some) - loud, -50.0)
        active = level > -_PAUSE
        if active.mean() < _LEAST_ACTIVE or some.max() == floor:  # a pause, or digital silence
            continue
        energy = 10 ** (some / 10)
        above = energy[:, treble].sum(axis=1)[active].mean()
        below = energy[:, ~treble].sum(axis=1)[active].mean()
        found["level"].append(float(np.maximum(level, -40.0).std()))
        found["rate"].append(_rate(level, active, rate))
        found["balance"].append(float(10 * np.log10(max(above, 1e-12) / max(below, 1e-12))))
        found["change"].append(_change(energy, active))
        profile = some[active].mean(axis=0)
        profiles.append(profile - profile.mean())
    return Spectra(
        {name: np.asarray(values) for name, values in found.items()}, np.asarray(profiles).reshape(-1, mel.bands)
    )


def window_pitch(audio: Float[np.ndarray, " N"], sample_rate: int) -> Float[np.ndarray, " W"]:
    """Median pitch of the voiced frames of each window, Hz; windows with hardly any voice have none.

    The pitch of a frame of 50 ms is the lag at which its autocorrelation, divided by that of the analysis window
    (Boersma 1993), is largest, with a preference for short lags.
    """
    if len(audio) < SHORTEST * sample_rate:
        return np.zeros(0)
    from scipy import signal  # here, since it takes half a second

    factor = max(1, sample_rate // 8000)  # 8 kHz is enough for pitch
    audio, rate = np.asarray(audio, np.float64), sample_rate / factor
    audio = signal.decimate(audio, factor, ftype="fir") if factor > 1 else audio
    size, hop = round(0.05 * rate), round(_HOP * rate)
    frames = np.lib.stride_tricks.sliding_window_view(audio, size)[::hop]
    # In pieces, since a frame's spectrum takes ten times the memory of its samples.
    pieces = [_frame_pitch(frames[start : start + _PIECE], rate) for start in range(0, len(frames), _PIECE)]
    pitch, height, power = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    voiced = (height > _VOICED) & (power > 10 ** (-_PAUSE / 10) * float(np.percentile(power, 95)))
    per_window, step = min(round(WINDOW / _HOP), len(pitch)), round(STEP / _HOP)
    medians = []
    for start in range(0, len(pitch) - per_window + 1, step):
        chosen = pitch[start : start + per_window][voiced[start : start + per_window]]
        if len(chosen) >= 0.1 * per_window:
            medians.append(float(np.median(chosen)))
    return np.asarray(medians)


def _frame_pitch(frames: Float[np.ndarray, "F size"], rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pitch of each frame, Hz, its autocorrelation there, -1 without any peak, and the power of the frame."""
    size = frames.shape[1]
    window, length = np.hanning(size), 1 << (2 * size - 1).bit_length()
    frames = (frames - frames.mean(axis=1, keepdims=True)) * window
    correlation = np.fft.irfft(np.abs(np.fft.rfft(frames, length, axis=1)) ** 2, axis=1)[:, :size]
    own = np.fft.irfft(np.abs(np.fft.rfft(window, length)) ** 2)[:size]
    power = correlation[:, 0].copy()
    first, last = int(rate / _PITCH_HIGH), min(int(rate / _PITCH_LOW), size - 1)
    normal = correlation[:, : last + 2] / np.maximum(power[:, None], 1e-12) / (own[: last + 2] / own[0])
    lags = np.arange(first, last + 1)
    inner = normal[:, first : last + 1]
    peak = (inner >= normal[:, first - 1 : last]) & (inner >= normal[:, first + 1 : last + 2])
    best = np.where(peak, inner - 0.02 * np.log2(lags / first), -1.0).argmax(axis=1)
    height = np.where(peak.any(axis=1), inner[np.arange(len(inner)), best], -1.0)
    return rate / lags[best], height, power


def _level(spectra: Float[np.ndarray, "T bands"]) -> Float[np.ndarray, " T"]:
    return 10 * np.log10((10 ** (spectra / 10)).sum(axis=1) + 1e-12)


def _rate(level: Float[np.ndarray, " T"], active: Bool[np.ndarray, " T"], rate: float) -> float:
    from scipy import signal

    smooth = ndimage.gaussian_filter1d(level, 0.03 * rate)
    peaks, _ = signal.find_peaks(smooth, prominence=3.0)
    return float(active[peaks].sum() / max(active.sum() / rate, 1e-9))


def _change(energy: Float[np.ndarray, "T bands"], active: Bool[np.ndarray, " T"]) -> float:
    edges = np.unique(np.linspace(0, energy.shape[1], _GROUPS + 1).astype(int))[:-1]
    groups = np.add.reduceat(energy, edges, axis=1)
    shares = 10 * np.log10(groups / np.maximum(groups.sum(axis=1, keepdims=True), 1e-12) + 1e-4)
    return float(shares[active].std(axis=0).mean())
