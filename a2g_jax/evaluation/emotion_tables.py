"""Emotions of scored motions, as a classifier recognises them: counts, the section of a report, and a picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.metrics.labels import confusion

#: Pictures have the runs and these rows.
_SHOWN = ("truth", "another clip's motion")


class EmotionTally:
    """Counts of one candidate's clips by their own emotion and the one that a classifier finds most probable."""

    def __init__(self, emotions: Sequence[str]) -> None:
        """
        Args:
            emotions: of the classifier, in the order of its classes.
        """
        self.emotions = tuple(emotions)
        self.counts = np.zeros((len(emotions),) * 2, np.int64)
        self.above = np.zeros(len(emotions), np.int64)

    def add(self, probabilities: Float[np.ndarray, "n K"], emotion: str) -> None:
        """Add the clips of a motion; nothing for an emotion that the classifier does not have."""
        if emotion not in self.emotions or len(probabilities) == 0:
            return
        own = self.emotions.index(emotion)
        self.counts += confusion(probabilities, np.full(len(probabilities), own))
        if "neutral" in self.emotions:
            neutral = probabilities[:, self.emotions.index("neutral")]
            self.above[own] += int(np.sum(probabilities[:, own] > neutral))

    def to_json(self) -> dict[str, Any] | None:
        """``confusion``, and by emotion the share of its clips where it is more probable than neutral; None if
        empty."""
        total = self.counts.sum(axis=1)
        if not total.any():
            return None
        shares = {
            name: float(above / count)
            for name, above, count in zip(self.emotions, self.above, total, strict=True)
            if count and name != "neutral" and "neutral" in self.emotions
        }
        return {"confusion": self.counts.tolist(), "above_neutral": shares}


def accuracy_by_chance(emotions: Sequence[str]) -> dict[str, float]:
    """Emotion accuracy of motion that has nothing to do with the emotion.

    Args:
        emotions: the emotion of every scored clip that the classifier has.

    Returns:
        ``uniform``: a random one of them; ``commonest``: always the commonest one.
    """
    _, counts = np.unique(list(emotions), return_counts=True)
    return {"uniform": 1.0 / len(counts), "commonest": float(counts.max() / counts.sum())}


def emotion_lines(result: dict[str, Any]) -> list[str]:
    """The section of a report on emotions; nothing where none were classified."""
    names = result["about"].get("emotions")
    rows = [row for row in result["rows"] if row.get("emotions")]
    if not names or not rows:
        return []
    lines = [
        "## Emotions",
        "",
        "Share of the clips of each emotion that are classified as it; in brackets the share where it is more probable"
        " than neutral.",
        "",
        "| | " + " | ".join(names) + " |",
        "|" + " --- |" * (len(names) + 1),
    ]
    for row in rows:
        counts, above = np.array(row["emotions"]["confusion"]), row["emotions"]["above_neutral"]
        cells = []
        for index, name in enumerate(names):
            total = counts[index].sum()
            extra = f" ({above[name]:.2f})" if name in above else ""
            cells.append(f"{counts[index, index] / total:.2f}{extra}" if total else "-")
        lines.append(f"| {row['name']} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def emotions_picture(result: dict[str, Any], path: Path, baselines: Sequence[str]) -> bool:
    """Draw the confusion matrices of runs, of the truth and of another clip's motion; whether there were any.

    Args:
        baselines: names of rows that are no runs.
    """
    from a2g_jax.viz.confusion import Panel, save_confusion

    names = result["about"].get("emotions")
    rows = [row for row in result["rows"] if row.get("emotions")]
    rows = [row for row in rows if row["name"] not in baselines or row["name"] in _SHOWN]
    if not names or not rows:
        return False
    panels = []
    for row in rows:
        counts = np.array(row["emotions"]["confusion"])
        panels.append(Panel(f"{row['name']}: {100 * np.trace(counts) / counts.sum():.1f} %", names, counts))
    save_confusion(path, panels)
    return True
