"""Scores of sets of feature vectors: each with an interval over recordings, and distances beside their floor.

A Fréchet distance falls with the number of vectors, so a figure says little alone. Beside it stands what half of the
made motion scores against the other half of the truth, and what half of the truth scores there, the floor: both of the
same recordings and the same number of vectors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.evaluation.scores import Metric, Scorer
from a2g_jax.evaluation.summary import too_few_recordings
from a2g_jax.metrics.context import SetContext
from a2g_jax.metrics.distribution import LEAST_VECTORS, enough_vectors, halvings
from a2g_jax.metrics.intervals import LEAST
from a2g_jax.metrics.pooled import jackknife

#: Samples of a candidate from which the interval is computed, fewer for sets of more vectors than the second number,
#: whose silhouettes take seconds each; the value is the mean over all samples.
_SAMPLES, _MANY, _SAMPLES_OF_MANY = 4, 1000, 1
Vectors = Float[np.ndarray, "_ F"]


@dataclass(frozen=True, eq=False)
class Reference:
    """Feature vectors of the truth, clip after clip."""

    vectors: Vectors
    recordings: Int[np.ndarray, " n"]
    """The recording of each vector."""
    speakers: Int[np.ndarray, " n"]
    """The speaker of each vector, as a number."""
    seed: int
    """Seed of the halvings."""

    @classmethod
    def of(cls, clips: Sequence[Vectors], recordings: Sequence[int], speakers: Sequence[str], seed: int) -> "Reference":
        """The vectors of clips.

        Args:
            recordings: the number of each clip's recording.
            speakers: the speaker of each clip.
        """
        counts, numbers = [len(clip) for clip in clips], {name: n for n, name in enumerate(sorted(set(speakers)))}
        return cls(
            np.concatenate(list(clips)),
            np.repeat(np.asarray(recordings, int), counts),
            np.repeat([numbers[name] for name in speakers], counts).astype(int),
            seed,
        )

    @cached_property
    def halves(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Random halves, as rows; the same for all candidates."""
        return halvings(self.recordings, np.random.default_rng(self.seed))

    @cached_property
    def members(self) -> list[np.ndarray]:
        """Rows of each recording."""
        return [np.flatnonzero(self.recordings == one) for one in np.unique(self.recordings)]

    @property
    def enough(self) -> bool:
        """Whether they determine a covariance well enough for a Fréchet distance."""
        return enough_vectors(*self.vectors.shape)

    def shortage(self) -> str:
        """Why there is no Fréchet distance."""
        count, width = self.vectors.shape
        return (
            f"{count} feature vectors: a Fréchet distance needs {LEAST_VECTORS} or more for each of the {width}"
            f" features, {LEAST_VECTORS * width}"
        )


def set_cells(scorer: Scorer, features: Sequence[Sequence[Vectors]], reference: Reference) -> dict[str, dict[str, Any]]:
    """Cells of a report for the metrics of sets: one set for each sample number, as large as that of the truth.

    Beside ``mean``, ``low``, ``high`` (jackknife over recordings) and ``best``, a cell has ``vectors`` and
    ``features``, their number and length; a distance also ``halves``, ``floor`` and ``half_vectors``. Where vectors are
    too few for a distance, its values are None and ``reason`` says why.

    Args:
        features: vectors of every sample of every clip.
    """
    made = [np.concatenate([clip[sample] for clip in features]) for sample in range(len(features[0]))]
    cells = {}
    for metric in scorer.metrics:
        if metric.scope == "set" and (cell := set_cell(metric, made, reference)) is not None:
            cells[metric.key] = cell
    return cells


def set_cell(metric: Metric, made: Sequence[Vectors], reference: Reference) -> dict[str, Any] | None:
    """The cell of a metric of sets (:func:`set_cells`); None where it is not defined.

    Args:
        made: vectors of each sample, in the order of the reference.
    """
    if len(reference.vectors) == 0:
        return None
    count, width = reference.vectors.shape
    about = {"vectors": count, "features": width}
    if metric.distance and not reference.enough:
        empty = dict.fromkeys(("mean", "low", "high", "best"))
        return {**empty, "clips": len(reference.members), **about, "reason": reference.shortage()}
    every = np.arange(count)
    values = [_value(metric, one, reference, every) for one in made]
    if any(value is None for value in values):
        return None
    mean = float(np.mean(values))
    some = made[: _SAMPLES if count <= _MANY else _SAMPLES_OF_MANY]

    def left(chosen: Sequence[int]) -> float:
        rows = np.concatenate([reference.members[one] for one in chosen])
        return float(np.mean([_number(_value(metric, one, reference, rows)) for one in some]))

    found = jackknife(left, len(reference.members), mean).to_json()
    low, high = found["low"], found["high"]
    if low is not None and high is not None:
        low, high = max(low, metric.bounds[0]), min(high, metric.bounds[1])
    best = {"lower": min, "higher": max}.get(metric.better)
    cell = {"mean": found["mean"], "low": low, "high": high, "best": None if best is None else float(best(values))}
    cell |= {"clips": len(reference.members), **about}
    if found["mean"] is None:
        cell["reason"] = "a feature vector is not a number"
    elif len(reference.members) < LEAST:
        cell["reason"] = too_few_recordings(len(reference.members))
    if metric.distance:
        pairs = [(made[number % len(made)], rows) for number, rows in enumerate(reference.halves)]
        cell["halves"] = _mean_distance(metric, pairs, reference)
        cell["floor"] = floor_of(metric, reference)
        cell["half_vectors"] = len(reference.halves[0][0])
    return cell


def floor_of(metric: Metric, reference: Reference) -> float:
    """The distance of two halves of the truth, mean over random halvings."""
    return _mean_distance(metric, [(reference.vectors, rows) for rows in reference.halves], reference)


def halves_cell(metric: Metric, reference: Reference) -> dict[str, Any]:
    """The distance of two halves of the truth as a cell of a report; a dash with its reason for too few vectors."""
    cell: dict[str, Any] = dict.fromkeys(("mean", "low", "high", "best"))
    if not reference.enough:
        return {**cell, "reason": reference.shortage()}
    about = {"vectors": len(reference.halves[0][0]), "features": reference.vectors.shape[1]}
    return {**cell, "mean": floor_of(metric, reference), **about}


def _mean_distance(
    metric: Metric, pairs: Sequence[tuple[Vectors, tuple[np.ndarray, np.ndarray]]], reference: Reference
) -> float:
    values = [_value(metric, vectors, reference, first, second) for vectors, (first, second) in pairs]
    return float(np.mean([_number(value) for value in values]))


def _value(
    metric: Metric, made: Vectors, reference: Reference, rows: np.ndarray, others: np.ndarray | None = None
) -> Any:
    """The metric of rows of made motion against the same, or other, rows of the truth."""
    assert metric.function is not None
    target = reference.vectors[rows if others is None else others]
    return metric.function(SetContext(made[rows], target, reference.speakers[rows]))


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)
