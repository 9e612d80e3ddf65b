"""Means, intervals and best samples of a candidate's scores over the clips of a split."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.evaluation.report_cells import counted
from a2g_jax.evaluation.scores import Metric, Scorer
from a2g_jax.metrics.intervals import LEAST, mean_interval, share_interval

Values = Float[np.ndarray, " clips"]


def sample_cells(
    scorer: Scorer,
    per_clip: Sequence[Sequence[dict[str, float]]],
    per_group: Sequence[dict[str, float]],
    recordings: Int[np.ndarray, " clips"],
) -> dict[str, dict[str, Any]]:
    """Means over samples, then over clips with intervals; and the best sample of each clip, averaged over clips.

    Args:
        per_clip: scores of every sample of every clip.
        per_group: scores of every clip's samples together.
        recordings: the recording of every clip: clips of one are not independent.
    """
    cells: dict[str, dict[str, Any]] = {}
    for metric in scorer.metrics:
        if metric.per_sample and (cell := _sample_cell(metric, per_clip, recordings)) is not None:
            cells[metric.key] = cell
    for metric in scorer.metrics:
        values = np.array([scores.get(metric.key, np.nan) for scores in per_group])
        if metric.scope == "clip" and not np.isnan(values).all():
            cells[metric.key] = {**interval_cell(metric, values, recordings), "best": None}
    return cells


def _sample_cell(
    metric: Metric, per_clip: Sequence[Sequence[dict[str, float]]], recordings: Int[np.ndarray, " clips"]
) -> dict[str, Any] | None:
    values = np.array([[scores.get(metric.key, np.nan) for scores in clip] for clip in per_clip])
    if np.isnan(values).all():
        return None
    # A clip too short for a metric has no value in any sample.
    there = ~np.isnan(values).all(axis=1)
    values = values[there]
    best = {"lower": np.nanmin, "higher": np.nanmax}.get(metric.better)
    return {
        **interval_cell(metric, np.nanmean(values, axis=1), recordings[there]),
        "best": None if best is None else float(np.nanmean(best(values, axis=1))),
    }


def interval_cell(metric: Metric, values: Values, recordings: Int[np.ndarray, " clips"]) -> dict[str, Any]:
    """``mean``, ``low`` and ``high``, the number of recordings as ``clips``, and where they are too few the ``reason``.

    Args:
        values: one for each clip.
        recordings: the recording of each clip.
    """
    if metric.outcome:
        there = ~np.isnan(values)
        _, owner = np.unique(recordings[there], return_inverse=True)
        found = share_interval(np.bincount(owner, values[there]), np.bincount(owner), whole=False)
    else:
        found = mean_interval(values, recordings)
    cell = found.to_json()
    if cell["low"] is None:
        return {**cell, "reason": too_few_recordings(found.clips)} if found.clips < LEAST else cell
    return {**cell, "low": max(cell["low"], metric.bounds[0]), "high": min(cell["high"], metric.bounds[1])}


def too_few_recordings(count: int) -> str:
    """Why there is no interval."""
    return f"{counted(count, 'recording')}: an interval needs {LEAST} or more"
