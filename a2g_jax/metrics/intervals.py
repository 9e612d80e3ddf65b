"""Confidence intervals of means over clips."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int


class Interval(NamedTuple):
    """A mean with its 95 % interval."""

    mean: float
    low: float
    high: float
    clips: int


def bootstrap_mean(values: Float[np.ndarray, " clips"], rng: np.random.Generator, draws: int = 2000) -> Interval:
    """Mean over clips with the 95 % interval of the percentile bootstrap; NaN values are ignored.

    The interval of a single clip is NaN.
    """
    values = np.asarray(values, np.float64)
    values = values[~np.isnan(values)]
    if len(values) == 0:
        return Interval(float("nan"), float("nan"), float("nan"), 0)
    if len(values) == 1:
        return Interval(float(values[0]), float("nan"), float("nan"), 1)
    means = values[rng.integers(0, len(values), (draws, len(values)))].mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return Interval(float(values.mean()), float(low), float(high), len(values))


def bootstrap_ratio(
    hits: Int[np.ndarray, " groups"], counts: Int[np.ndarray, " groups"], rng: np.random.Generator, draws: int = 2000
) -> Interval:
    """Hits of all groups over their counts, with the 95 % interval of the percentile bootstrap over groups.

    The interval of a single group is NaN.
    """
    hits, counts = np.asarray(hits, np.float64), np.asarray(counts, np.float64)
    ratio = float(hits.sum() / counts.sum())
    if len(hits) == 1:
        return Interval(ratio, float("nan"), float("nan"), 1)
    chosen = rng.integers(0, len(hits), (draws, len(hits)))
    low, high = np.percentile(hits[chosen].sum(axis=1) / counts[chosen].sum(axis=1), [2.5, 97.5])
    return Interval(ratio, float(low), float(high), len(hits))


def bootstrap_difference(
    values: Float[np.ndarray, " clips"],
    others: Float[np.ndarray, " clips"],
    rng: np.random.Generator,
    draws: int = 2000,
) -> Interval:
    """Mean paired difference of two candidates on the same clips, with its interval."""
    return bootstrap_mean(np.asarray(values, np.float64) - np.asarray(others, np.float64), rng, draws)
