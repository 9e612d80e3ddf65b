"""Is there speech in a recording, or only noise, tones or music?

Four figures of a window of four seconds. Speech changes its level and its spectrum with every syllable, and its pitch
glides: noise and hum keep their level, claps and gusts their spectrum, notes their pitches. Bounds were set
between 144 windows of speech (people, and generated talk of all voices and emotions), each also with noise 5 and 10 dB
below, in a room, over a telephone and at other rates, and 80 recordings of noise, tones, signals, melodies, chords and
drums: no window alone is objected to, 2 of the 1008 changed ones are, and no recording of the others passes.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy import fft

#: Seconds of a window, and of the shortest recording that is judged.
WINDOW, SHORTEST = 4.0, 1.5
#: Windows that are judged at most, spread over a long recording.
_MOST = 24
#: Bounds: level deviation and spectral change (dB, at least), share of standing pitches and depth of strokes (at most).
LEVEL, SPECTRUM, STANDING, STROKES = 4.0, 3.0, 0.25, 1.6
#: The same for shorter recordings, whose figures scatter more.
_SHORT = (2.0, 2.0, 0.5, np.inf)
_HOP = 0.01
_BANDS = 16
#: Frames this many decibels below the loud ones are pauses.
_ACTIVE = 25.0


class Likeness(NamedTuple):
    """Figures of a window; those of speech: 5 to 17, 4 to 9, 0 to 0.11 and 0.3 to 1.8."""

    level: float
    """Standard deviation of the level over time, dB."""
    spectrum: float
    """Standard deviation over time of the bands' shares, dB, where there is sound."""
    standing: float
    """Share of frames whose fine spectrum is still that of 0.1 s before."""
    strokes: float
    """Depth of the modulation of the amplitude between 2 and 9 Hz, relative to its mean."""

    def objection(self, short: bool = False) -> str:
        """Why the window is no speech, or nothing.

        Args:
            short: whether it is shorter than :data:`WINDOW`.
        """
        level, spectrum, standing, strokes = _SHORT if short else (LEVEL, SPECTRUM, STANDING, STROKES)
        if self.level < level:
            return "its level hardly changes, as in noise or a steady tone"
        if self.spectrum < spectrum:
            return "its spectrum hardly changes, as in noise or signals"
        if self.standing > standing:
            return "its pitches stand still, as in music and tones"
        if self.strokes > strokes:
            return "it consists of separate strokes, as of drums"
        return ""


def why_no_speech(audio: Float[np.ndarray, " N"], sample_rate: int) -> str:
    """Why a recording holds no speech; empty if a window of it sounds like speech, or if it is too short to judge."""
    size, step = round(WINDOW * sample_rate), round(WINDOW * sample_rate / 2)
    if len(audio) < SHORTEST * sample_rate:
        return ""
    starts = np.arange(0, max(len(audio) - size, 0) + 1, step)
    starts = starts[np.unique(np.linspace(0, len(starts) - 1, min(len(starts), _MOST)).astype(int))]
    # Loud windows first, so that speech is usually found in the first one.
    starts = starts[np.argsort([-float(np.abs(audio[at : at + size : 7]).mean()) for at in starts], kind="stable")]
    found = ""
    for start in starts:
        likeness = speech_likeness(audio[start : start + size], sample_rate)
        if likeness is None:
            continue
        if not (objection := likeness.objection(len(audio) < size)):
            return ""
        found = found or objection
    return found


def speech_likeness(audio: Float[np.ndarray, " N"], sample_rate: int) -> Likeness | None:
    """Figures of one window; None for digital silence."""
    audio = np.asarray(audio, np.float32)
    audio = audio - np.median(audio)
    power, hertz = _spectra(audio, 0.032, sample_rate)
    edges = np.geomspace(150.0, min(6500.0, 0.4 * sample_rate), _BANDS + 1)
    columns = np.searchsorted(hertz, edges)
    columns = np.maximum(columns, columns[0] + np.arange(_BANDS + 1))
    bands = np.add.reduceat(power[:, : columns[-1]], columns[:-1], axis=1) / np.diff(columns)
    energy = bands.sum(axis=1)
    top = float(np.percentile(energy, 95))
    if not top > 0:
        return None
    decibels = 10 * np.log10(energy / top + 1e-4)
    active = decibels > -_ACTIVE
    fine, rows = _spectra(audio, 0.064, sample_rate)
    fine = fine[:, (rows >= 125) & (rows < 4000)]
    return Likeness(
        float(decibels.std()), _spectral_change(bands, active), _standing(fine, active), _strokes(np.sqrt(energy / top))
    )


def _spectra(
    audio: Float[np.ndarray, " N"], seconds: float, sample_rate: int
) -> tuple[Float[np.ndarray, "T F"], Float[np.ndarray, " F"]]:
    size, hop = round(seconds * sample_rate), round(_HOP * sample_rate)
    padded = np.pad(audio, size // 2)
    windows = np.lib.stride_tricks.sliding_window_view(padded, size)[::hop] * np.hanning(size).astype(np.float32)
    spectrum = fft.rfft(windows, axis=1)  # in single precision, several times as fast as NumPy's
    return spectrum.real**2 + spectrum.imag**2, np.fft.rfftfreq(size, 1 / sample_rate)


def _mean_over(values: np.ndarray, width: int) -> np.ndarray:
    """Moving average along the last axis, edges repeated."""
    before = width // 2
    padded = np.pad(values, [(0, 0)] * (values.ndim - 1) + [(before + 1, width - 1 - before)], mode="edge")
    total = np.cumsum(padded, axis=-1, dtype=np.float64)
    return (total[..., width:] - total[..., :-width]) / width


def _spectral_change(bands: Float[np.ndarray, "T B"], active: Bool[np.ndarray, " T"]) -> float:
    smooth = _mean_over(bands.T, 5).T
    shares = 10 * np.log10(smooth / np.maximum(smooth.sum(axis=1, keepdims=True), 1e-30) + 1e-4)
    return float(shares[active].std(axis=0).mean())


def _standing(power: Float[np.ndarray, "T F"], active: Bool[np.ndarray, " T"]) -> float:
    logarithm = np.log(power + 1e-8 * power.max())
    fine = logarithm - _mean_over(logarithm, 15)
    fine = fine / np.maximum(np.linalg.norm(fine, axis=1, keepdims=True), 1e-9)
    count = min(len(fine), len(active))
    later = round(0.1 / _HOP)
    same = np.einsum("tf,tf->t", fine[later:count], fine[: count - later])
    both = active[later:count] & active[: count - later]
    return float((same[both] > 0.7).mean()) if both.any() else 0.0


def _strokes(amplitude: Float[np.ndarray, " T"]) -> float:
    spectrum = np.fft.rfft(amplitude - amplitude.mean())
    hertz = np.fft.rfftfreq(len(amplitude), _HOP)
    inside = (hertz >= 2) & (hertz <= 9)
    deviation = np.sqrt(2 * np.sum(np.abs(spectrum[inside]) ** 2)) / len(amplitude)
    return float(deviation / max(float(amplitude.mean()), 1e-9))
