"""Several processes that train one model together: how they join, agree, and end when one of them is lost.

JAX is imported only when they join, so that the command line answers at once.
"""

import atexit
import ctypes
import os
import signal
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any, NamedTuple

import numpy as np

from a2g_jax.errors import A2GError, InputError, Interrupted

_ADDRESS, _COUNT, _NUMBER = "JAX_COORDINATOR_ADDRESS", "JAX_NUM_PROCESSES", "JAX_PROCESS_ID"
#: What Slurm sets for the tasks of a step that srun starts.
_SLURM_COUNT, _SLURM_NUMBER = "SLURM_STEP_NUM_TASKS", "SLURM_PROCID"
#: Beginnings of the messages of JAX's errors, those of broken connections between processes among them.
_STATUS = ("UNKNOWN", "INTERNAL", "UNAVAILABLE", "DEADLINE_EXCEEDED", "ABORTED", "CANCELLED", "FAILED_PRECONDITION")


class LostProcess(A2GError):
    """Another process of the training has ended."""


class Place(NamedTuple):
    """This process among those of a training; fields are None where Slurm decides them."""

    address: str | None
    processes: int | None
    number: int | None


def find_place(environment: Mapping[str, str] = os.environ) -> Place | None:
    """The place that environment variables give this process; None for a training in one process.

    Raises:
        InputError: some of the variables are missing, or have values that do not fit.
    """
    given = [name for name in (_ADDRESS, _COUNT, _NUMBER) if environment.get(name)]
    if not given:
        tasks = environment.get(_SLURM_COUNT, "1")
        many = _SLURM_NUMBER in environment and tasks.isdigit() and int(tasks) > 1
        return Place(None, None, None) if many else None
    if given == [_COUNT] and environment[_COUNT] == "1":
        return None
    if missing := [name for name in (_ADDRESS, _COUNT, _NUMBER) if name not in given]:
        raise InputError(
            f"{' and '.join(given)} in the environment: {' and '.join(missing)} {'is' if len(missing) == 1 else 'are'}"
            f" missing; set all three in every process ({_ADDRESS}=HOST:PORT of process 0), or none."
        )
    address = environment[_ADDRESS]
    if not address.rpartition(":")[0] or not address.rpartition(":")[2].isdigit():
        raise InputError(f"{_ADDRESS}: expected HOST:PORT of process 0; got {address!r}.")
    count, number = (_whole(name, environment[name]) for name in (_COUNT, _NUMBER))
    if count < 1 or not 0 <= number < count:
        raise InputError(f"{_NUMBER}: expected 0 to {max(count, 1) - 1} for {_COUNT}={count}; got {number}.")
    return None if count == 1 else Place(address, count, number)


def _whole(name: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(f"{name}: expected a whole number; got {text!r}.") from None


@contextmanager
def joined_processes() -> Iterator[None]:
    """Join the other processes of a training if environment variables name them (:func:`find_place`).

    To be entered before JAX computes anything. Processes that end together wait for each other; where one ends alone,
    the others end with :class:`LostProcess`, one line and status 2, whatever they are waiting for.

    Raises:
        InputError: environment variables that do not fit, or Windows, where JAX has no Gloo.
        LostProcess: the others were never there, or one of them has ended.
    """
    place = find_place()
    if place is None:
        yield
        return
    if os.name == "nt":
        raise InputError("several processes train together on Linux and macOS alone; on Windows, use one.")
    with _Watch(place) as watch:
        _join(place)
        watch.joined()
        try:
            yield
            _part(watch)
        except Interrupted:
            _part(watch)
            raise
        except BaseException as error:
            # JAX would wait at its exit for processes that wait for this one.
            atexit.register(_exit_at_once, 2 if isinstance(error, A2GError) or _broken(error) else 1)
            if not _broken(error):
                raise
            raise LostProcess(watch.message(str(error))) from error


def _join(place: Place) -> None:
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "2")
    import jax

    jax.config.update("jax_cpu_collectives_implementation", "gloo")
    with suppress(AttributeError):  # its handler of SIGTERM would take the place of the loop's
        jax.config.update("jax_enable_preemption_service", False)
    try:
        jax.distributed.initialize(place.address, place.processes, place.number)
    except (RuntimeError, ValueError) as error:
        raise InputError(
            f"the processes of the training cannot join ({str(error).splitlines()[0][:200]}); check {_ADDRESS},"
            f" {_COUNT} and {_NUMBER}, and that process 0 can be reached."
        ) from None


