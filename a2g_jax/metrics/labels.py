"""Metrics with labels: emotion accuracy, and the grouping of speakers or styles in a latent space."""

import numpy as np
from jaxtyping import Float, Int

Points = Float[np.ndarray, "n F"]
Labels = Int[np.ndarray, " n"]


def emotion_accuracy(logits: Float[np.ndarray, "n K"], labels: Labels) -> float:
    """Share of clips whose own emotion a trained classifier finds most probable (EmotionGesture's EA)."""
    return float(np.mean(np.argmax(logits, axis=-1) == labels))


def confusion(logits: Float[np.ndarray, "n K"], labels: Labels) -> Int[np.ndarray, "K K"]:
    """Confusion matrix: counts of clips by true (rows) and predicted (columns) emotion."""
    table = np.zeros((logits.shape[1],) * 2, np.int64)
    np.add.at(table, (labels, np.argmax(logits, axis=-1)), 1)
    return table


def calinski_harabasz(points: Points, labels: Labels) -> float:
    """Calinski-Harabasz index: variance between groups over variance within (the flow paper's Table 3).

    Raises:
        ValueError: fewer than two groups, or as many groups as points.
    """
    points, groups = np.asarray(points, np.float64), _groups(labels)
    middle = points.mean(axis=0)
    between = within = 0.0
    for group in groups:
        members = points[labels == group]
        between += len(members) * np.sum((members.mean(axis=0) - middle) ** 2)
        within += np.sum((members - members.mean(axis=0)) ** 2)
    if within == 0.0:
        return 1.0
    return float(between * (len(points) - len(groups)) / (within * (len(groups) - 1)))


def silhouette(points: Points, labels: Labels) -> float:
    """Mean over points of ``(b - a) / max(a, b)``: a the mean distance to its own group, b to the nearest other one.

    The only point of a group counts 0. Memory grows with the square of the number of points.

    Raises:
        ValueError: fewer than two groups, or as many groups as points.
    """
    points, groups = np.asarray(points, np.float64), _groups(labels)
    squares = np.sum(points**2, axis=1)
    distance = np.sqrt(np.maximum(squares[:, None] + squares[None] - 2.0 * points @ points.T, 0.0))
    np.fill_diagonal(distance, 0.0)
    member = labels[:, None] == groups[None]
    counts = member.sum(axis=0)
    sums = distance @ member
    own = np.argmax(member, axis=1)
    rows = np.arange(len(points))
    inner = sums[rows, own] / np.maximum(counts[own] - 1, 1)
    means = sums / counts[None]
    means[rows, own] = np.inf
    outer = means.min(axis=1)
    score = (outer - inner) / np.maximum(np.maximum(inner, outer), 1e-300)
    return float(np.mean(np.where(counts[own] > 1, score, 0.0)))


def _groups(labels: Labels) -> Int[np.ndarray, " K"]:
    groups = np.unique(labels)
    if not 2 <= len(groups) < len(labels):
        raise ValueError(f"expected 2 to {len(labels) - 1} groups for {len(labels)} points; got {len(groups)}")
    return groups
