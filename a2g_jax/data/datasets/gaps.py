"""Frames that a pose estimator lost, and the rate of frames that a file gives times for."""

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError

#: Longest time, seconds, over which a lost point is carried on in a straight line.
LONGEST_GAP = 0.5
_WHOLE = (10.0, 12.0, 15.0, 20.0, 24.0, 25.0, 30.0, 50.0, 60.0, 120.0)
_BROKEN = (12.5, 15000 / 1001, 24000 / 1001, 30000 / 1001, 60000 / 1001)


def bridge_gaps(values: Float[np.ndarray, "T P D"], fps: float, place: str) -> Float[np.ndarray, "T P D"]:
    """Values with lost ones (NaN or infinity in any coordinate of a point) filled in.

    A gap of up to half a second is a straight line from the last value to the next; at the start and the end the
    nearest value stands still. Longer gaps say that there is no pose to learn from.

    Args:
        place: what errors name: the file and the recording in it.

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
            f"{place}, frame {frame}: point or bone {point} has no value for {longest / fps:.2f} s (the most that is"
            f" bridged is {LONGEST_GAP} s); leave this recording out."
        )
    start, end = np.where(before < 0, after, before), np.where(after == frames, before, after)
    share = ((at - start) / np.maximum(end - start, 1))[..., None]
    low, high = (np.take_along_axis(values, index[..., None], axis=0) for index in (start, end))
    return np.where(lost[..., None], (1.0 - share) * low + share * high, values).astype(values.dtype)


def rate_of(frames: int, seconds: float, slack: float) -> float:
    """Frames a second of ``frames`` that last ``seconds``: the usual rate that fits, else their quotient.

    Args:
        slack: frames by which the count may be off; whole rates are taken before 29.97 and the like.
    """
    for usual in (_WHOLE, _BROKEN):
        nearest = min(usual, key=lambda rate: abs(frames - seconds * rate))
        if abs(frames - seconds * nearest) <= slack:
            return nearest
    return frames / seconds
