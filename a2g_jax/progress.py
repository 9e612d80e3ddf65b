"""Progress on standard error: a bar in a terminal, a line every ten seconds in a log file."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")


@contextmanager
def progress_bar(total: int, what: str, unit: str) -> Iterator[tqdm]:
    """A bar with a rate and the remaining time; its line ends also on errors, so that messages start on a new one."""
    every = 0.5 if sys.stderr.isatty() else 10.0
    with tqdm(total=total, desc=what, unit=unit, file=sys.stderr, mininterval=every) as bar:
        yield bar


def counted(items: Iterable[Item], bar: tqdm) -> Iterator[Item]:
    """The items; advances the bar after each."""
    for item in items:
        yield item
        bar.update()


def say(line: str) -> None:
    """Print a line for the user without breaking a bar."""
    tqdm.write(line, file=sys.stderr)
