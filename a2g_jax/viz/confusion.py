"""Confusion matrices as pictures; needs Matplotlib."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Int

from a2g_jax.io.files import atomic_path


class Panel(NamedTuple):
    """One matrix of a picture."""

    title: str
    names: Sequence[str]
    """Classes, in the order of rows and columns."""
    counts: Int[np.ndarray, "K K"]
    """By true (rows) and predicted (columns) class."""


def save_confusion(path: Path, panels: Sequence[Panel]) -> None:
    """Draw matrices side by side, four in a row, each row of a matrix as percentages of its true class."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    columns = min(len(panels), 4)
    lines = -(-len(panels) // columns)
    figure, axes = pyplot.subplots(
        lines, columns, figsize=(4.4 * columns, 4.4 * lines), squeeze=False, layout="constrained"
    )
    for axis, panel in zip(axes.flat, panels, strict=False):
        _draw(axis, panel)
    for axis in list(axes.flat)[len(panels) :]:
        axis.set_visible(False)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")
    pyplot.close(figure)


def _draw(axis, panel: Panel) -> None:
    totals = panel.counts.sum(axis=1, keepdims=True)
    shares = panel.counts / np.maximum(totals, 1)
    axis.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0)
    ticks = range(len(panel.names))
    axis.set_xticks(ticks, panel.names, rotation=45, ha="right", fontsize=8)
    rows = [f"{name} ({total})" for name, total in zip(panel.names, totals[:, 0], strict=True)]
    axis.set_yticks(ticks, rows, fontsize=8)
    for row, column in np.ndindex(shares.shape):
        if shares[row, column] >= 0.005:
            colour = "white" if shares[row, column] > 0.6 else "#1b2433"
            text = f"{100 * shares[row, column]:.0f}"
            axis.text(column, row, text, ha="center", va="center", fontsize=7, color=colour)
    axis.set_title(panel.title, fontsize=10)
    axis.set(xlabel="classified as", ylabel="is (clips)")
