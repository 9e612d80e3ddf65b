"""Gaps in estimated poses, and frame rates from numbers of frames and durations."""

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError

#: Longest gap, seconds, that is interpolated.
LONGEST_GAP = 0.5
_WHOLE = (10.0, 12.0, 15.0, 20.0, 24.0, 25.0, 30.0, 50.0, 60.0, 120.0)
_BROKEN = (12.5, 15000 / 1001, 24000 / 1001, 30000 / 1001, 60000 / 1001)


def bridge_gaps(values: Float[np.ndarray, "T P D"], fps: float, place: str) -> Float[np.ndarray, "T P D"]:
    """Values with gaps (NaN or infinity in any coordinate of a point) filled in.

    A gap of up to half a second is interpolated linearly; at the start and the end the nearest value is repeated.
    Longer gaps leave no pose to learn from.

    Args:
        place: for error messages: the file and the recording in it.

    Raises:
        InputError: a longer gap; the message names the point, the frame and the time.
    """
    frames = len(values)
    lost = ~np.all(np.isfinite(values), axis=-1)
    if not lost.any():
        return values
    at = np.arange(frames)[:, None]
    before = np.maximum.accumulate(np.where(lost, -1, at), axis=0)
    after = np.minimum.accumulate(np.where(lost, frames, at)[::-1], axis=0)[::-1]
    lengths = np.where(lost, after - before - 1, 0)
    frame, point = (int(place) for place in np.unravel_index(np.argmax(lengths), lengths.shape))
    longest = int(lengths[frame, point])
    if longest == frames or longest > LONGEST_GAP * fps:
        raise InputError(
            f"{place}, frame {frame}: point or bone {point} has no value for {longest / fps:.2f} s (at most"
            f" {LONGEST_GAP} s are bridged); leave this recording out."
        )
    start, end = np.where(before < 0, after, before), np.where(after == frames, before, after)
    share = ((at - start) / np.maximum(end - start, 1))[..., None]
    low, high = (np.take_along_axis(values, index[..., None], axis=0) for index in (start, end))
    return np.where(lost[..., None], (1.0 - share) * low + share * high, values).astype(values.dtype)


def rate_of(frames: int, seconds: float, slack: float) -> float:
    """Frame rate of ``frames`` that last ``seconds``: the usual rate that fits, else their quotient.

    Args:
        slack: tolerance in frames; whole rates are preferred to 29.97 and the like.
    """
    for usual in (_WHOLE, _BROKEN):
        nearest = min(usual, key=lambda rate: abs(frames - seconds * rate))
        if abs(frames - seconds * nearest) <= slack:
            return nearest
    return frames / seconds
