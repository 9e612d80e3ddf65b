"""Samples that callers pass as arrays."""

from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError


def mono_samples(audio: Any, where: str = "audio") -> Float[np.ndarray, " N"]:
    """Mono float32 samples; integers are scaled to -1 to 1.

    Args:
        audio: an array of numbers: (N,), or with one channel (N, 1) or (1, N).
        where: for error messages.

    Raises:
        InputError: several channels, another type, NaN or infinities.
    """
    array = np.asarray(audio)
    if array.ndim == 2 and 1 in array.shape:
        array = array.reshape(-1)
    if array.ndim == 2:
        across = int(np.argmin(array.shape))
        one = "audio[:, 0]" if across else "audio[0]"
        raise InputError(
            f"{where}: has shape {array.shape}, {array.shape[across]} channels, and one is expected; average them,"
            f" audio.mean(axis={across}), or choose one, {one}."
        )
    if array.ndim != 1 or array.dtype.kind not in "iuf":
        raise InputError(f"{where}: expected numbers of shape (N,); got {array.dtype} of shape {array.shape}.")
    if array.dtype.kind == "f":
        samples = array.astype(np.float32, copy=False)
        if not np.isfinite(samples).all():
            raise InputError(
                f"{where}: sample {int(np.argmin(np.isfinite(samples)))} is NaN or infinite; fix it first."
            )
        return samples
    half = 2.0 ** (8 * array.dtype.itemsize - 1)
    return ((array - (half if array.dtype.kind == "u" else 0.0)) / half).astype(np.float32)
