"""Resampling of samples that arrive in pieces of any size."""

from math import gcd

import numpy as np
from jaxtyping import Float
from scipy.special import i0

from a2g_jax.errors import InputError

#: Rates of microphones that are taken, Hz.
LOWEST_RATE, HIGHEST_RATE = 8_000, 192_000
#: Zero crossings of the sinc on either side, Kaiser's shape, and the cutoff as a share of the lower Nyquist frequency:
#: flat to 0.1 dB up to 85 % of it, and 60 dB down from 106 % on.
_CROSSINGS, _SHAPE, _CUTOFF = 24, 6.5, 0.95


class Resampler:
    """Samples at another rate, by a windowed sinc (polyphase FIR) whose state is the last few samples.

    Output ``n`` lies at time ``n / rate``. Outputs come in groups of ``group``, always the same ones, so that they do
    not depend on how the input was cut, to the last bit.
    """

    def __init__(self, from_rate: int | float, rate: int, group: int) -> None:
        """
        Args:
            from_rate: of the input, Hz, 8000 to 192000.
            rate: of the output, Hz.
            group: outputs that are computed together.

        Raises:
            InputError: another rate.
        """
        from_rate = check_rate(from_rate)
        divisor = gcd(from_rate, rate)
        self._up, self._down, self.group = rate // divisor, from_rate // divisor, group
        self._from_rate, self._rate = from_rate, rate
        #: Input samples on either side of an output.
        self.reach = 0 if from_rate == rate else -(-_CROSSINGS * from_rate // min(from_rate, rate))
        self._filters = self._kernels()
        self._made = 0
        #: Input from sample number ``_first`` on; before sample 0 is silence.
        self._first, self._kept = -self.reach, np.zeros(self.reach, np.float32)

    def push(self, samples: Float[np.ndarray, " N"]) -> list[Float[np.ndarray, " group"]]:
        """The groups of outputs that are complete after further samples."""
        self._kept = np.concatenate([self._kept, samples])
        groups = []
        while (found := self._next()) is not None:
            groups.append(found)
        return groups

    @property
    def latency(self) -> float:
        """Seconds of input after the first output of a group that it waits for."""
        return self.reach / self._from_rate + self.group / self._rate

    def _next(self) -> Float[np.ndarray, " group"] | None:
        position = (self._made + np.arange(self.group, dtype=np.int64)) * self._down
        centre, phase = position // self._up, position % self._up
        if centre[-1] + self.reach >= self._first + len(self._kept):
            return None
        taps = centre[:, None] - self._first + np.arange(-self.reach, self.reach + 1)[None]
        made = np.einsum("nk,nk->n", self._kept[taps], self._filters[phase])
        self._made += self.group
        first = self._made * self._down // self._up - self.reach
        # A copy: a view would keep all of a long push alive.
        self._kept, self._first = self._kept[first - self._first :].copy(), first
        return np.asarray(made, np.float32)

    def _kernels(self) -> Float[np.ndarray, "phases taps"]:
        if self.reach == 0:
            return np.ones((1, 1), np.float32)
        cutoff = _CUTOFF * min(1.0, self._rate / self._from_rate)
        tap, phase = np.arange(-self.reach, self.reach + 1)[None], np.arange(self._up)[:, None] / self._up
        time = tap - phase
        inside = np.sqrt(np.maximum(1.0 - (time / self.reach) ** 2, 0.0))
        filters = cutoff * np.sinc(cutoff * time) * i0(_SHAPE * inside) / i0(_SHAPE)
        return np.asarray(filters / filters.sum(axis=1, keepdims=True), np.float32)


def check_rate(rate: int | float) -> int:
    """A sample rate of a microphone as a whole number.

    Raises:
        InputError: not a whole number from 8000 to 192000.
    """
    if isinstance(rate, bool) or not LOWEST_RATE <= rate <= HIGHEST_RATE or rate != int(rate):
        raise InputError(
            f"sample_rate: expected a whole number from {LOWEST_RATE} to {HIGHEST_RATE} Hz, the rate of the samples"
            f" that are pushed; got {rate}."
        )
    return int(rate)