def _part(watch: "_Watch") -> None:
    """End together: process 0, which the others are connected to, last."""
    import jax

    together("end")
    watch.ended()
    jax.distributed.shutdown()


def _broken(error: BaseException) -> bool:
    """Whether an error is that of a broken connection."""
    return isinstance(error, RuntimeError | ValueError) and str(error).startswith(_STATUS)


def _exit_at_once(status: int) -> None:
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(status)


class _Watch:
    """Turns the abort with which JAX ends a process whose coordinator is lost into one line and status 2.

    JAX has no other way to learn of it. What its libraries print meanwhile is kept back, and printed if they abort for
    another reason.
    """

    def __init__(self, place: Place) -> None:
        self._place = place
        self._state = "joining"

    def __enter__(self) -> "_Watch":
        sys.stderr.flush()
        self._stderr = os.dup(2)
        self._kept = tempfile.TemporaryFile()
        self._python = sys.stderr
        os.dup2(self._kept.fileno(), 2)
        # Python's own lines go where they went before.
        sys.stderr = os.fdopen(os.dup(self._stderr), "w", buffering=1, encoding="utf-8", errors="backslashreplace")
        self._handler = ctypes.CFUNCTYPE(None, ctypes.c_int)(self._aborted)
        self._library = ctypes.CDLL(None)
        self._library.signal.restype = ctypes.c_void_p
        self._library.signal.argtypes = [ctypes.c_int, ctypes.c_void_p]
        self._before = self._library.signal(signal.SIGABRT, ctypes.cast(self._handler, ctypes.c_void_p))
        return self

    def __exit__(self, *_: object) -> None:
        if self._state != "ended":
            return  # the handler stays until the process ends, which it is about to do
        self._library.signal(signal.SIGABRT, self._before)
        sys.stderr.close()
        sys.stderr = self._python
        os.dup2(self._stderr, 2)
        os.close(self._stderr)
        self._kept.close()

    def joined(self) -> None:
        """All processes are there."""
        self._state = "joined"

    def ended(self) -> None:
        """All processes are about to end."""
        self._state = "ended"

    def message(self, reason: str) -> str:
        """The line about a lost process."""
        where = "" if self._place.number is None else f"process {self._place.number} of {self._place.processes}: "
        if self._state == "joining":
            return (
                f"{where}the others did not join at {self._place.address or 'the address that Slurm gives'}; start all"
                " of them, and check that process 0 can be reached."
            )
        first = reason.splitlines()[0] if reason else "no reason was given"
        return (
            f"{where}another process of the training has ended, so this one does too; look at the output of the others,"
            f" then start all of them again with --resume ({first[:160]})"
        )

    def _aborted(self, _number: int) -> None:
        self._kept.seek(0)
        kept = self._kept.read().decode("utf-8", "replace")
        if self._state == "ended":
            os._exit(0)
        if "coordination" in kept.lower() or "distributed service" in kept:
            lines = [line for line in kept.splitlines() if "UNAVAILABLE" in line or "DEADLINE" in line]
            reason = lines[0].partition("] ")[2] if lines else ""
            os.write(self._stderr, f"a2g: {self.message(reason)}\n".encode())
            os._exit(2)
        os.write(self._stderr, kept.encode())
        os._exit(128 + signal.SIGABRT)


def is_first() -> bool:
    """Whether this process writes files and prints: the first one, or the only one."""
    import jax

    return bool(jax.process_index() == 0)


def several() -> bool:
    """Whether several processes train."""
    import jax

    return bool(jax.process_count() > 1)


def together(name: str) -> None:
    """Wait until all processes are here."""
    if several():
        from jax.experimental import multihost_utils

        multihost_utils.sync_global_devices(name)


def of_first(values: Sequence[int]) -> tuple[int, ...]:
    """The whole numbers of the first process, in all processes."""
    if not several():
        return tuple(values)
    from jax.experimental import multihost_utils

    return tuple(int(value) for value in multihost_utils.broadcast_one_to_all(np.array(values, np.int32)))


def arrays_of_first(tree: Any) -> Any:
    """The arrays of the first process, in all processes."""
    if not several():
        return tree
    from jax.experimental import multihost_utils

    return multihost_utils.broadcast_one_to_all(tree)


def check_same(what: str, digest: bytes) -> None:
    """Compare a hash with that of the first process.

    Raises:
        InputError: it differs.
    """
    mine = tuple(int(number) for number in np.frombuffer(digest[:16], np.int32))
    if of_first(mine) != mine:
        import jax

        raise InputError(
            f"process {jax.process_index()}: has {what} than process 0; start all processes with the same command, the"
            " same corpus and the same version."
        )
