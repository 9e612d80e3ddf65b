"""The picture of a report: a panel for each metric, a bar with its interval for each row."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.evaluation.report_cells import columns, counted, has_interval, has_value, heading, lacks_interval, reasons
from a2g_jax.evaluation.row_names import BASELINES, HALVES
from a2g_jax.evaluation.scores import Metric
from a2g_jax.io.files import atomic_path

#: A bar beyond the next longer one by this factor is cut, and its number is written on it.
FACTOR = 2.5
_COLUMNS = 4
_RUN, _BASELINE, _INK = "#2f6fde", "#b7c0cc", "#1b2433"


def limit_of(values: Sequence[float], runs: Sequence[float] = ()) -> float | None:
    """The greatest value that is drawn at full length; None where all are.

    The greatest ones are cut one after another as long as each exceeds the next by :data:`FACTOR`, but at most half of
    them, so that two rows of noise do not flatten the others.

    Args:
        values: of all rows.
        runs: of those that are runs: the limit is as far as they need, an exception among them apart.
    """
    found = _limit(values)
    return None if found is None else max([found, *([_limit(runs) or max(map(abs, runs))] if runs else [])])


def _limit(values: Sequence[float]) -> float | None:
    sizes = sorted((abs(value) for value in values), reverse=True)
    cut = 0
    for place in range(len(sizes) // 2):
        if sizes[place + 1] > 0 and sizes[place] > FACTOR * sizes[place + 1]:
            cut = place + 1
    return sizes[cut] if cut else None


def save_picture(result: dict[str, Any], path: Path) -> None:
    """Draw the report as a PNG."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    metrics = columns(result)
    rows = [row for row in result["rows"] if row["name"] != HALVES]
    lines = max(1, -(-len(metrics) // _COLUMNS))
    height = 0.24 * len(rows) + 0.75
    figure, axes = pyplot.subplots(
        lines, _COLUMNS, figsize=(15, lines * height + 0.5), sharey=True, squeeze=False, layout="constrained"
    )
    for panel, metric in zip(axes.flat, metrics, strict=False):
        _panel(panel, metric, rows)
        panel.set_title(heading(metric, result["about"]), fontsize=9)
        panel.tick_params(labelsize=8)
        panel.spines[["top", "right"]].set_visible(False)
    for panel in list(axes.flat)[len(metrics) :]:
        panel.set_visible(False)
    axes[0, 0].set_yticks(range(len(rows)), [_short(row["name"]) for row in rows])
    axes[0, 0].invert_yaxis()
    figure.supxlabel("\n".join(_legend(result)), fontsize=8, x=0.01, ha="left")
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")
    pyplot.close(figure)


def _panel(panel: Any, metric: Metric, rows: Sequence[dict[str, Any]]) -> None:
    cells = [row["scores"].get(metric.key) for row in rows]
    values = [cell["mean"] for cell in cells if has_value(cell)]
    runs = [
        row["scores"][metric.key]["mean"]
        for row in rows
        if row["name"] not in BASELINES and has_value(row["scores"].get(metric.key))
    ]
    limit = limit_of(values, runs)
    ends = [abs(end) for cell in cells if has_value(cell) for end in _ends(cell) if limit is None or abs(end) <= limit]
    if limit is not None:
        # Intervals of bars at full length may end beyond the limit.
        ends += [abs(end) for cell in cells if has_value(cell) and abs(cell["mean"]) <= limit for end in _ends(cell)]
    reach = max([0.0, *ends]) or 1.0
    right, left = 1.12 * reach, -1.12 * reach if min([0.0, *values]) < -0.02 * reach else 0.0
    if limit is not None:
        right = 1.45 * reach  # room for the numbers of cut bars
    for place, (row, cell) in enumerate(zip(rows, cells, strict=True)):
        if cell is None or not has_value(cell):
            panel.text(0.01 * reach, place, "-", va="center", fontsize=9, color=_INK)
            continue
        colour = _BASELINE if row["name"] in BASELINES else _RUN
        if limit is not None and abs(cell["mean"]) > limit:
            _cut_bar(panel, place, cell["mean"], metric, right, colour)
            continue
        panel.barh(place, cell["mean"], color=colour, height=0.7)
        if has_interval(cell):
            panel.plot([cell["low"], cell["high"]], [place, place], color=_INK, linewidth=1.4)
        elif lacks_interval(cell):
            panel.text(max(cell["mean"], 0.0) + 0.01 * reach, place, " [-]", va="center", fontsize=7, color=_INK)
    floors = {cell["floor"] for cell in cells if cell and cell.get("floor") is not None}
    for floor in floors:
        panel.axvline(floor, color="#c2554d", linewidth=1.0, linestyle=":")
        panel.text(floor, -0.55, f" floor {floor:.{metric.digits}f}", fontsize=7, color="#c2554d", va="bottom")
    panel.set_xlim(left, right)


def _cut_bar(panel: Any, place: int, value: float, metric: Metric, right: float, colour: str) -> None:
    """A bar to the edge of the panel, with an arrow and its number."""
    side = np.sign(value)
    panel.barh(place, side * 0.965 * right, color=colour, height=0.7, hatch="///", edgecolor="white", linewidth=0)
    panel.plot([side * 0.98 * right], [place], marker=">" if side > 0 else "<", color=_INK, markersize=5, clip_on=False)
    label = f"{value:.{metric.digits}f}"
    box = {"boxstyle": "square,pad=0.15", "facecolor": "white", "edgecolor": "none"}
    panel.text(side * 0.94 * right, place, label, ha="right" if side > 0 else "left", va="center", fontsize=7, bbox=box)


def _ends(cell: dict[str, Any]) -> tuple[float, ...]:
    return (cell["mean"], cell["low"], cell["high"]) if has_interval(cell) else (cell["mean"],)


def _short(name: str, most: int = 40) -> str:
    """A name as the label of an axis; Matplotlib reads dollars as mathematics."""
    name = " ".join(name.split())
    return (name if len(name) <= most else "..." + name[3 - most :]).replace("$", r"\$")


def _legend(result: dict[str, Any]) -> list[str]:
    about = result["about"]
    over = counted(about["recordings"], "recording") if "recordings" in about else "clips"
    if any("seeds" in row for row in result["rows"]):
        over += ", of rows of several seeds over seeds"
    lines = [f"Black lines: 95 % intervals over {over}. Hatched bars are cut at the arrow; the number is their value."]
    return lines + [f"A dash: {reason}." for reason in reasons(result)]
