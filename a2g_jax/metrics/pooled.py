"""Statistics pooled over recordings, with intervals: quantiles and means of all frames, and any statistic of a set.

Frames of one recording depend on each other, so that whole recordings are drawn again, or left out.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.metrics.intervals import Interval

Values = Float[np.ndarray, " _"]

#: Draws of the bootstrap.
DRAWS = 400


def _draws(groups: int, rng: np.random.Generator, draws: int) -> Int[np.ndarray, "draws groups"]:
    """How often each group occurs in each draw."""
    return rng.multinomial(groups, np.full(groups, 1.0 / groups), size=draws)


def _interval(value: float, drawn: Values, groups: int) -> Interval:
    if groups < 2:
        return Interval(value, float("nan"), float("nan"), groups)
    low, high = np.nanpercentile(drawn, [2.5, 97.5])
    return Interval(value, float(low), float(high), groups)


def pooled_quantile(groups: Sequence[Values], share: float, rng: np.random.Generator, draws: int = DRAWS) -> Interval:
    """Quantile of the values of all groups together, with the 95 % interval of a bootstrap over groups.

    The quantile is the smallest value with at least ``share`` of all values at or below it.

    Args:
        groups: values of each recording.
        share: 0 to 1.
    """
    filled = [np.asarray(group, np.float64) for group in groups if len(group)]
    if not filled:
        return Interval(float("nan"), float("nan"), float("nan"), 0)
    values = np.concatenate(filled)
    order = np.argsort(values, kind="stable")
    values, owner = values[order], np.repeat(np.arange(len(filled)), [len(group) for group in filled])[order]

    def quantile(weights: Int[np.ndarray, " groups"]) -> float:
        total = np.cumsum(weights[owner])
        return float(values[np.searchsorted(total, share * total[-1])])

    once = quantile(np.ones(len(filled), np.int64))
    drawn = [quantile(weights) for weights in _draws(len(filled), rng, draws)] if len(filled) > 1 else []
    return _interval(once, np.array(drawn), len(filled))


def pooled_mean(groups: Sequence[Values], rng: np.random.Generator, draws: int = DRAWS) -> Interval:
    """Mean of the values of all groups together, with the 95 % interval of a bootstrap over groups.

    Groups count by their numbers of values; :func:`~a2g_jax.metrics.intervals.bootstrap_mean` weights all alike.
    """
    filled = [np.asarray(group, np.float64) for group in groups if len(group)]
    if not filled:
        return Interval(float("nan"), float("nan"), float("nan"), 0)
    sums, counts = np.array([group.sum() for group in filled]), np.array([len(group) for group in filled])
    weights = _draws(len(filled), rng, draws)
    return _interval(float(sums.sum() / counts.sum()), (weights @ sums) / (weights @ counts), len(filled))


def jackknife(statistic: Callable[[Sequence[int]], float], groups: int) -> Interval:
    """A statistic of a set with the 95 % interval of the jackknife: value -+ 1.96 standard errors.

    For statistics such as the Fréchet distance that repeated recordings of a bootstrap would bias.

    Args:
        statistic: the value for the groups of these numbers.
        groups: number of groups.
    """
    value = statistic(range(groups))
    if groups < 3:
        return Interval(value, float("nan"), float("nan"), groups)
    left_out = np.array([statistic([one for one in range(groups) if one != out]) for out in range(groups)])
    error = np.sqrt((groups - 1) / groups * np.square(left_out - left_out.mean()).sum())
    return Interval(value, float(value - 1.96 * error), float(value + 1.96 * error), groups)
