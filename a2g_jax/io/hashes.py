"""SHA-256 of large files, kept from one command to the next as long as a file's size and times are the same."""

import hashlib
import json
import os
import stat
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.temporary import temporary_path

_BLOCK = 2**20
#: A file that changed less than this many seconds before it was read may change again without another time.
_SETTLED = 2.0


def cached_sha256(path: Path, force: bool = False) -> str:
    """SHA-256 of a file, read only if it may have changed since the last time.

    The user's cache folder holds what was computed; where it cannot be written, every call reads the file.

    Args:
        force: read it in any case, since bits on a disk may change without a trace.

    Raises:
        InputError: no such file, or it cannot be read.
    """
    return str(cached_scan(path, "sha256", sha256_blocks, force))


def sha256_blocks(path: Path) -> str:
    """SHA-256 of a file, read block by block."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def cached_scan(path: Path, what: str, scan: Any, force: bool = False) -> Any:
    """The result of ``scan(path)``, a JSON value that depends on the file's bytes alone; kept as by
    :func:`cached_sha256`.

    Args:
        what: name of the result in the cache.

    Raises:
        InputError: no such file, or it cannot be read.
    """
    return cached_scans(path.parent, (path.name,), what, scan, force)[path.name]


def cached_scans(folder: Path, names: Sequence[str], what: str, scan: Any, force: bool = False) -> dict[str, Any]:
    """As :func:`cached_scan` of several files of a folder, by name, whose cache is read once.

    A name may also be that of a folder of files, which changes when one of them changes.
    """
    path = folder
    try:
        store = _store(folder)
        kept = _read(store)
        found, fresh = {}, {}
        for name in names:
            path = folder / name
            before, entry = _state(path), kept.get(name)
            same: dict[str, Any] = entry if isinstance(entry, dict) and entry.get("state") == before else {}
            if what in same and not force:
                found[name] = same[what]
                continue
            read_at = time.time()
            found[name] = scan(path)
            if before == _state(path) and read_at - max(before[1:3]) / 1e9 > _SETTLED:
                fresh[name] = {**same, "state": before, what: found[name]}
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); check the path.") from None
    if fresh:
        _write(store, kept | fresh)
    return found


def _state(path: Path) -> list[Any]:
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        return _folder_state(path)
    # The time of the last change of the file's entry cannot be set back by a program.
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]


def _folder_state(path: Path) -> list[Any]:
    """Number of files, their latest times, and a digest of the states of all."""
    digest, count, modified, changed = hashlib.sha256(), 0, 0, 0
    with os.scandir(path) as entries:
        for entry in sorted(entries, key=lambda one: one.name):
            status = entry.stat()
            state = (entry.name, status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino)
            digest.update(repr(state).encode())
            count, modified, changed = count + 1, max(modified, state[2]), max(changed, state[3])
    return [count, modified, changed, digest.hexdigest()]


def _store(folder: Path) -> Path:
    """The file of the cache for a folder; folders beside it have their own."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111 - it never raises
    name = hashlib.sha256(os.fsencode(os.path.realpath(folder))).hexdigest()[:32]
    return Path(base) / "a2g_jax" / "hashes" / f"{name}.json"


def _read(store: Path) -> dict[str, Any]:
    with suppress(OSError, ValueError):
        found = json.loads(store.read_text(encoding="utf-8"))
        if isinstance(found, dict) and found.pop("seal", None) == _seal(found):
            return found
    return {}


def _write(store: Path, kept: dict[str, Any]) -> None:
    with suppress(OSError):  # a cache is no reason to fail
        store.parent.mkdir(parents=True, exist_ok=True)
        temporary = temporary_path(store)
        try:
            temporary.write_text(json.dumps({**kept, "seal": _seal(kept)}), encoding="utf-8")
            temporary.replace(store)
        finally:
            temporary.unlink(missing_ok=True)


def _seal(kept: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()
