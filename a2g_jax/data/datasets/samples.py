"""Speech from arrays in archives."""

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.io.audio import FINE_SILENCE, SILENCE, resampled

#: Peak beyond which floating-point samples are in another unit than -1 to 1.
_LOUDEST = 100.0
_LOWEST_RATE, _HIGHEST_RATE = 1_000, 1_000_000


def speech_samples(samples: np.ndarray, rate: int, sample_rate: int, place: str) -> Float[np.ndarray, " N"]:
    """Mono float32 samples at ``sample_rate``, as :func:`~a2g_jax.io.audio.read_audio` gives them.

    Args:
        samples: one channel, signed integers of any width (scaled to -1 to 1) or floating-point numbers.
        rate: of the samples, Hz.
        place: for error messages: the file and the array.

    Raises:
        InputError: of another shape or type, empty, with NaN or infinities, silent, or not scaled to -1 to 1.
    """
    flat = samples.reshape(-1) if samples.ndim == 2 and 1 in samples.shape else samples
    if flat.ndim != 1 or flat.dtype.kind not in "if":
        raise InputError(f"{place}: expected one channel of samples; got {samples.dtype} of shape {samples.shape}.")
    if len(flat) == 0:
        raise InputError(f"{place}: holds no samples; leave this recording out.")
    if not _LOWEST_RATE <= rate <= _HIGHEST_RATE:
        raise InputError(f"{place}: has a sample rate of {rate} Hz; expected {_LOWEST_RATE} to {_HIGHEST_RATE}.")
    if flat.dtype.kind == "i":
        sound = (flat / float(2 ** (8 * flat.dtype.itemsize - 1))).astype(np.float32)
    else:
        sound = flat.astype(np.float32)
    finite = np.isfinite(sound)
    if not finite.all():
        raise InputError(f"{place}: holds NaN or infinity at {np.argmin(finite) / rate:.3f} s; leave it out.")
    peak = float(np.max(np.abs(sound)))
    if peak > _LOUDEST:
        raise InputError(f"{place}: has samples as large as {peak:.4g}; scale them to -1 to 1.")
    fine = flat.dtype.kind == "f" or flat.dtype.itemsize > 2
    limit, decibels = (FINE_SILENCE, -120) if fine else (SILENCE, -70)
    if peak < limit:
        raise InputError(f"{place}: is silent (its peak is below {decibels} dB of full scale); leave it out.")
    return resampled(sound, rate, sample_rate)
