"""The constant offset of samples, as of a microphone whose converter does not rest at zero."""

import numpy as np
from jaxtyping import Float

#: Length of a block, seconds.
_BLOCK = 0.025
#: Number of blocks below which an offset cannot be distinguished from the signal.
_FEWEST = 20
#: An offset is removed unless it is this many decibels below the level of speech. Smaller ones change motion by
#: 0.11 degrees at most (``demo`` and ``demo-flow``, three speeches), and ordinary recordings, most of whose offsets
#: are 60 to 100 dB below speech, keep their bits.
_BELOW = 55.0
#: Standard errors that an offset is away from zero; the mean of noise is not zero by chance.
_CERTAIN = 4.0


def sample_offset(audio: Float[np.ndarray, " N"], sample_rate: int) -> float:
    """The offset of samples: the median of the means of 25 ms blocks; 0 if it is too small to matter.

    The mean of all samples is not zero for speech, whose waveform is asymmetric. Blocks of digital silence do not
    count. Adding a constant to the samples adds it to the median.
    """
    size = max(1, int(_BLOCK * sample_rate))
    count = len(audio) // size
    if count < _FEWEST:
        return 0.0
    blocks = audio[: count * size].reshape(count, size)
    # In the precision of the samples: a sum of few values, in pairs.
    means = blocks.mean(axis=1)
    power = np.einsum("ij,ij->i", blocks, blocks) / size
    sounding = power > 0
    if not sounding.any():
        return 0.0
    rest = means[sounding]
    offset = float(np.median(rest))
    # Standard error of the median of a normal sample, from its median absolute deviation.
    error = 1.2533 * 1.4826 * float(np.median(np.abs(rest - offset))) / np.sqrt(len(rest))
    if offset == 0.0 or abs(offset) < _CERTAIN * error:
        return 0.0
    # Power around the offset, of the loud blocks.
    around = np.maximum(power[sounding] - 2 * offset * means[sounding] + offset**2, 0)
    loud = around[around >= np.percentile(around, 95) * 10**-2.5].mean()
    return offset if offset**2 > loud * 10 ** (-_BELOW / 10) else 0.0


def without_offset(audio: Float[np.ndarray, " N"], sample_rate: int) -> Float[np.ndarray, " N"]:
    """Samples around zero; the same array where there is no offset to remove. Digital silence stays silent.

    Args:
        audio: mono, floating-point.
    """
    offset = sample_offset(audio, sample_rate)
    if offset == 0.0:
        return audio
    moved = audio - audio.dtype.type(offset)
    size = max(1, int(_BLOCK * sample_rate))
    count = len(audio) // size
    silent = ~audio[: count * size].reshape(count, size).any(axis=1)
    moved[: count * size].reshape(count, size)[silent] = 0
    return moved
