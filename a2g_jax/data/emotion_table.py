"""Tables of emotions by window, and the pieces of recordings that have one emotion.

A table is text with commas and the columns ``name,start,end,emotion,confidence``: the name of a recording as its reader
gives it, the times of a window in it (seconds), the most probable emotion there and its probability. ``a2g label``
writes one with a classifier of audio; any other program may.
"""

import csv
import io
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from a2g_jax.data.datasets.csv_tables import read_columns
from a2g_jax.data.datasets.source import LabelRule, Piece, Take
from a2g_jax.errors import InputError

COLUMNS = ("name", "start", "end", "emotion", "confidence")
#: Times closer than this, seconds, are the same: the table has milliseconds.
_SAME = 0.005


class WindowLabel(NamedTuple):
    """The emotion of a window of a recording."""

    name: str
    """Of the recording."""
    start: float
    """Seconds."""
    end: float
    emotion: str
    confidence: float


def table_lines(labels: Sequence[WindowLabel]) -> str:
    """The lines of a table, without its header."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for label in labels:
        times = (f"{label.start:.3f}", f"{label.end:.3f}")
        writer.writerow([label.name, *times, label.emotion, f"{label.confidence:.4f}"])
    return text.getvalue()


def read_table(path: Path) -> list[WindowLabel]:
    """The windows of a table.

    Raises:
        InputError: no such file, without a column, or a line with a wrong number or without an emotion.
    """
    labels = []
    for line, row in read_columns(path, COLUMNS):
        start, end, confidence = (_number(path, line, row[name]) for name in ("start", "end", "confidence"))
        if not 0.0 <= start < end:
            raise InputError(f"{path}, line {line}: expected rising times from 0 on; got {start:g} to {end:g} s.")
        if not 0.0 <= confidence <= 1.0:
            raise InputError(f"{path}, line {line}: expected a confidence from 0 to 1; got {confidence:g}.")
        if not row["emotion"] or not row["name"]:
            raise InputError(f"{path}, line {line}: expected a recording and its emotion; one of them is empty.")
        labels.append(WindowLabel(row["name"], start, end, row["emotion"], confidence))
    if not labels:
        raise InputError(f"{path}: has no windows; make it with 'a2g label'.")
    return labels


def _number(path: Path, line: int, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{path}, line {line}: expected a number; got {cell[:40]!r}.")
    return value


@dataclass(frozen=True)
class Labelled:
    """Pieces of takes that a table gives one emotion, and how much was left out."""

    takes: tuple[Take, ...]
    windows: int
    """Windows of these recordings in the table."""
    kept: int
    """Windows in the pieces."""
    doubtful: int
    """Windows left out for a confidence below the rule's."""
    other: Mapping[str, int]
    """Windows left out for an emotion that the rule has not, by emotion."""
    contested: int
    """Windows left out because a window before them, which overlaps, has another emotion."""
    unlabelled: int
    """Takes without a window in the table."""

    def describe(self) -> str:
        """The counts in a line."""
        other = sum(self.other.values())
        names = f" ({', '.join(sorted(self.other))})" if other else ""
        return (
            f"{self.kept} of {self.windows} windows have an emotion, in {len(self.takes)} pieces; left out:"
            f" {self.doubtful} below the confidence, {other} of other emotions{names}, {self.contested} that overlap"
            f" one of another emotion, {self.unlabelled} recordings without a window"
        )


def labelled_takes(takes: Sequence[Take], labels: Sequence[WindowLabel], rule: LabelRule, table: Path) -> Labelled:
    """The pieces of takes in which a classifier is sure of one emotion.

    Windows that overlap or touch and have the same emotion are one piece, so pieces of a recording never overlap. They
    are of one group, so that no recording is in two parts of a split.

    Args:
        takes: recordings of a data set.
        labels: windows of a table.
        rule: which windows count.
        table: path of the table, for errors.

    Raises:
        InputError: the table is of other recordings, or no window is left.
    """
    by_name: dict[str, list[WindowLabel]] = {}
    for label in labels:
        by_name.setdefault(label.name, []).append(label)
    known = [take for take in takes if take.name in by_name]
    if not known:
        raise InputError(f"{table}: has none of these recordings, such as {takes[0].name}; label this folder.")
    pieces: list[Take] = []
    counts: Counter[str] = Counter()
    other: Counter[str] = Counter()
    for take in known:
        windows = sorted(by_name[take.name], key=lambda label: label.start)
        sure = [label for label in windows if label.confidence >= rule.confidence]
        wanted = [label for label in sure if not rule.emotions or label.emotion in rule.emotions]
        other.update(label.emotion for label in sure if label not in wanted)
        runs = _runs(wanted)
        counts.update(
            windows=len(windows),
            doubtful=len(windows) - len(sure),
            kept=sum(len(run) for run in runs),
            contested=len(wanted) - sum(len(run) for run in runs),
        )
        pieces += [_piece(take, run) for run in runs]
    if not pieces:
        raise InputError(
            f"{table}: no window has a confidence of {rule.confidence:g} or more in"
            f" {', '.join(rule.emotions) or 'any emotion'}; lower --confidence, or use a better classifier."
        )
    return Labelled(
        tuple(pieces),
        counts["windows"],
        counts["kept"],
        counts["doubtful"],
        dict(other),
        counts["contested"],
        len(takes) - len(known),
    )


def _runs(windows: Sequence[WindowLabel]) -> list[list[WindowLabel]]:
    """Windows in order of time as runs of one emotion; those that overlap a run of another one are left out."""
    runs: list[list[WindowLabel]] = []
    end = 0.0
    for window in windows:
        same = bool(runs) and runs[-1][-1].emotion == window.emotion
        if same and window.start <= end + _SAME:
            runs[-1].append(window)
        elif not runs or window.start >= end - _SAME:
            runs.append([window])
        else:
            continue
        end = max(end, window.end)
    return runs


def _piece(take: Take, run: Sequence[WindowLabel]) -> Take:
    confidence = sum(window.confidence for window in run) / len(run)
    piece = Piece(run[0].start, max(window.end for window in run), run[0].emotion, round(confidence, 4))
    return replace(take, name=f"{take.name}@{piece.start:g}", group=take.group or take.name, piece=piece)
