"""Waveforms in 16 bits, each recording at a scale that suits its peak.

A recording whose samples stay below 1/64 would keep fewer than 10 of the 16 bits, and one beyond full scale would be
clipped. Such recordings are multiplied by a power of two before they are stored, and divided by it when they are read.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int16

from a2g_jax.data.corpus_layout import Entry
from a2g_jax.io.stored_array import StoredArray

#: Peaks between these are stored as they are.
_LEAST, _FULL = 2.0**-6, 1.0


def scaled_waveform(audio: Float[np.ndarray, " N"], samples: int) -> tuple[Int16[np.ndarray, " n"], float]:
    """16-bit samples, padded with silence, and the power of two that they were multiplied by."""
    whole = np.zeros(samples, np.float32)
    whole[: len(audio)] = audio[:samples]
    peak = float(np.abs(whole).max(initial=0.0))
    gain = 1.0 if peak == 0.0 or _LEAST <= peak <= _FULL else 2.0 ** -math.ceil(math.log2(peak))
    return np.rint(np.clip(whole * np.float32(gain), -1.0, 1.0) * 32767.0).astype(np.int16), gain


class ScaledWaveform:
    """The waveforms of a corpus as float32 in units of 16-bit samples, divided by the recordings' gains.

    Args:
        stored: the 16-bit samples of all recordings.
        recordings: one after another.
    """

    dtype, ndim = np.dtype(np.float32), 1

    def __init__(self, stored: StoredArray, recordings: Sequence[Entry]) -> None:
        self._stored = stored
        self._firsts = [entry.first_sample for entry in recordings]
        self._gains = [entry.waveform_gain for entry in recordings]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of samples."""
        return self._stored.shape

    @property
    def nbytes(self) -> int:
        """Bytes of the values as they are read."""
        return 4 * len(self)

    def __len__(self) -> int:
        return len(self._stored)

    def __getitem__(self, index: int | slice) -> Any:
        if not isinstance(index, slice):
            at = range(len(self))[index]
            return self[at : at + 1][0]
        start, stop, step = index.indices(len(self))
        values = self._stored[start:stop].astype(np.float32)
        for number in range(bisect_right(self._firsts, start) - 1, bisect_left(self._firsts, stop)):
            end = self._firsts[number + 1] if number + 1 < len(self._firsts) else len(self)
            values[max(self._firsts[number] - start, 0) : max(end - start, 0)] /= np.float32(self._gains[number])
        return values[::step]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return self[:] if dtype is None else self[:].astype(dtype)
