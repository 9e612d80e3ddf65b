"""Stopping a training between two steps."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.training.devices import Devices
from a2g_jax.training.processes import several


@contextmanager
def stop_requested() -> Iterator[threading.Event]:
    """An event that SIGINT and SIGTERM set, so that a step is never interrupted; a second signal ends at once."""
    event = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield event
        return

    def stop(number: int, _frame: Any) -> None:
        event.set()
        signal.signal(number, before[signal.Signals(number)])

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield event
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class StopVote:
    """Whether to stop after this step: the same answer in all processes, which get their signals at different steps.

    Of several processes the answer is that of the step before, so that no step waits for it.
    """

    def __init__(self, event: threading.Event, devices: Devices) -> None:
        self._event, self._devices = event, devices
        self._any = jax.jit(jnp.any, **devices.jit_options())
        self._last: jax.Array | None = None

    def __call__(self) -> bool:
        """The answer; to be called once a step in every process."""
        if not several():
            return self._event.is_set()
        mine = np.full(len(self._devices.rows(self._devices.count)), self._event.is_set())
        before, self._last = self._last, self._any(self._devices.shard({"stop": mine}, self._devices.count)["stop"])
        return before is not None and bool(before)
