"""Statistics pooled over recordings, with intervals: quantiles and means of all frames, and any statistic of a set.

Frames of one recording depend on each other, so recordings are what is counted. Fewer than
:data:`~a2g_jax.metrics.intervals.LEAST` have no interval.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.metrics.intervals import LEAST, Interval, ratio_interval, share_interval, t_quantile

Values = Float[np.ndarray, " _"]

#: Most parts that :func:`jackknife` leaves out one after another.
MOST_PARTS = 20
_NOTHING = Interval(float("nan"), float("nan"), float("nan"), 0)


def pooled_quantile(groups: Sequence[Values], share: float) -> Interval:
    """Quantile of the values of all groups together, with its 95 % interval over groups.

    The quantile is the smallest value with at least ``share`` of all values at or below it. Its interval is that of the
    share of values at or below it (:func:`~a2g_jax.metrics.intervals.share_interval`), read as values (Woodruff 1952).

    Args:
        groups: values of each recording.
        share: 0 to 1.
    """
    filled = [np.asarray(group, np.float64) for group in groups if len(group)]
    if not filled:
        return _NOTHING
    values = np.sort(np.concatenate(filled))

    def quantile(part: float) -> float:
        # The tolerance is for shares such as 0.3 * 10, which is more than 3 by rounding.
        place = int(np.ceil(part * len(values) * (1.0 - 1e-12))) - 1
        return float(values[min(max(place, 0), len(values) - 1)])

    once = quantile(share)
    below = share_interval(
        np.array([np.sum(group <= once) for group in filled]), np.array([len(group) for group in filled])
    )
    if np.isnan(below.low):
        return Interval(once, float("nan"), float("nan"), len(filled))
    # More than that share of the values may be at or below it, where values are equal.
    low, high = (quantile(share + end - below.mean) for end in (below.low, below.high))
    return Interval(once, min(low, once), max(high, once), len(filled))


def pooled_mean(groups: Sequence[Values]) -> Interval:
    """Mean of the values of all groups together, with its 95 % interval over groups.

    Groups count by their numbers of values; :func:`~a2g_jax.metrics.intervals.mean_interval` of their means weights all
    alike.
    """
    filled = [np.asarray(group, np.float64) for group in groups if len(group)]
    if not filled:
        return _NOTHING
    return ratio_interval(np.array([group.sum() for group in filled]), np.array([len(group) for group in filled]))


def jackknife(
    statistic: Callable[[Sequence[int]], float], groups: int, value: float | None = None, least: int = LEAST
) -> Interval:
    """A statistic of a set of groups, with the 95 % interval by the jackknife and Student's t.

    Groups are left out one after another, in parts of equal size where there are more than :data:`MOST_PARTS`. For
    statistics such as the Fréchet distance: a bootstrap draws groups twice, which lowers the rank of a covariance and
    raises the distance. The interval is that of the statistic at this number of groups, with its bias for that number.

    Args:
        statistic: the value for the groups of these numbers.
        groups: number of groups.
        value: the value for all groups where it is known.
        least: fewer groups have no interval.
    """
    once = statistic(range(groups)) if value is None else value
    if groups < max(least, 2):
        return Interval(once, float("nan"), float("nan"), groups)
    parts = min(groups, MOST_PARTS)
    part = np.arange(groups) % parts
    left_out = np.array([statistic(np.flatnonzero(part != out).tolist()) for out in range(parts)])
    error = np.sqrt((parts - 1) / parts * np.square(left_out - left_out.mean()).sum())
    half = float(t_quantile(parts) * error)
    return Interval(once, once - half, once + half, groups)
