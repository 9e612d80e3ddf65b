"""95 % confidence intervals of means over clips, by Student's t over independent recordings.

Clips of one recording depend on each other, so recordings are what is counted. The coverage, by simulation, is in
``experiments/results/interval_coverage``: 0.95 for normal values of any number, where the percentile bootstrap and BCa
reach 0.74 and 0.72 with 3; for log-normal ones 0.82 to 0.91 with 5 to 50, where these reach 0.73 to 0.91 and 0.74 to
0.91.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Shaped
from scipy import stats

#: Probability with which an interval is to hold the true mean.
LEVEL = 0.95
#: Fewest recordings (or clips, where each is a recording of its own) with an interval. Below, the spread itself is a
#: guess, and a skewed distribution shows no sign of its skew.
LEAST = 5


class Interval(NamedTuple):
    """A mean with its 95 % interval; the ends are NaN where there is none."""

    mean: float
    low: float
    high: float
    clips: int
    """Independent recordings (or clips, where each is a recording of its own)."""

    def to_json(self) -> dict[str, Any]:
        """The fields, with None for what is not finite."""
        return {key: value if np.isfinite(value) else None for key, value in self._asdict().items()}


def t_quantile(count: int) -> float:
    """Standard errors from the mean of ``count`` values to the ends of its interval."""
    return float(stats.t.ppf(0.5 + LEVEL / 2.0, count - 1))


def mean_interval(
    values: Float[np.ndarray, " clips"], groups: Shaped[np.ndarray, " clips"] | None = None, least: int = LEAST
) -> Interval:
    """Mean over clips, with its interval by Student's t; NaN values are ignored.

    With groups the standard error is that of a ratio of sums over groups (sandwich estimator, Cochran 1977, Sec. 6.13);
    where each has as many clips, it is that of the groups' means.

    Args:
        values: one for each clip.
        groups: the recording of each clip; None if each is one of its own.
        least: fewer groups have no interval.
    """
    values = np.asarray(values, np.float64)
    there = ~np.isnan(values)
    owners = np.arange(len(values)) if groups is None else np.asarray(groups)
    if not there.any():
        return Interval(float("nan"), float("nan"), float("nan"), 0)
    _, owner = np.unique(owners[there], return_inverse=True)
    # Relative to the mean, so that equal values have an interval of no width whatever their size.
    middle = float(values[there].mean())
    found = ratio_interval(np.bincount(owner, values[there] - middle), np.bincount(owner), least)
    return Interval(middle, middle + found.low, middle + found.high, found.clips)


def difference_interval(
    values: Float[np.ndarray, " clips"],
    others: Float[np.ndarray, " clips"],
    groups: Shaped[np.ndarray, " clips"] | None = None,
    least: int = LEAST,
) -> Interval:
    """Mean paired difference of two candidates on the same clips, with its interval: :func:`mean_interval`."""
    return mean_interval(np.asarray(values, np.float64) - np.asarray(others, np.float64), groups, least)


def ratio_interval(
    sums: Shaped[np.ndarray, " groups"], counts: Shaped[np.ndarray, " groups"], least: int = LEAST
) -> Interval:
    """Sums of all groups over their counts, with the interval by Student's t over groups."""
    sums, counts = np.asarray(sums, np.float64), np.asarray(counts, np.float64)
    ratio = float(sums.sum() / counts.sum())
    if len(sums) < max(least, 2):
        return Interval(ratio, float("nan"), float("nan"), len(sums))
    half = t_quantile(len(sums)) * _standard_error(sums, counts, ratio)
    return Interval(ratio, ratio - half, ratio + half, len(sums))


def share_interval(
    hits: Shaped[np.ndarray, " groups"],
    counts: Shaped[np.ndarray, " groups"],
    least: int = LEAST,
    whole: bool = True,
) -> Interval:
    """Hits of all groups over their counts, with the score interval (Wilson 1927) for groups that depend within.

    The number in Wilson's formula is the effective one, ``p (1 - p)`` over the squared standard error over groups, from
    the number of groups up to the number of clips; its quantile is Student's. So the interval stays within 0 and 1, and
    has a width where all clips are hits.

    Args:
        hits: of each group; a fraction where clips count in part.
        counts: clips of each group.
        least: fewer groups have no interval.
        whole: whether hits are whole clips; otherwise the effective number is not bounded by that of clips.
    """
    hits, counts = np.asarray(hits, np.float64), np.asarray(counts, np.float64)
    groups, share = len(hits), float(hits.sum() / counts.sum())
    if groups < max(least, 2):
        return Interval(share, float("nan"), float("nan"), groups)
    error = _standard_error(hits, counts, share)
    effective, variance = float(groups), share * (1.0 - share)
    if variance > 0.0:
        most = max(float(counts.sum()), groups) if whole else np.inf
        effective = min(max(variance / max(error**2, 1e-300), groups), most)
    square = t_quantile(groups) ** 2
    middle = (share + square / (2.0 * effective)) / (1.0 + square / effective)
    half = np.sqrt(square * (variance / effective + square / (4.0 * effective**2))) / (1.0 + square / effective)
    return Interval(share, max(0.0, float(middle - half)), min(1.0, float(middle + half)), groups)


def _standard_error(sums: Float[np.ndarray, " groups"], counts: Float[np.ndarray, " groups"], ratio: float) -> float:
    """Standard error of a ratio of sums over independent groups."""
    groups = len(sums)
    residuals = (sums - ratio * counts) / counts.mean()
    return float(np.sqrt(np.square(residuals).sum() / (groups * (groups - 1))))
