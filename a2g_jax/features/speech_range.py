"""The range of the speech that a run was trained on, and what of another speech lies outside it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.features.speech_figures import window_pitch, window_spectra

#: Quantiles of the windows of the training speech between which a figure is in its range.
QUANTILES = (0.001, 0.999)
#: Share of the range by which a speech may lie beyond it; of pitch, a factor (a semitone).
MARGIN, SEMITONE = 0.1, 2.0 ** (1 / 12)
#: Least windows (of six seconds, every three) from which a range follows.
LEAST_WINDOWS = 12


class _Unit(NamedTuple):
    """How a figure is written."""

    title: str
    unit: str
    digits: int


#: All figures, in the order in which they are named. The spectrum has no lower end.
_UNITS: dict[str, _Unit] = {
    "pitch": _Unit("pitch", "Hz", 0),
    "level": _Unit("level variation", "dB", 1),
    "rate": _Unit("rate", "syllables/s", 1),
    "balance": _Unit("sound above 1 kHz", "dB", 0),
    "change": _Unit("change of the spectrum", "dB", 1),
    "spectrum": _Unit("sound of voice, room or microphone", "standard deviations from the mean spectrum", 1),
}


class Outside(NamedTuple):
    """A figure of a speech outside the range of the training speech."""

    figure: str
    value: float
    low: float
    high: float

    def __str__(self) -> str:
        title, unit, digits = _UNITS[self.figure]
        span = f"at most {self.high:.{digits}f}"
        if self.figure != "spectrum":
            span = f"{self.low:.{digits}f} to {self.high:.{digits}f}"
        return f"{title} {self.value:.{digits}f} {unit} (training speech: {span})"


@dataclass(frozen=True, eq=False)
class SpeechRange:
    """Ranges of the figures of :mod:`a2g_jax.features.speech_figures` over windows of the training speech."""

    ranges: dict[str, tuple[float, float]]
    """Lowest and highest value of each figure; without ``pitch`` where no waveforms were at hand."""
    mean: Float[np.ndarray, " bands"]
    """Mean spectrum of the windows, dB, less its mean over bands."""
    deviation: Float[np.ndarray, " bands"]
    """Standard deviation of the windows' spectra, dB."""
    windows: int
    """How many there were."""

    def outside(self, audio: Float[np.ndarray, " N"], mel: MelConfig, fps: float) -> tuple[Outside, ...]:
        """Figures of a speech, medians over its windows, that lie outside the range; none for less than three seconds.

        Args:
            audio: mono samples at the features' rate.
            mel: settings of the features of the run.
            fps: of its motion.
        """
        rows = log_mel(audio, mel, fps, round(len(audio) / mel.sample_rate * fps))
        spectra = window_spectra(rows, mel, fps)
        values = {"pitch": window_pitch(audio, mel.sample_rate), **spectra.figures}
        values["spectrum"] = _distance(spectra.profiles, self.mean, self.deviation)
        found = []
        for name in _UNITS:
            if name not in self.ranges or not len(values[name]):
                continue
            (low, high), value = self.ranges[name], float(np.median(values[name]))
            slack = MARGIN * (high - low)
            least, most = (low / SEMITONE, high * SEMITONE) if name == "pitch" else (low - slack, high + slack)
            if value > most or (name != "spectrum" and value < least):
                found.append(Outside(name, value, low, high))
        return tuple(found)

    def united(self, other: "SpeechRange") -> "SpeechRange":
        """The range of both: of a run that was trained on one speech after another.

        The spectrum of a speech is compared with the mean of the latter, so its range is widened by the distance
        between the two means.
        """
        if self.mean.shape != other.mean.shape:
            return other
        ranges = {
            name: (min(self.ranges[name][0], other.ranges[name][0]), max(self.ranges[name][1], other.ranges[name][1]))
            for name in self.ranges
            if name in other.ranges
        }
        deviation = np.maximum(self.deviation, other.deviation)
        between = float(_distance(self.mean[None], other.mean, deviation)[0])
        low, high = ranges["spectrum"]
        return SpeechRange(
            ranges | {"spectrum": (low, high + between)}, other.mean, deviation, self.windows + other.windows
        )

    def to_json(self) -> dict[str, Any]:
        """The range as JSON values."""
        return {
            "format": "a2g_jax speech range",
            "windows": self.windows,
            "ranges": {name: [round(value, 4) for value in pair] for name, pair in self.ranges.items()},
            "mean": [round(float(value), 3) for value in self.mean],
            "deviation": [round(float(value), 3) for value in self.deviation],
        }


def range_from_json(values: Any, bands: int, where: str) -> SpeechRange:
    """The range of :meth:`SpeechRange.to_json`.

    Args:
        bands: of the run's features.
        where: named in errors.

    Raises:
        InputError: other contents.
    """
    try:
        found = SpeechRange(
            {str(name): (float(low), float(high)) for name, (low, high) in values["ranges"].items()},
            np.asarray(values["mean"], np.float64),
            np.asarray(values["deviation"], np.float64),
            int(values["windows"]),
        )
        numbers = [*found.mean, *found.deviation, *(value for pair in found.ranges.values() for value in pair)]
        if found.mean.shape != (bands,) or found.deviation.shape != (bands,) or not np.isfinite(numbers).all():
            raise ValueError("shapes or values")
        if not (found.deviation > 0).all() or "spectrum" not in found.ranges:
            raise ValueError("values")
    except (AttributeError, KeyError, TypeError, ValueError):
        raise InputError(f"{where}: is damaged; restore it, or delete it to go without its warnings.") from None
    return found


def range_of_speech(
    rows: Iterable[Float[np.ndarray, "T width"]],
    waveforms: Iterable[Float[np.ndarray, " N"]],
    mel: MelConfig,
    fps: float,
) -> SpeechRange | None:
    """The range of recordings; None if they have fewer than :data:`LEAST_WINDOWS` windows with speech.

    Args:
        rows: log-mel features of each, dB.
        waveforms: samples of some or all, for the pitch.
        mel: settings of the features.
        fps: rows per second.
    """
    spectra = [window_spectra(one, mel, fps) for one in rows]
    pitch = [window_pitch(one, mel.sample_rate) for one in waveforms]
    profiles = np.concatenate([one.profiles for one in spectra]) if spectra else np.zeros((0, mel.bands))
    if len(profiles) < LEAST_WINDOWS:
        return None
    mean, deviation = profiles.mean(axis=0), np.maximum(profiles.std(axis=0), 0.5)
    values = {name: np.concatenate([one.figures[name] for one in spectra]) for name in spectra[0].figures}
    values["spectrum"] = _distance(profiles, mean, deviation)
    if sum(map(len, pitch)) >= LEAST_WINDOWS:
        values["pitch"] = np.concatenate(pitch)
    ranges = {name: (float(low), float(high)) for name, (low, high) in _quantiles(values).items()}
    return SpeechRange(ranges, mean, deviation, len(profiles))


def _quantiles(values: dict[str, np.ndarray]) -> dict[str, Any]:
    return {name: np.quantile(values[name], QUANTILES) for name in _UNITS if name in values}


def _distance(
    profiles: Float[np.ndarray, "W bands"], mean: Float[np.ndarray, " bands"], deviation: Float[np.ndarray, " bands"]
) -> Float[np.ndarray, " W"]:
    """Root mean square over bands of the z-scores of spectra."""
    return np.sqrt(np.mean(np.square((profiles - mean) / deviation), axis=1))
