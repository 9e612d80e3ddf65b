"""The report of an evaluation as LaTeX tables for a paper; they need the package booktabs."""

import re
import textwrap
from collections.abc import Sequence
from typing import Any, NamedTuple

from a2g_jax.evaluation.latex_text import LINE, comment, escape, unit_text, width
from a2g_jax.evaluation.report_cells import (
    ARROWS,
    best_runs,
    columns,
    counted,
    describe,
    has_interval,
    has_value,
    lacks_interval,
    reasons,
    run_rows,
    title,
    unit,
)
from a2g_jax.evaluation.row_names import HALVES
from a2g_jax.evaluation.scores import Metric

#: Width and height of the text of an article of 10 points, points; a table leaves some of the height to its page.
TEXT_WIDTH, TEXT_HEIGHT = 345.0, 510.0
#: Half of the space between columns, points.
_SEPARATION = 3.0
#: Most characters in a line of the first column and of a head.
_NAME, _HEAD = 20, 15
#: Baselines by names that fit a line.
_SHORT = {
    "another right motion": "other right motion",
    "truth, 1 degree of noise": "truth, 1° of noise",
    "truth, 5 degrees of noise": "truth, 5° of noise",
    "nearest neighbour in audio": "nearest in audio",
    "another clip's motion": "another clip",
    HALVES: "half of the truth",
}
_RULES = 14.0


class Shown(NamedTuple):
    """What a cell shows: LaTeX, and its width in points."""

    latex: str
    width: float


class Line(NamedTuple):
    """A line of a table: a row of the report, or the best of its samples."""

    name: list[str]
    row: int
    best: bool


class Column(NamedTuple):
    """A column of a table: the lines of its head, and a cell for each row."""

    head: list[Shown]
    cells: list[Shown]

    @property
    def width(self) -> float:
        """Points, with the space to the next column."""
        return 2 * _SEPARATION + max(one.width for one in (*self.head, *self.cells))


def latex(result: dict[str, Any]) -> str:
    """Tables that fit the page of an article: blocks of columns, each as wide as the text, of all rows.

    Means with their intervals, under them the best of the samples; units in the head; bold by
    :func:`~a2g_jax.evaluation.report_cells.best_runs`, which the caption explains; a dash as in Markdown.
    """
    table = _lines(result["rows"])
    names = [line.name for line in table]
    made = [_column(metric, result, table) for metric in columns(result)]
    lines = [comment("Needs \\usepackage{booktabs}; made by a2g evaluate."), *(comment(one) for one in _origin(result))]
    name_width = max([2 * _SEPARATION, *(width(line) for name in names for line in name)])
    lines_of_block = sum(len(name) for name in names) + max([0, *(len(one.head) for one in made)])
    block_height = _RULES + LINE * lines_of_block
    blocks = _blocks(made, TEXT_WIDTH - name_width)
    for number, page in enumerate(_pages(blocks, block_height, _caption_height(_caption(result)))):
        caption = _caption(result) if number == 0 else "The scores of the table before, continued."
        lines += ["", r"\begin{table}[p]", r"\centering\footnotesize"]
        lines += [rf"\setlength{{\tabcolsep}}{{{_SEPARATION:g}pt}}", rf"\caption{{{caption}}}"]
        for block in page:
            lines += [*_tabular(names, block), ""]
        lines[-1] = r"\end{table}"
    return "\n".join([*lines, ""])


def _tabular(names: Sequence[list[str]], block: Sequence[Column]) -> list[str]:
    head = [_stack([one.latex for one in column.head], "b", "r") for column in block]
    lines = [rf"\begin{{tabular}}{{@{{}}l{'r' * len(block)}@{{}}}}", r"\toprule", " & ".join(["", *head]) + r" \\"]
    lines.append(r"\midrule")
    for place, name in enumerate(names):
        if all(not column.cells[place].latex for column in block):
            continue  # the best sample, where no column of the block has one
        cells = [column.cells[place].latex for column in block]
        lines.append(" & ".join([_stack([escape(line) for line in name], "t", "l"), *cells]) + r" \\")
    return [*lines, r"\bottomrule", r"\end{tabular}", r"\par\medskip"]


def _stack(lines: Sequence[str], place: str, side: str) -> str:
    """Lines of a cell above each other."""
    if len(lines) == 1:
        return lines[0]
    return rf"\begin{{tabular}}[{place}]{{@{{}}{side}@{{}}}}" + r" \\ ".join(lines) + r"\end{tabular}"


def _lines(rows: Sequence[dict[str, Any]]) -> list[Line]:
    """The lines of a table."""
    lines = []
    for place, row in enumerate(rows):
        name = " ".join(_SHORT.get(row["name"], row["name"]).split())
        lines.append(Line(textwrap.wrap(name, _NAME) or [""], place, False))
        if row["samples"] > 1 and any(cell["best"] is not None for cell in row["scores"].values()):
            lines.append(Line([f"best of {row['samples']}"], place, True))
    return lines


