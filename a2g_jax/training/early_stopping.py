"""Early stopping: the best validation so far, as a function of the lines of ``metrics.jsonl`` alone.

The file loses the lines of steps that are repeated after a resume, so an interrupted training decides as an
uninterrupted one.
"""

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from a2g_jax.models.train_config import TrainConfig


class Validations(NamedTuple):
    """Validations of the last stage."""

    best: int | None = None
    """Step of the lowest loss; None before the first one."""
    loss: float = math.inf
    since: int = 0
    """Validations after the best one."""

    def after(self, step: int, loss: float) -> "Validations":
        """With one more; a loss that is not a number is no improvement."""
        if loss < self.loss:
            return Validations(step, loss, 0)
        return self._replace(since=self.since + 1)


def validations(lines: Iterable[Mapping[str, Any]], first: int, done: int) -> Validations:
    """The validations among lines of metrics.

    Args:
        lines: those of :func:`read_metrics`.
        first: step at which the last stage begins; validations of earlier stages have other losses.
        done: last step that counts.
    """
    found = Validations()
    for line in lines:
        step, loss = line.get("step", 0), line.get("loss")
        if line.get("split") == "validation" and first < step <= done:
            found = found.after(step, math.nan if loss is None else float(loss))
    return found


def ended(settings: TrainConfig, checked: Validations) -> bool:
    """Whether the loss of the last stage has not improved for long enough."""
    return settings.patience > 0 and checked.since >= settings.patience


def read_metrics(path: Path) -> list[dict[str, Any]]:
    """Lines of ``metrics.jsonl``, without a last one that was cut short; none where there is no file."""
    lines: list[dict[str, Any]] = []
    if not path.is_file():
        return lines
    with path.open(encoding="utf-8", errors="replace") as file:
        for text in file:
            try:
                line = json.loads(text)
            except ValueError:
                continue
            if isinstance(line, dict):
                lines.append(line)
    return lines
