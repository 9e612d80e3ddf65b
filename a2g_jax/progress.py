"""Progress on standard error: a bar in a terminal, a line every ten seconds in a log file; checkpoints of long work.

A server that runs the work has no terminal, and has to stop it on request: it watches the checkpoints.
"""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")

#: Columns and rows of a terminal that has none.
_SIZE = {"ncols": 80, "nrows": 24}


@contextmanager
def progress_bar(total: int, what: str, unit: str) -> Iterator[tqdm]:
    """A bar with a rate and the remaining time; its line ends also on errors, so that messages start on a new one."""
    terminal = sys.stderr.isatty()
    every = 0.5 if terminal else 10.0
    size = _SIZE if terminal and _has_no_size() else {}
    # A bar inside another one vanishes at its end.
    with tqdm(total=total, desc=what, unit=unit, file=sys.stderr, mininterval=every, leave=None, **size) as bar:
        yield bar


def _has_no_size() -> bool:
    """Whether standard error is a terminal of no columns, as programs open them; a bar would not show there."""
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns == 0
    except (OSError, ValueError):
        return False


def counted(items: Iterable[Item], bar: tqdm) -> Iterator[Item]:
    """The items; advances the bar after each."""
    for item in items:
        yield item
        bar.update()


def say(line: str) -> None:
    """Print a line for the user without breaking a bar."""
    tqdm.write(line, file=sys.stderr)


#: Called at checkpoints: steps done, their number, and their unit; both are 0 where only an interruption is possible.
Watcher = Callable[[int, int, str], None]
_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)


@contextmanager
def watched(watcher: Watcher) -> Iterator[None]:
    """Calls a function at the checkpoints of the block, in this thread alone; what it raises ends the work there."""
    token = _watcher.set(watcher)
    try:
        yield
    finally:
        _watcher.reset(token)


def checkpoint(done: int = 0, total: int = 0, unit: str = "") -> None:
    """A place in long work at which it can be interrupted and its progress shown.

    Args:
        done: steps done of ``total``; 0 of 0 where these are not counted.
        unit: of a step, such as ``frame``.
    """
    watcher = _watcher.get()
    if watcher is not None:
        watcher(done, total, unit)


@contextmanager
def counted_steps(total: int, what: str, unit: str) -> Iterator[Callable[[], None]]:
    """A function to call after each step of long work: it advances a bar or, where checkpoints are watched, is one."""
    done = 0

    def watched_step() -> None:
        nonlocal done
        done += 1
        checkpoint(done, total, unit)

    if _watcher.get() is not None:
        yield watched_step
        return
    with progress_bar(total, what, unit) as bar:

        def shown_step() -> None:
            bar.update()

        yield shown_step
