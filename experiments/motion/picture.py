"""The picture of the table: every statistic relative to the truth, with its target band."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from a2g_jax.io.files import atomic_path
from experiments.motion.statistics import STATISTICS
from experiments.motion.targets import RIGHT, TARGETS, TRUTH, Rows, relative

#: Values beyond these lie on the edge.
LOW, HIGH = 0.04, 25.0
_COLOURS = ("#2f6fde", "#d9822b", "#2a9d63", "#8e44ad", "#c0392b", "#16a2b8", "#7f6000")
_MARKERS = "oDsP^v*"
_GREY = "#9aa5b4"


def relative_picture(path: Path, rows: Rows, references: Mapping[str, Rows]) -> None:
    """Draw a line for each target, on a logarithmic axis, and a marker for each row.

    FGD is relative to another right motion's, the slide of the feet to its limit, all else to the truth. Filled markers
    are runs, grey ones baselines.
    """
    keys = list(TARGETS)
    baselines = [name for name in references if "listening" not in rows[name] and name != TRUTH]
    runs = [name for name in references if "listening" in rows[name]]
    figure, axes = plt.subplots(figsize=(10.5, 0.42 * len(keys) + 1.6), layout="constrained")
    height = len(keys)
    for line, key in enumerate(keys):
        target, y = TARGETS[key], height - line
        scale = target.high if target.relative_to is None else 1.0
        low, high = max(target.low / scale, LOW), min(target.high / scale, HIGH)
        axes.fill_betweenx([y - 0.4, y + 0.4], low, high, color="#2a9d63", alpha=0.16, linewidth=0)
        for number, name in enumerate([*baselines, *runs]):
            value = relative(key, rows[name], references[name])
            if value is None:
                continue
            at, run = float(np.clip(value / scale, LOW, HIGH)), number - len(baselines)
            style: dict[str, Any] = {"marker": "o", "color": _GREY, "s": 36, "zorder": 2}
            offset = -0.27
            if run >= 0:
                style = {"marker": _MARKERS[run % 7], "color": _COLOURS[run % 7], "s": 48, "zorder": 3}
                offset = 0.24 * (run - (len(runs) - 1) / 2) / max(1.0, (len(runs) - 1) / 2)
            else:
                style["marker"] = ("|", "x", "+", "1")[number % 4]
            axes.scatter(at, y + offset, label=name if line == 0 else None, **style)
    axes.axvline(1.0, color="#5b6675", linewidth=0.8)
    axes.set_xscale("log")
    axes.set_xlim(0.9 * LOW, 1.1 * HIGH)
    ticks = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_yticks(range(height, 0, -1), [_label(key) for key in keys])
    axes.set_ylim(0.3, height + 0.7)
    axes.set_xlabel("relative to the truth (line at 1; green: target; values beyond the axis lie on its edge)")
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
    handles = [*axes.get_legend_handles_labels()]
    figure.legend(*handles, loc="outside upper center", ncols=4, frameon=False)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=130, format="png")
    plt.close(figure)


def _label(key: str) -> str:
    target = TARGETS[key]
    if key == "slide":
        return f"{STATISTICS[key].title} / {target.high:g} mm/s"
    if target.relative_to == RIGHT and key == "fgd":
        return f"{STATISTICS[key].title} / right motion's"
    return STATISTICS[key].title
