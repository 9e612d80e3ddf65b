"""Reading one file in a process of its own, within limits, and what became of it."""

import os
import resource
import signal
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from a2g_jax.errors import InputError

READ, REFUSED, UNNAMED = "read", "refused", "refused, not in one line with its name"
CRASH, SLOW, LARGE = "crash", "over 5 s", "over 2 GB"
OUTCOMES = (READ, REFUSED, UNNAMED, CRASH, SLOW, LARGE)
#: Bounds of the issue: processor seconds, and bytes of memory.
SECONDS, MEMORY = 5.0, 2 * 10**9
#: Longest message: some name all settings.
_LONGEST_LINE = 2500
#: Where the process is stopped.
_STOP_SECONDS, _STOP_MEMORY = 15, 6 * 10**9


class Outcome(NamedTuple):
    """What became of one file."""

    kind: str
    seconds: float
    """Of the processor."""
    megabytes: float
    """Largest memory of the process, without what the program has before."""
    message: str


def read_apart(read: Callable[[Path], Any], path: Path) -> Outcome:
    """Read a file in a fork of this process."""
    receive, send = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(receive)
        size, resident = _memory()
        _limit(size)
        text = f"{resident}\n{_attempt(read, path)}"
        with os.fdopen(send, "wb") as pipe:
            pipe.write(text.encode("utf-8", "replace")[:4000])
        os._exit(0)
    os.close(send)
    with os.fdopen(receive, "rb") as pipe:
        text = pipe.read().decode("utf-8", "replace")
    _, status, usage = os.wait4(child, 0)
    resident, _, text = text.partition("\n")
    kind, _, message = text.partition("\n")
    if not kind:
        kind, message = CRASH, f"ended by signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else "ended"
    seconds, megabytes = usage.ru_utime + usage.ru_stime, max(0.0, usage.ru_maxrss * 1024 - int(resident or 0)) / 1e6
    if kind in (READ, REFUSED, UNNAMED) or "signal 24" in message or "MemoryError" in message:
        kind = SLOW if seconds > SECONDS else LARGE if megabytes * 1e6 > MEMORY or "MemoryError" in message else kind
    return Outcome(kind, seconds, megabytes, message)


def _memory() -> tuple[int, int]:
    """Address space and resident memory of this process, bytes, of which a fork has the same."""
    size, resident = Path("/proc/self/statm").read_text().split()[:2]
    page = os.sysconf("SC_PAGE_SIZE")
    return int(size) * page, int(resident) * page


def _limit(before: int) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (_STOP_SECONDS, _STOP_SECONDS + 1))
    resource.setrlimit(resource.RLIMIT_AS, (before + _STOP_MEMORY,) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)


def _attempt(read: Callable[[Path], Any], path: Path) -> str:
    try:
        read(path)
    except InputError as error:
        message = str(error)
        named = path.name in message or path.parent.name in message
        right = named and "\n" not in message and len(message) < _LONGEST_LINE + len(str(path))
        return f"{REFUSED if right else UNNAMED}\n{message}"
    except BaseException as error:  # noqa: BLE001 - whatever it is, it is a finding
        frames = traceback.extract_tb(error.__traceback__)
        own = [f"{Path(frame.filename).name}:{frame.lineno}" for frame in frames][-4:]
        return f"{CRASH}\n{type(error).__name__}: {str(error)[:300]} ({' > '.join(own)})"
    return f"{READ}\n"
