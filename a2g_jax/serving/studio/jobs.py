"""A queue of long work with one worker thread: states, progress with an estimate, and an end on request."""

import secrets
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from a2g_jax.errors import A2GError, InputError, Interrupted
from a2g_jax.progress import watched

#: Jobs that wait at most.
MOST_WAITING = 16
QUEUED, RUNNING, STOPPING, DONE, FAILED, CANCELLED = "queued", "running", "stopping", "done", "failed", "cancelled"
#: States that do not change any more.
ENDED = (DONE, FAILED, CANCELLED)


class Cancelled(Interrupted):
    """The job's work was ended on request."""


@dataclass(eq=False)
class Job:
    """Work with its state; the work reports through :meth:`step` and :meth:`say`, which end it once it is cancelled."""

    title: str
    work: Callable[["Job"], Any]
    expected: float | None = None
    """Seconds that it will take, where similar work has been measured."""
    refused: Callable[[str], dict[str, str]] = lambda message: {"message": message}
    """What a page shows for the message of an ``InputError``."""
    id: str = field(default_factory=lambda: secrets.token_hex(8))
    state: str = QUEUED
    phase: str = ""
    done: int = 0
    total: int = 0
    unit: str = ""
    started: float | None = None
    """Seconds of :func:`time.monotonic`, as the others."""
    first: float | None = None
    """When the first step was reported: before it, programs are compiled."""
    ended: float | None = None
    error: dict[str, str] | None = None
    result: Any = None
    _changed: Callable[[], None] = lambda: None

    def step(self, done: int = 0, total: int = 0, unit: str = "") -> None:
        """Report steps; 0 of 0 only checks for a cancellation.

        Raises:
            Cancelled: the job is to end.
        """
        if total:
            now = time.monotonic()
            self.first = now if self.first is None or done < self.done else self.first
            self.done, self.total, self.unit = done, total, unit or self.unit
            self._changed()
        if self.state == STOPPING:
            raise Cancelled(f"{self.title}: cancelled.")

    def say(self, phase: str) -> None:
        """Report what is being done now.

        Raises:
            Cancelled: the job is to end.
        """
        self.phase = phase
        self._changed()
        self.step()

    def seconds(self) -> float:
        """Time that it has run."""
        if self.started is None:
            return 0.0
        return (time.monotonic() if self.ended is None else self.ended) - self.started

    def rate(self) -> float | None:
        """Steps a second after the first one, which includes preparations; None before there are two."""
        if self.first is None or self.done < 2:
            return None
        since = (time.monotonic() if self.ended is None else self.ended) - self.first
        # Steps that are reported at once were made together with the first.
        return (self.done - 1) / since if since > 0.2 else self.done / max(self.seconds(), 1e-3)

    def remaining(self) -> float | None:
        """Estimated seconds to the end, from its own rate or from similar work; None if neither is known."""
        if self.state not in (RUNNING, STOPPING):
            return None
        rate = self.rate()
        if rate and self.total:
            return max(self.total - self.done, 0) / rate
        return None if self.expected is None else max(self.expected - self.seconds(), 0.5)

    def to_json(self) -> dict[str, Any]:
        """The state as JSON values."""
        short = lambda value: None if value is None else round(value, 2)  # noqa: E731
        return {
            "id": self.id,
            "title": self.title,
            "state": self.state,
            "phase": self.phase,
            "done": self.done,
            "total": self.total,
            "unit": self.unit,
            "seconds": short(self.seconds()),
            "rate": short(self.rate()),
            "remaining": short(self.remaining()),
            "error": self.error,
        }


class Jobs:
    """A queue whose jobs run one after another in a thread of its own."""

    def __init__(self, waiting: int = MOST_WAITING) -> None:
        """
        Args:
            waiting: jobs that wait at most.
        """
        self._waiting, self._queue = waiting, deque[Job]()
        self._lock = threading.Condition()
        self._running: Job | None = None
        self._closed = False
        self.version = 0
        """Grows with every change of a state or of progress."""
        self._thread = threading.Thread(target=self._work, name="studio-worker", daemon=True)
        self._thread.start()

    def submit(self, job: Job) -> Job:
        """Put a job at the end of the queue.

        Raises:
            InputError: too many wait already, or the queue is closed.
        """
        with self._lock:
            if self._closed:
                raise InputError("the studio is closing; start it again.")
            if len(self._queue) >= self._waiting:
                raise InputError(f"{self._waiting} requests wait already; cancel one, or wait for the next to finish.")
            job._changed = self._touch
            self._queue.append(job)
            self.version += 1
            self._lock.notify_all()
        return job

    def cancel(self, job: Job) -> None:
        """End a job: at once if it waits, at its next checkpoint if it runs; one that has ended stays as it is."""
        with self._lock:
            if job.state == QUEUED and job in self._queue:
                self._queue.remove(job)
                job.state, job.ended = CANCELLED, time.monotonic()
            elif job.state == RUNNING:
                job.state = STOPPING
            self.version += 1
            self._lock.notify_all()

    def position(self, job: Job) -> int:
        """How many jobs come before a waiting one, the running one included."""
        with self._lock:
            before = list(self._queue).index(job) if job in self._queue else 0
            return before + (self._running is not None)

    def wait(self, job: Job, seconds: float) -> bool:
        """Whether a job has ended, after waiting for it at most so long."""
        with self._lock:
            return self._lock.wait_for(lambda: job.state in ENDED, seconds)

    def close(self, seconds: float = 10.0) -> None:
        """Cancel everything and wait for the worker to end."""
        with self._lock:
            self._closed = True
            for job in list(self._queue):
                job.state, job.ended = CANCELLED, time.monotonic()
            self._queue.clear()
            if self._running is not None:
                self._running.state = STOPPING
            self._lock.notify_all()
        self._thread.join(seconds)

    def _touch(self) -> None:
        self.version += 1

    def _work(self) -> None:
        while True:
            with self._lock:
                self._lock.wait_for(lambda: self._queue or self._closed)
                if self._closed:
                    return
                job = self._running = self._queue.popleft()
                job.state, job.started = RUNNING, time.monotonic()
                self.version += 1
            state, error = _run(job)
            with self._lock:
                job.state, job.error, job.ended, self._running = state, error, time.monotonic(), None
                self.version += 1
                self._lock.notify_all()


def _run(job: Job) -> tuple[str, dict[str, str] | None]:
    """The state and error with which a job's work ends; nothing that it raises ends the worker."""
    try:
        with watched(job.step):
            job.result = job.work(job)
        return DONE, None
    except Interrupted:
        return CANCELLED, None
    except A2GError as error:
        return FAILED, job.refused(" ".join(str(error).split()))
    except MemoryError:
        return FAILED, {"message": "there is not enough memory; shorten the speech, or generate fewer samples."}
    except OSError as error:
        return FAILED, {"message": f"a file cannot be written ({error.strerror or error}); check the free space."}
    except Exception as error:  # noqa: BLE001 - a fault of the package must not end the worker
        traceback.print_exc(file=sys.stderr)
        return FAILED, {"message": f"unexpected {type(error).__name__}; the terminal of 'a2g studio' shows more."}
