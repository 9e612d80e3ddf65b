"""Locks between processes, which end with their holder however it ends."""

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from a2g_jax.errors import InputError
from a2g_jax.io.processes import Process, this_process

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


@contextmanager
def locked(path: Path, busy: str) -> Iterator[None]:
    """Hold the lock of a file, which is created and, in the end, removed.

    The system releases it when its holder ends, also by SIGKILL. On file systems without such locks, the content of the
    file decides: one whose process has ended is taken over.

    Args:
        busy: beginning of the error where another process holds it, such as ``"run: is being trained"``.

    Raises:
        InputError: another process holds it; the message has its number and host. Or the file cannot be written.
    """
    file = _acquire(path, busy)
    try:
        yield
    finally:
        # Removed while it is held, so that nobody removes the lock of the next holder; Windows removes it on closing.
        with suppress(OSError):
            path.unlink()
        os.close(file)
        with suppress(OSError):
            path.unlink()


def _acquire(path: Path, busy: str) -> int:
    while True:
        try:
            file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise InputError(
                f"{path}: cannot be written ({error.strerror}); check the folder, its permissions and free space."
            ) from None
        try:
            if not _try_lock(file, path):
                raise InputError(f"{busy} by another process{_described(_holder(path))}; wait for it, or end it.")
            # Its last holder may have removed it meanwhile; then this is no longer the file of that name.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file), path.stat()):
                    _sign(file)
                    return file
        except BaseException:
            os.close(file)
            raise
        os.close(file)


def _try_lock(file: int, path: Path) -> bool:
    if fcntl is not None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            return False
        except OSError:  # a file system without locks
            pass
    holder = _holder(path)
    process = None if holder is None else Process(str(holder["key"]), int(holder["pid"]), str(holder["start"]))
    return process is None or process == this_process() or not process.alive


def _sign(file: int) -> None:
    """Write who holds the lock; on a full disk it holds without."""
    process = this_process()
    about = {
        "pid": process.pid,
        "host": socket.gethostname(),
        "since": datetime.now().astimezone().isoformat(timespec="seconds"),
        "key": process.host,
        "start": process.start,
    }
    with suppress(OSError):
        os.ftruncate(file, 0)
        os.pwrite(file, (json.dumps(about) + "\n").encode(), 0) if hasattr(os, "pwrite") else os.write(
            file, json.dumps(about).encode()
        )


def _holder(path: Path) -> dict | None:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return found if {"pid", "host", "key", "start"} <= found.keys() else None
    except (OSError, ValueError, AttributeError):
        return None


def _described(holder: dict | None) -> str:
    if holder is None:
        return ""
    return f" (process {holder['pid']} on {holder['host']}, since {holder.get('since')})"
