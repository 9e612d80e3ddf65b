"""Requested and arrived values of every control, and the emotions that a classifier recognises."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from a2g_jax.features.hand_properties import PROPERTIES
from experiments.controls.responses import QUANTILES

#: Titles and units of the panels.
UNITS = {
    "energy": "energy: mean wrist speed, m/s",
    "height": "height of the hands above the pelvis, m",
    "radius": "radius: hands from the body's axis, m",
    "rate": "rate: strokes a second",
    "handedness": "handedness: share of the right wrist",
}
_COLOURS = ("#1f6fb4", "#d2691e", "#3c8c50", "#8a4fbf")


def draw(figures: dict[str, Any], path: Path) -> None:
    """Draw a panel for each control, and one of emotions if they were measured."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 3, figsize=(13.5, 8.0))
    for axis, name in zip(axes.flat, PROPERTIES, strict=False):
        _responses(axis, name, figures["runs"])
    judged = {name: run["emotions"] for name, run in figures["runs"].items() if "emotions" in run}
    if judged:
        _emotions(axes.flat[-1], figures["emotions"], *next(iter(judged.items())))
    else:
        axes.flat[-1].set_axis_off()
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def _responses(axis: Axes, name: str, runs: dict[str, Any]) -> None:
    having = {run: found["controls"][name] for run, found in runs.items() if name in found["controls"]}
    if not having:
        axis.set_axis_off()
        return
    ends = [value for found in having.values() for value in found["requested"]]
    axis.plot([min(ends), max(ends)], [min(ends), max(ends)], color="0.7", linestyle="--", label="as requested")
    for colour, (run, found) in zip(_COLOURS, having.items(), strict=False):
        means, low, high = (np.array([one[key] for one in found["arrived"]], float) for key in ("mean", "low", "high"))
        slope = found["slope"]
        ends = "-" if slope["low"] is None else f"{slope['low']:.2f}, {slope['high']:.2f}"
        label = f"{run}: slope {slope['mean']:.2f} [{ends}]"
        errors = [means - low, high - means]
        axis.errorbar(found["requested"], means, yerr=errors, marker="o", capsize=3, color=colour, label=label)
    axis.set_title(UNITS[name], fontsize=10)
    axis.set_xlabel(f"requested: quantiles {', '.join(f'{one:g}' for one in QUANTILES)} of people", fontsize=9)
    axis.set_ylabel("arrived", fontsize=9)
    axis.legend(frameon=False, fontsize=8, loc="upper left")


def _emotions(axis: Axes, names: list[str], run: str, found: dict[str, Any]) -> None:
    table = np.array(found["table"])
    axis.imshow(table, vmin=0, vmax=1, cmap="Blues")
    for row, column in np.ndindex(*table.shape):
        colour = "white" if table[row, column] > 0.5 else "black"
        axis.text(column, row, f"{table[row, column]:.2f}", ha="center", va="center", fontsize=7, color=colour)
    axis.set_xticks(range(len(names)), names, rotation=40, ha="right", fontsize=8)
    axis.set_yticks(range(len(names)), names, fontsize=8)
    axis.set_xlabel("classified as", fontsize=9)
    axis.set_ylabel("requested emotion", fontsize=9)
    axis.set_title(f"emotion, {run}: {100 * found['accuracy']['mean']:.0f} % of clips as requested", fontsize=10)
