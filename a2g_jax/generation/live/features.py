"""Log-mel features of speech that arrives in pieces."""

import numpy as np
from jaxtyping import Float
from scipy import fft, signal

from a2g_jax.features.mel import MelConfig
from a2g_jax.features.mel_filters import hann, mel_filters
from a2g_jax.generation.live.loudness import Loudness
from a2g_jax.generation.live.rates import Groups

#: Seconds of the groups in which samples are processed.
GROUP = 0.01
#: Time constant of the filter that removes a constant offset, seconds: a first-order high-pass at 3 Hz.
OFFSET = 0.05
#: dB of loud bands above the mean level of active speech.
_PEAK = 6.0
#: Time constant with which the loudest band falls back to that of speech at the target level, seconds.
_FORGET = 30.0


class LiveFeatures:
    """Rows of log-mel features, not normalised, as soon as their samples are there.

    As :func:`~a2g_jax.features.mel.log_mel`, with causal forms of what it finds out from a whole recording. The level
    is that of the speech so far (:class:`~a2g_jax.generation.live.loudness.Loudness`). A constant offset is removed by
    a high-pass of 3 Hz. The loudest band, from which the floor is measured, is the loudest so far; it starts at that of
    speech at the target level, and falls back to it with a time constant of 30 s.
    """

    def __init__(self, config: MelConfig, fps: float, sample_rate: int | float) -> None:
        """
        Args:
            fps: frames of the motion per second.
            sample_rate: of the samples that are pushed, Hz.

        Raises:
            InputError: a rate that no microphone has.
        """
        self.config, self.fps = config, fps
        group, self._piece = round(GROUP * config.sample_rate), int(sample_rate)
        self._resampler = Groups(sample_rate, config.sample_rate, group)
        pole = float(np.exp(-1.0 / (OFFSET * config.sample_rate)))
        self._high_pass = np.array([1.0, -1.0]) * (1.0 + pole) / 2.0, np.array([1.0, -pole])
        self._rest: Float[np.ndarray, " 1"] | None = None
        self._loudness = Loudness(config.sample_rate)
        self._half = config.window // 2
        self._hann = hann(config.window)
        bands = config.bands, config.low_hz, config.high_hz
        self._filters = mel_filters(config.sample_rate, config.window, *bands).T
        self._spectra = fps * config.stack
        self._hop = config.sample_rate / self._spectra
        level = -23.0 if config.level_db is None else config.level_db
        # Speech whose energy lies in one band: the sum of |X|^2 over the bins is 3/16 window^2 times its power.
        energy = 3 / 16 * config.window**2 * 10 ** ((level + _PEAK) / 10) * float(self._filters.max())
        self._usual = self._loudest = float(10 * np.log10(energy))
        self._made = 0
        self._row: list[Float[np.ndarray, " bands"]] = []
        #: Samples from number ``_first`` on; before sample 0 is silence.
        self._first, self._kept = -self._half, np.zeros(self._half, np.float32)
        self._metered = 0

    @property
    def latency(self) -> float:
        """Seconds of sound after the time of a frame that its row waits for, at most."""
        more = (self.config.stack - 1) / self._spectra
        resampling = self._resampler.latency
        return more + self._half / self.config.sample_rate + resampling

    @property
    def quiet(self) -> Float[np.ndarray, " width"]:
        """The row of silence before the first sample."""
        return np.full(self.config.width, max(-100.0, self._usual - self.config.range_db), np.float32)

    def push(self, samples: Float[np.ndarray, " N"]) -> list[Float[np.ndarray, " width"]]:
        """The rows that are complete after further samples."""
        rows = []
        # In pieces of a second, as a long push would be copied over and over.
        for start in range(0, len(samples), self._piece):
            for group in self._resampler.push(samples[start : start + self._piece]):
                rows.extend(self._grouped(group))
        return rows

    def _grouped(self, group: Float[np.ndarray, " N"]) -> list[Float[np.ndarray, " width"]]:
        # In double precision: the difference of nearly equal samples.
        numerator, denominator = self._high_pass
        if self._rest is None:
            # As after a long time at the first sample, so that an offset is no step.
            self._rest = signal.lfilter_zi(numerator, denominator) * float(group[0])
        centred, self._rest = signal.lfilter(numerator, denominator, group.astype(np.float64), zi=self._rest)
        # Without numbers so small that processors are slow with them.
        self._rest = np.where(np.abs(self._rest) < 1e-15, 0.0, self._rest)
        self._kept = np.concatenate([self._kept, centred.astype(np.float32)])
        end, size = self._first + len(self._kept), self._loudness.size
        while self._metered + size <= end:
            at = self._metered - self._first
            self._loudness.add(self._kept[at : at + size])
            self._metered += size
        rows = []
        while (centre := round(self._made * self._hop)) + self._half <= end:
            at = centre - self._half - self._first
            self._row.append(self._spectrum(self._kept[at : at + self.config.window]))
            self._made += 1
            if len(self._row) == self.config.stack:
                rows.append(np.concatenate(self._row))
                self._row = []
        begin = min(round(self._made * self._hop) - self._half, self._metered)
        if begin > self._first:
            self._kept, self._first = self._kept[begin - self._first :].copy(), begin
        return rows

    def _spectrum(self, window: Float[np.ndarray, " window"]) -> Float[np.ndarray, " bands"]:
        config = self.config
        spectrum = fft.rfft(window * self._hann)
        power = (spectrum.real**2 + spectrum.imag**2) @ self._filters
        gain = 0.0 if config.level_db is None else self._loudness.gain_db(config.level_db)
        decibels = 10 * np.log10(np.maximum(power * np.float32(10 ** (gain / 10)), 1e-10))
        fallen = self._usual + (self._loudest - self._usual) * float(np.exp(-1.0 / (_FORGET * self._spectra)))
        self._loudest = max(fallen, float(decibels.max()), self._usual)
        return np.asarray(np.maximum(decibels, max(-100.0, self._loudest - config.range_db)), np.float32)