def _column(metric: Metric, result: dict[str, Any], table: Sequence[Line]) -> Column:
    about = result["about"]
    head = [Shown(escape(line), width(line)) for line in textwrap.wrap(title(metric, about), _HEAD)]
    name, arrow = unit(metric, about), ARROWS[metric.better]
    head.append(Shown(f"{unit_text(name)} {escape(arrow)}".strip(), width(f"{name} {arrow}")))
    best = best_runs(result, metric)
    cells = []
    for line in table:
        cell = result["rows"][line.row]["scores"].get(metric.key)
        cells.append(_best_cell(cell, metric) if line.best else _cell(cell, metric, line.row in best))
    return Column(head, cells)


def _cell(cell: dict[str, Any] | None, metric: Metric, bold: bool) -> Shown:
    if cell is None or not has_value(cell):
        return Shown("--", width("--"))
    show = lambda value: f"{value:.{metric.digits}f}"  # noqa: E731
    mean, rest = show(cell["mean"]), ""
    if has_interval(cell):
        below, above = show(cell["mean"] - cell["low"]), show(cell["high"] - cell["mean"])
        rest = f" ± {above}" if below == above else f" [{show(cell['low'])}, {show(cell['high'])}]"
    elif lacks_interval(cell):
        rest = " [--]"
    number = _number(mean)
    return Shown((rf"\textbf{{{number}}}" if bold else number) + _number(rest), width(mean, True) + width(rest))


def _best_cell(cell: dict[str, Any] | None, metric: Metric) -> Shown:
    if cell is None or cell["best"] is None:
        return Shown("", 0.0)
    text = f"{cell['best']:.{metric.digits}f}"
    return Shown(_number(text), width(text))


def _number(text: str) -> str:
    """Signs of numbers as minus signs, and ± as in mathematics."""
    return re.sub(r"-(?=\d)", "$-$", text).replace("±", r"$\pm$")


def _blocks(made: Sequence[Column], room: float) -> list[list[Column]]:
    """Columns side by side, as many as there is room for."""
    blocks: list[list[Column]] = []
    left = 0.0
    for column in made:
        if not blocks or column.width > left:
            blocks.append([])
            left = room
        blocks[-1].append(column)
        left -= column.width
    return blocks


def _pages(blocks: Sequence[list[Column]], height: float, caption: float) -> list[list[list[Column]]]:
    """Blocks above each other, as many as a page has room for."""
    pages: list[list[list[Column]]] = []
    left = 0.0
    for block in blocks:
        if not pages or height > left:
            left = TEXT_HEIGHT - (caption if not pages else 3 * LINE)
            pages.append([])
        pages[-1].append(block)
        left -= height
    return pages


def _caption_height(caption: str) -> float:
    """Of a caption in the size of the text, 12 points from line to line."""
    return 12.0 * (2 + width(caption) * 10.0 / 8.0 // TEXT_WIDTH)


def _origin(result: dict[str, Any]) -> list[str]:
    """What was scored, with full hashes, for comments."""
    about = result["about"]
    lines = [f"Corpus {about['corpus']}, {about['split']} split; package {about['package']}."]
    return lines + [f"{describe(row)} ({row['run']['weights']})" for row in run_rows(result)]


def _caption(result: dict[str, Any]) -> str:
    about, rows = result["about"], result["rows"]
    over = counted(about["recordings"], "recording") if "recordings" in about else "clips"
    seeds = any("seeds" in row for row in rows)
    parts = [
        f"Scores on the {about['split']} split: {about['clips']} clips, {about['seconds']:.0f} s.",
        f"± and square brackets: 95 % intervals over {over}{', of rows of several seeds over seeds' if seeds else ''}.",
    ]
    if any(row["samples"] > 1 for row in rows):
        parts.append(f"Means over {about['samples']} samples, under them the best sample of each clip.")
    if len([row for row in rows if row.get("run")]) > 1:
        parts.append(
            "Bold: the best run of a column (≈: the nearest to the truth), and runs whose interval includes its mean"
            " (≈: or the truth's); no test of differences."
        )
    fgd = next((cell for row in rows if (cell := row["scores"].get("fgd")) and cell.get("floor") is not None), None)
    if fgd is not None:
        parts.append(
            f"FGD of {fgd['vectors']} vectors; its floor, two halves of the truth, is {fgd['floor']:.2f} at"
            f" {fgd['half_vectors']}."
        )
    parts += [f"A dash: {reason}." for reason in reasons(result)]
    parts += [f"{describe(row)}." for row in run_rows(result)]
    return escape(" ".join(parts))
