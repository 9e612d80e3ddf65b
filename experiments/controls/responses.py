"""How far motion follows requests, and what else changes with them."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.features.hand_properties import PROPERTIES
from a2g_jax.metrics.intervals import mean_interval
from experiments.controls.subject import SECONDS, Figures, Subject, by_speech, column

#: Requested quantiles; slopes are between the first and the last, at the 10th and the 90th percentile of people.
QUANTILES = (0.1, 0.3, 0.5, 0.7, 0.9)
#: Seconds and quantiles of the curve that rises and falls.
CURVE = ((0.0, 0.1), (7.5, 0.9), (15.0, 0.1), (22.5, 0.9), (29.9, 0.1))
#: Seconds around a peak or valley of the curve in which the response to it is measured.
AROUND = 4.0


def responses(
    subject: Subject, spread: Float[np.ndarray, " 5"], report: Callable[[], None] = lambda: None
) -> dict[str, Any]:
    """Responses of a run to each of its controls.

    Args:
        spread: distance between the 10th and the 90th percentile of true motion, for each property.
        report: called after each request.
    """
    free = subject.measure(())
    report()
    found: dict[str, Any] = {"free": about(free, subject.draws)}
    found["controls"] = {name: _response(subject, name, free, spread, report) for name in subject.names}
    return found


def _response(
    subject: Subject, name: str, free: Sequence[Figures], spread: Float[np.ndarray, " 5"], report: Callable[[], None]
) -> dict[str, Any]:
    requested = np.quantile(subject.training[name], QUANTILES)
    made = []
    for quantile in QUANTILES:
        made.append(subject.measure([f"{name}={quantile:g}"]))
        report()
    change = by_speech(column(made[-1], name) - column(made[0], name), subject.draws) / (requested[-1] - requested[0])
    sides = {
        other: float(np.mean(column(made[-1], other) - column(made[0], other)) / spread[PROPERTIES.index(other)])
        for other in PROPERTIES
    }
    return {
        "requested": requested.tolist(),
        "arrived": [interval(by_speech(column(one, name), subject.draws)) for one in made],
        "slope": interval(change),
        "slope_by_draw": change.mean(axis=0).tolist(),
        "side_effects": sides,
        "agreement": [interval(by_speech(_agreement(one), subject.draws)) for one in made],
        "agreement_excess": [interval(by_speech(_excess(one), subject.draws)) for one in made],
        "excess_change": [interval(by_speech(_excess(one) - _excess(free), subject.draws)) for one in made],
        "jerk_p99": [_quantile_of_jerk(one, 0.99) for one in made],
        "curve": _curve(subject, name, made, report),
    }


def _curve(
    subject: Subject, name: str, constant: Sequence[Sequence[Figures]], report: Callable[[], None]
) -> dict[str, Any]:
    """Response to a curve that rises and falls, and its jerk beside that of constant requests."""
    line = f"{name}=" + ",".join(f"{value:g}@{second:g}" for second, value in CURVE)
    fps, index = subject.run.config.fps, PROPERTIES.index(name)
    reach = round(0.5 * AROUND * fps)
    jerks, high, low = [], [], []
    for _, rows in subject.rows([line]):
        jerks.append(subject.ruler.jerk(rows))
        inside = [(round(at * fps) - reach, value) for at, value in CURVE if AROUND < at < SECONDS - AROUND]
        local = [(subject.ruler.properties(rows[at : at + 2 * reach])[index], value) for at, value in inside]
        high.append(np.mean([found for found, value in local if value > 0.5]))
        low.append(np.mean([found for found, value in local if value < 0.5]))
    report()
    seconds = np.linspace(-0.5 * AROUND, 0.5 * AROUND, 101)
    around = lambda middle: np.interp(middle + seconds, *zip(*CURVE, strict=True))  # noqa: E731
    mean = lambda middle: np.mean(np.quantile(subject.training[name], around(middle)))  # noqa: E731
    change = by_speech(np.array(high) - np.array(low), subject.draws) / (mean(7.5) - mean(15.0))
    return {
        "line": line,
        "slope": interval(change),
        "jerk_p99": float(np.quantile(np.concatenate(jerks), 0.99)),
        "jerk_p999": float(np.quantile(np.concatenate(jerks), 0.999)),
        "constant_jerk_p99": max(_quantile_of_jerk(one, 0.99) for one in constant),
        "constant_jerk_p999": max(_quantile_of_jerk(one, 0.999) for one in constant),
    }


def about(figures: Sequence[Figures], draws: int) -> dict[str, Any]:
    """Means of motions of one kind."""
    return {
        "properties": {name: float(np.mean(column(figures, name))) for name in PROPERTIES},
        "agreement": interval(by_speech(_agreement(figures), draws)),
        "agreement_excess": interval(by_speech(_excess(figures), draws)),
        "jerk_p99": _quantile_of_jerk(figures, 0.99),
        "jerk_p999": _quantile_of_jerk(figures, 0.999),
    }


def interval(values: Float[np.ndarray, "S draws"]) -> dict[str, float | None]:
    """Mean, and its 95 % interval over speeches, whose draws are averaged first: they are not independent."""
    found = mean_interval(values.mean(axis=1)).to_json()
    return {"mean": found["mean"], "low": found["low"], "high": found["high"]}


def _agreement(figures: Sequence[Figures]) -> Float[np.ndarray, " N"]:
    return np.array([one.agreement for one in figures])


def _excess(figures: Sequence[Figures]) -> Float[np.ndarray, " N"]:
    return np.array([one.excess for one in figures])


def _quantile_of_jerk(figures: Sequence[Figures], share: float) -> float:
    return float(np.quantile(np.concatenate([one.jerk for one in figures]), share))
