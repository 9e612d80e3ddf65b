"""Progress on standard error: a bar in a terminal, a line now and then in a log file."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")


@contextmanager
def progress_bar(total: int, what: str, unit: str) -> Iterator[tqdm]:
    """A bar with a rate and an estimate; its line ends whatever happens, so that an error starts one of its own."""
    every = 0.5 if sys.stderr.isatty() else 10.0
    with tqdm(total=total, desc=what, unit=unit, file=sys.stderr, mininterval=every) as bar:
        yield bar


def counted(items: Iterable[Item], bar: tqdm) -> Iterator[Item]:
    """The items, each counted on the bar once it was used."""
    for item in items:
        yield item
        bar.update()


def say(line: str) -> None:
    """A line for the user that leaves a bar whole."""
    tqdm.write(line, file=sys.stderr)
