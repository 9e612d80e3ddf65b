"""Names of temporary files and folders, and the removal of those that killed processes left.

A name holds the process that made it, so that nothing of a living process is ever removed.
"""

import os
import re
import secrets
import shutil
from contextlib import suppress
from pathlib import Path

from a2g_jax.io.processes import Process, this_process

_NAME = re.compile(r"\..*\.a2g-([0-9a-f]{8})-([0-9]{1,10})-([0-9a-f]{0,8})-[0-9a-f]{12}(?:\.[^.]*)?", re.DOTALL)
#: Folders that this process has swept.
_swept: set[tuple[int, str]] = set()


def temporary_path(target: Path) -> Path:
    """A hidden path beside a file or folder, with its suffix, that no other process uses.

    The folder's temporary files of ended processes are removed first.
    """
    sweep(target.parent)
    host, pid, start = this_process()
    token = f"a2g-{host}-{pid}-{start}-{secrets.token_hex(6)}"
    return target.with_name(f".{target.stem[:80]}.{token}{target.suffix}")


def owner(name: str) -> Process | None:
    """The process that made a temporary file; None for other names."""
    match = _NAME.fullmatch(name)
    return None if match is None else Process(match[1], int(match[2]), match[3])


def sweep(folder: Path) -> None:
    """Remove temporary files that ended processes of this host left in a folder; once a folder and process."""
    key = (os.getpid(), os.path.realpath(folder))
    if key in _swept:
        return
    _swept.add(key)
    with suppress(OSError):
        for entry in os.scandir(folder):
            process = owner(entry.name)
            if process is not None and not process.alive:
                remove(Path(entry.path))


def remove(path: Path) -> None:
    """Remove a file or folder, if possible."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink(missing_ok=True)
