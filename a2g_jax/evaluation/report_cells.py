"""Columns and cells of a report, as its Markdown, LaTeX and picture share them."""

from collections.abc import Sequence
from typing import Any

from a2g_jax.evaluation.row_names import BASELINES
from a2g_jax.evaluation.scores import METRICS, Metric
from a2g_jax.metrics.units import OURS, find_units

ARROWS = {"lower": "↓", "higher": "↑", "truth": "≈"}
#: What stands for a score or an interval that there is not.
DASH = "-"

Cell = dict[str, Any]


def condition(about: dict[str, Any], key: str) -> Any:
    """A condition of a report; reports of 0.1 are in our units."""
    return about.get(key, OURS.key if key == "units" else None)


def columns(result: dict[str, Any]) -> list[Metric]:
    """The metrics that any row has, in the report's units."""
    units = find_units(condition(result["about"], "units"))
    extra = {key: Metric(key=key, **values) for key, values in result["about"].get("extra_metrics", {}).items()}
    scored = {name for row in result["rows"] for name in row["scores"]}
    return [units.shown(metric) for metric in (METRICS | extra).values() if metric.key in scored]


def describe_metrics(metrics: Sequence[Metric]) -> dict[str, dict[str, Any]]:
    """Titles, units and so on of metrics of other packages, for ``about``: the JSON is readable without them."""
    names = ("title", "unit", "better", "source", "digits", "against_target")
    return {metric.key: {name: getattr(metric, name) for name in names} for metric in metrics}


def title(metric: Metric, about: dict[str, Any]) -> str:
    """Title of a column.

    Reports of 0.1 scaled L1* by the length of the bones from wrist to wrist, and counted the tolerance of beat
    alignment in frames.
    """
    if metric.key == "position_l1_star" and "wrist_to_wrist" not in about:
        return f"{metric.title} (by the bones' length, as in 0.1)"
    if metric.key == "beat_alignment":
        sigma = about.get("beat_sigma")
        return f"{metric.title}, {'5 frames' if sigma is None else f'{sigma:.2g} s'}"
    return metric.title


def unit(metric: Metric, about: dict[str, Any]) -> str:
    """Unit of a column: centimetres and metres, or the corpus's own unit where it has no metres; empty for none."""
    name = metric.unit
    if name and about.get("unit", "cm") != "cm":
        name = name.replace("cm", about["unit"]).replace("m/", f"{about['unit']}/")
    return name


def heading(metric: Metric, about: dict[str, Any]) -> str:
    """Title, unit and direction of a column."""
    name = unit(metric, about)
    return f"{title(metric, about)}{f', {name}' if name else ''} {ARROWS[metric.better]}"


def has_value(cell: Cell | None) -> bool:
    """Whether a cell has a score: it is there, there are enough vectors, and it is a number."""
    return cell is not None and cell["mean"] is not None and cell["mean"] == cell["mean"]


def has_interval(cell: Cell) -> bool:
    """Whether a score has an interval."""
    return cell["low"] is not None and cell["low"] == cell["low"]


def lacks_interval(cell: Cell) -> bool:
    """Whether a dash stands for an interval: recordings or seeds are too few. Reports of before did not say why."""
    return not has_interval(cell) and "reason" in cell


def markdown_cell(cell: Cell | None, metric: Metric) -> str:
    """A cell of the Markdown table."""
    if cell is None or not has_value(cell):
        return DASH
    digits = metric.digits
    text = f"{cell['mean']:.{digits}f}"
    if has_interval(cell):
        text += f" [{cell['low']:.{digits}f}, {cell['high']:.{digits}f}]"
    elif lacks_interval(cell):
        text += f" [{DASH}]"
    if cell["best"] is not None and cell["best"] != cell["mean"]:
        text += f" best {cell['best']:.{digits}f}"
    return text + vectors_text(cell, digits)


def vectors_text(cell: Cell, digits: int = 2) -> str:
    """The number of feature vectors behind a score, and what halves score beside their floor; empty for others.

    Scores of 0.1 do not state it. In earlier reports vectors may be fewer than features; that is marked.
    """
    if not cell.get("vectors"):
        return ""
    text = f"n = {cell['vectors']}"
    if cell["mean"] is not None and cell["vectors"] <= cell["features"]:
        text += ", too few"
    if cell.get("halves") is not None:
        halves, floor = (f"{cell[key]:.{digits}f}" for key in ("halves", "floor"))
        text += f"; of halves, n = {cell['half_vectors']}: {halves}, floor {floor}"
    return f" ({text})"


def counted(number: int, noun: str) -> str:
    """A number with its noun: ``1 recording``, ``2 recordings``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def reasons(result: dict[str, Any]) -> list[str]:
    """Why scores or intervals are missing, each reason once."""
    found: dict[str, None] = {}
    for row in result["rows"]:
        for cell in row["scores"].values():
            if cell.get("reason"):
                found[cell["reason"]] = None
    return list(found)


def best_runs(result: dict[str, Any], metric: Metric) -> set[int]:
    """Places of the rows that are marked in a column: the best run, and runs that may be as good.

    The best one by its mean, for ≈ the one nearest to the truth. A run may be as good where its interval includes the
    best one's mean, for ≈ also where it includes the truth's. Empty for fewer than two runs: baselines do not count.
    """
    rows = result["rows"]
    cells = {
        place: row["scores"][metric.key]
        for place, row in enumerate(rows)
        if row["name"] not in BASELINES and has_value(row["scores"].get(metric.key))
    }
    truth = next((row["scores"].get(metric.key) for row in rows if row["name"] == "truth"), None)
    if len(cells) < 2 or (metric.better == "truth" and not has_value(truth)):
        return set()
    wanted = []
    if metric.better == "truth":
        assert truth is not None
        wanted = [truth["mean"]]
    rank = {
        "lower": lambda cell: cell["mean"],
        "higher": lambda cell: -cell["mean"],
        "truth": lambda cell: abs(cell["mean"] - wanted[0]),
    }[metric.better]
    first = min(cells.values(), key=rank)
    wanted.append(first["mean"])
    return {
        place
        for place, cell in cells.items()
        if rank(cell) == rank(first)
        or (has_interval(cell) and any(cell["low"] <= value <= cell["high"] for value in wanted))
    }


def run_rows(result: dict[str, Any]) -> list[dict[str, Any]]:
    """All rows of runs that say what they are, those of several seeds one by one."""
    rows = [one for row in result["rows"] for one in row.get("runs", [row])]
    return [row for row in rows if row.get("run")]


def describe(row: dict[str, Any]) -> str:
    """What a run is, in a line."""
    run = row["run"]
    return (
        f"{row['name']}: {run['model']} {run['preset']}, {run['steps']} steps, seed {run['seed']}, weights"
        f" {run['weights'][:12]}"
    )
