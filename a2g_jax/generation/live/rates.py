"""Samples of a microphone at the rate of the features, in groups that do not depend on how they arrived."""

from functools import lru_cache

import numpy as np
import soxr
from jaxtyping import Float

from a2g_jax.errors import InputError

#: Rates of microphones that are taken, Hz.
LOWEST_RATE, HIGHEST_RATE = 8_000, 192_000
#: Seconds of silence, in steps of a millisecond, from which the delay of a resampler is found.
_PROBED, _STEP = 2.0, 0.001


class Groups:
    """Samples at another rate by soxr's stream, in groups of one size.

    Output ``n`` lies at time ``n / rate``. soxr's outputs do not depend on how the input was cut, to the last bit, and
    neither do the groups.
    """

    def __init__(self, from_rate: int | float, rate: int, group: int) -> None:
        """
        Args:
            from_rate: of the input, Hz, 8000 to 192000.
            rate: of the output, Hz.
            group: outputs of a group.

        Raises:
            InputError: another rate.
        """
        from_rate = check_rate(from_rate)
        self._stream = None if from_rate == rate else _stream(from_rate, rate)
        self._kept = np.zeros(0, np.float32)
        self.group = group
        #: Seconds of input after the first output of a group that it waits for.
        self.latency = (0.0 if self._stream is None else _delay(from_rate, rate)) + group / rate

    def push(self, samples: Float[np.ndarray, " N"]) -> list[Float[np.ndarray, " group"]]:
        """The groups of outputs that are complete after further samples."""
        made = samples if self._stream is None else self._stream.resample_chunk(np.ascontiguousarray(samples))
        joined = np.concatenate([self._kept, made])
        whole = len(joined) // self.group * self.group
        # A copy: a view would keep all of a long push alive.
        self._kept = joined[whole:].copy()
        return list(joined[:whole].reshape(-1, self.group))


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


def _stream(from_rate: int, rate: int) -> "soxr.ResampleStream":
    return soxr.ResampleStream(from_rate, rate, 1, dtype="float32", quality="HQ")


@lru_cache(maxsize=32)
def _delay(from_rate: int, rate: int) -> float:
    """Seconds between the time of an output and that of the last input that it waits for, at most.

    soxr filters in blocks whose length it does not tell; they are measured.
    """
    stream, step = _stream(from_rate, rate), max(1, round(_STEP * from_rate))
    silence = np.zeros(step, np.float32)
    made, longest = 0, 0.0
    for number in range(1, round(_PROBED * from_rate / step)):
        more = len(stream.resample_chunk(silence))
        if more:
            longest = max(longest, number * step / from_rate - made / rate)
        made += more
    return longest + step / from_rate
