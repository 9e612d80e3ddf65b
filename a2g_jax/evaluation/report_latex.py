"""The report of an evaluation as LaTeX tables for a paper; they need the package booktabs."""

import textwrap
from collections.abc import Sequence
from typing import Any, NamedTuple

from a2g_jax.evaluation.latex_text import LINE, comment, escape, unit_text, width
from a2g_jax.evaluation.report_cells import (
    ARROWS,
    best_runs,
    columns,
    describe,
    has_interval,
    has_value,
    lacks_interval,
    reasons,
    run_rows,
    title,
    unit,
)
from a2g_jax.evaluation.scores import Metric

#: Width and height of the text of an article of 10 points, points; a table leaves some of the height to its page.
TEXT_WIDTH, TEXT_HEIGHT = 345.0, 510.0
#: Half of the space between columns, points.
_SEPARATION = 3.0
#: Most characters in a line of the first column and of a head.
_NAME, _HEAD = 22, 15
_RULES = 14.0


class Shown(NamedTuple):
    """What a cell shows: LaTeX, and the same as plain text, for its width."""

    latex: str
    plain: str


class Column(NamedTuple):
    """A column of a table: the lines of its head, and a cell for each row."""

    head: list[Shown]
    cells: list[Shown]

    @property
    def width(self) -> float:
        """Points, with the space to the next column."""
        return 2 * _SEPARATION + max(width(one.plain, bold=True) for one in (*self.head, *self.cells))


def latex(result: dict[str, Any]) -> str:
    """Tables that fit the page of an article: blocks of columns, each as wide as the text, of all rows.

    Means with their intervals, in round brackets the best of the samples; units in the head; bold by
    :func:`~a2g_jax.evaluation.report_cells.best_runs`, which the caption explains; a dash as in Markdown.
    """
    rows = result["rows"]
    names = _names(rows)
    made = [_column(metric, result) for metric in columns(result)]
    lines = [comment("Needs \\usepackage{booktabs}; made by a2g evaluate."), *(comment(one) for one in _origin(result))]
    name_width = max([2 * _SEPARATION, *(width(line) for name in names for line in name)])
    block_height = _RULES + LINE * (sum(len(name) for name in names) + max([0, *(len(one.head) for one in made)]))
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
        cells = [column.cells[place].latex for column in block]
        lines.append(" & ".join([_stack([escape(line) for line in name], "t", "l"), *cells]) + r" \\")
    return [*lines, r"\bottomrule", r"\end{tabular}", r"\par\medskip"]


def _stack(lines: Sequence[str], place: str, side: str) -> str:
    """Lines of a cell above each other."""
    if len(lines) == 1:
        return lines[0]
    return rf"\begin{{tabular}}[{place}]{{@{{}}{side}@{{}}}}" + r" \\ ".join(lines) + r"\end{tabular}"


def _names(rows: Sequence[dict[str, Any]]) -> list[list[str]]:
    """The lines of the first column."""
    return [textwrap.wrap(" ".join(row["name"].split()), _NAME) or [""] for row in rows]


def _column(metric: Metric, result: dict[str, Any]) -> Column:
    about = result["about"]
    head = [Shown(escape(line), line) for line in textwrap.wrap(title(metric, about), _HEAD)]
    name = unit(metric, about)
    head.append(Shown(f"{unit_text(name)} {escape(ARROWS[metric.better])}".strip(), f"{name} {ARROWS[metric.better]}"))
    best = best_runs(result, metric)
    cells = [
        _cell(row["scores"].get(metric.key), metric, row["samples"] > 1, place in best)
        for place, row in enumerate(result["rows"])
    ]
    return Column(head, cells)


def _cell(cell: dict[str, Any] | None, metric: Metric, several: bool, best: bool) -> Shown:
    if cell is None or not has_value(cell):
        return Shown("--", "--")
    show = lambda value: f"{value:.{metric.digits}f}"  # noqa: E731
    mean, rest = show(cell["mean"]), ""
    if has_interval(cell):
        below, above = show(cell["mean"] - cell["low"]), show(cell["high"] - cell["mean"])
        rest = f" ± {above}" if below == above else f" [{show(cell['low'])}, {show(cell['high'])}]"
    elif lacks_interval(cell):
        rest = " [--]"
    if several and cell["best"] is not None:
        rest += f" ({show(cell['best'])})"
    number = _number(mean)
    return Shown((rf"\textbf{{{number}}}" if best else number) + _number(rest), mean + rest)


def _number(text: str) -> str:
    """Signs of numbers as minus signs, and ± as in mathematics."""
    signed = "".join(
        "$-$" if one == "-" and after.isdigit() else one for one, after in zip(text, text[1:] + " ", strict=True)
    )
    return signed.replace("±", r"$\pm$")


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
    over = f"{about['recordings']} recordings" if "recordings" in about else "clips"
    seeds = any("seeds" in row for row in rows)
    parts = [
        f"Scores on the {about['split']} split: {about['clips']} clips, {about['seconds']:.0f} s.",
        f"± and square brackets: 95 % intervals over {over}{', of rows of several seeds over seeds' if seeds else ''}.",
    ]
    if any(row["samples"] > 1 for row in rows):
        parts.append(f"Means over {about['samples']} samples, in round brackets the best of them.")
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
