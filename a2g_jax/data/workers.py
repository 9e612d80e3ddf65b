"""Worker processes that work ahead in order, end with their parent, and are reported when they die before it."""

import itertools
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import TypeVar

from a2g_jax.errors import A2GError

Item = TypeVar("Item")
Result = TypeVar("Result")


class WorkerDiedError(A2GError):
    """A worker process ended before its work was finished: killed, or out of memory."""


@contextmanager
def worker_pool(workers: int, fix: str, nice: int = 0) -> Iterator[ProcessPoolExecutor]:
    """A pool of fresh processes; work that has not begun when the block ends is dropped.

    Args:
        fix: what the user can do if a worker dies.
        nice: priority of the workers below that of other processes (see ``nice(1)``).

    Raises:
        WorkerDiedError: a worker died.
    """
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_begin, initargs=(nice,))
    try:
        with _interrupts_blocked():
            pool.submit(int)  # the first piece of work starts all processes
        yield pool
    except BrokenProcessPool:
        raise WorkerDiedError(f"a worker process died, killed from outside or for lack of memory; {fix}.") from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def in_order(pool: ProcessPoolExecutor, work: Callable[[Item], Result], items: Iterable[Item], ahead: int) -> Iterator:
    """Results of the items in order; at most ``ahead`` of them are in progress or waiting."""
    rest = iter(items)
    waiting: deque[Future[Result]] = deque(pool.submit(work, item) for item in itertools.islice(rest, ahead))
    while waiting:
        yield waiting.popleft().result()
        waiting.extend(pool.submit(work, item) for item in itertools.islice(rest, 1))


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Delay Ctrl-C until the block ends; processes started in it never receive it.

    It reaches every process of a terminal, and would end a worker that is still starting.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(nice: int) -> None:
    # Only the parent handles Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if nice and hasattr(os, "nice"):
        os.nice(nice)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Exit when the parent ends: a killed parent cannot stop its workers, which would wait for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
