"""Identity of processes, to distinguish files of killed ones from those of running ones."""

import hashlib
import os
import socket
import sys
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple


class Process(NamedTuple):
    """A process on a host; two of one number differ in their start."""

    host: str
    """Eight hexadecimal digits for the host and, on Linux, its name space of process numbers."""
    pid: int
    start: str
    """When it was started; empty where the system does not say."""

    @property
    def alive(self) -> bool:
        """Whether it may be running: false only for a process of this host that certainly ended."""
        if self.host != host_digits():
            return True
        if self.pid == os.getpid():
            return self.start == started(self.pid)
        if sys.platform == "win32":  # there, signal 0 would end the process
            return True
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return False
        except (OSError, OverflowError):  # another user's
            return True
        return not self.start or self.start == started(self.pid)


def this_process() -> Process:
    """The calling process."""
    return Process(host_digits(), os.getpid(), started(os.getpid()))


@lru_cache(1)
def host_digits() -> str:
    """Digits for this host; containers that share a host name have others."""
    space = ""
    with suppress(OSError):
        space = os.readlink("/proc/self/ns/pid")  # noqa: PTH115 - a name, not a path
    return hashlib.sha256(f"{socket.gethostname()} {space}".encode()).hexdigest()[:8]


def started(pid: int) -> str:
    """When a process was started, as hexadecimal digits; empty without such a process, or where nothing says."""
    try:
        # The name of the program, in brackets, may contain anything.
        after = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2]
        ticks = int(after.split()[19])
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except (OSError, ValueError, IndexError):
        return ""
    return hashlib.sha256(f"{boot} {ticks}".encode()).hexdigest()[:8]
