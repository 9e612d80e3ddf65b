"""Means, intervals and best samples of a candidate's scores over the clips of a split."""

from typing import Any

import numpy as np

from a2g_jax.evaluation.scores import METRICS, Metric, Scorer
from a2g_jax.metrics.context import SetContext
from a2g_jax.metrics.intervals import bootstrap_mean


def summarise(
    scorer: Scorer,
    per_clip: list[list[dict[str, float]]],
    per_group: list[dict[str, float]],
    features: list[list[np.ndarray]],
    reference: np.ndarray,
    speakers: list[str],
    seed: int,
) -> dict[str, dict[str, Any]]:
    """Means over samples, then over clips with intervals; and the best sample of each clip, averaged over clips.

    Args:
        per_clip: scores of every sample of every clip.
        per_group: scores of every clip's samples together.
        features: feature vectors of every sample of every clip.
        reference: feature vectors of the truth.
        speakers: the speaker of every clip.
        seed: seed of the bootstrap.
    """
    # Metrics of this package first, so that others do not change their bootstrap draws.
    rng = np.random.default_rng(seed)
    own, extra = tuple(METRICS.values()), scorer.extra_metrics
    summary: dict[str, dict[str, Any]] = {}
    for metrics in (own, extra):
        for metric in metrics:
            if metric.per_sample and (cell := _sample_cell(metric, per_clip, rng)) is not None:
                summary[metric.key] = cell
        for metric in metrics:
            values = np.array([scores.get(metric.key, np.nan) for scores in per_group])
            if metric.scope == "clip" and not np.isnan(values).all():
                summary[metric.key] = {**bootstrap_mean(values, rng)._asdict(), "best": None}
    return summary | _set_cells(scorer, features, reference, speakers)


def _sample_cell(
    metric: Metric, per_clip: list[list[dict[str, float]]], rng: np.random.Generator
) -> dict[str, Any] | None:
    values = np.array([[scores.get(metric.key, np.nan) for scores in clip] for clip in per_clip])
    if np.isnan(values).all():
        return None
    # A clip too short for a metric has no value in any sample.
    values = values[~np.isnan(values).all(axis=1)]
    interval = bootstrap_mean(np.nanmean(values, axis=1), rng)
    best = {"lower": np.nanmin, "higher": np.nanmax}.get(metric.better)
    return {
        "mean": interval.mean,
        "low": interval.low,
        "high": interval.high,
        "best": None if best is None else float(np.nanmean(best(values, axis=1))),
    }


def _set_cells(
    scorer: Scorer, features: list[list[np.ndarray]], reference: np.ndarray, speakers: list[str]
) -> dict[str, dict[str, Any]]:
    """One set of vectors for each sample number, over all clips, so that there are as many as of the truth.

    Each cell states the number of vectors in a set and of their features.
    """
    numbers = {name: number for number, name in enumerate(sorted(set(speakers)))}
    sets = []
    for sample in range(len(features[0])):
        labels = [np.full(len(clip[sample]), numbers[name]) for clip, name in zip(features, speakers, strict=True)]
        vectors = np.concatenate([clip[sample] for clip in features])
        sets.append(scorer.set_scores(SetContext(vectors, reference, np.concatenate(labels))))
    cells = {}
    number, width = sum(len(clip[0]) for clip in features), reference.shape[1]
    for metric in scorer.metrics:
        values = [scores[metric.key] for scores in sets if metric.key in scores]
        if metric.scope == "set" and len(values) == len(sets):
            best = {"lower": min, "higher": max}.get(metric.better)
            cells[metric.key] = {
                "mean": float(np.mean(values)),
                "low": None,
                "high": None,
                "best": None if best is None else float(best(values)),
                "vectors": number,
                "features": width,
            }
    return cells
