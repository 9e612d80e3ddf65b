"""One case: a file, what is right for it, and the check."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from a2g_jax.errors import InputError
from a2g_jax.inspection.inspect import inspect
from a2g_jax.inspection.report import Report

#: Whether the outcome is right, and the outcome in words.
Outcome = tuple[bool, str]


@dataclass(frozen=True)
class Case:
    """A file and its right outcome."""

    file: str
    """Path below the folder of cases, such as ``"bvh/ref.bvh"``."""
    expected: str
    """The right outcome, in words."""
    check: Callable[[Path], Outcome]
    """Judges the file at a path; an ``InputError`` is a wrong outcome unless the check catches it."""


def cases_folder() -> Path:
    """The folder of problem files: ``cases`` beside that of the real recordings (``A2G_SHARED_DATA``)."""
    data = os.environ.get("A2G_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data")
    return Path(data).parent / "cases"


def judge(case: Case, folder: Path) -> Outcome:
    """The outcome of one case; an error that no check expects is a wrong one."""
    path = folder / case.file
    if not path.is_file():
        return False, "there is no such file"
    try:
        return case.check(path)
    except InputError as error:
        return False, f"refused: {brief(error)}"


def brief(text: object, length: int = 160) -> str:
    """Text on one line, without folders, shortened."""
    line = " ".join(str(text).split())
    return line if len(line) <= length else line[: length - 3] + "..."


def line_of(case: Case, outcome: Outcome) -> str:
    """The line that the command prints."""
    right, what = outcome
    return f"{'right' if right else 'WRONG'}  {case.file}: expected {case.expected}; {what}"


def finds(*codes: str, words: str = "", audio: str | None = None) -> Callable[[Path], Outcome]:
    """A check: ``a2g inspect`` reports findings of these codes, one of them with certain words, and nothing else.

    Args:
        audio: the speech that belongs to the file, relative to it.
    """

    def check(path: Path) -> Outcome:
        report = inspect(path, None if audio is None else path.parent / audio)
        found = {finding.code for finding in report.findings if finding.severity == "warning"}
        right = set(codes) <= {finding.code for finding in report.findings} and found <= set(codes)
        return right and words in report.text(), reported(report, codes)

    return check


def reported(report: Report, codes: tuple[str, ...] = ()) -> str:
    """Warnings, and findings of certain codes, in words."""
    lines = [f.line() for f in report.findings if f.severity == "warning" or f.code in codes]
    return brief("; ".join(line.replace(f"{report.path}: ", "") for line in lines) or "nothing reported")


def refuses(*words: str, call: Callable[[Path], object] = inspect) -> Callable[[Path], Outcome]:
    """A check: a call refuses the file in one line that holds these words."""

    def check(path: Path) -> Outcome:
        try:
            call(path)
        except InputError as error:
            text = str(error)
            return all(word in text for word in words) and "\n" not in text, f"refused: {brief(text)}"
        return False, "accepted"

    return check
