"""SHA-256 of large files, kept from one command to the next as long as a file's size and times are the same."""

import hashlib
import json
import os
import time
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
    try:
        before = _state(path)
        store = _store(path)
        kept = _read(store)
        entry = kept.get(path.name)
        if not force and isinstance(entry, dict) and entry.get("state") == before and what in entry:
            return entry[what]
        read_at = time.time()
        result = scan(path)
        after = _state(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); check the path.") from None
    settled = read_at - max(before[1:3]) / 1e9 > _SETTLED
    if before == after and settled:
        same = entry if isinstance(entry, dict) and entry.get("state") == before else {}
        _write(store, kept | {path.name: {**same, "state": before, what: result}})
    return result


def _state(path: Path) -> list[int]:
    status = path.stat()
    # The time of the last change of the file's entry cannot be set back by a program.
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]


def _store(path: Path) -> Path:
    """The file of the cache for a folder."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111 - it never raises
    folder = os.path.realpath(path.parent)
    return Path(base) / "a2g_jax" / "hashes" / f"{hashlib.sha256(os.fsencode(folder)).hexdigest()[:32]}.json"


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
