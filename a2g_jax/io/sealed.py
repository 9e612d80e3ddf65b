"""JSON files with a checksum of their own bytes, so that a changed one is refused before it is used."""

import hashlib
import os
import re
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.files import atomic_path, check_readable, json_text, parse_json

CHECKSUM = "checksum"
_EMPTY = "0" * 64
#: The end of a sealed file, as :func:`write_sealed` writes it.
_END = re.compile(rb'"checksum": "([0-9a-f]{64})"\n\}\n\Z')


def sealed_text(value: dict[str, Any]) -> str:
    """A JSON object as text, with ``checksum`` as its last entry: the SHA-256 of the text with zeros in its place."""
    plain = {name: part for name, part in value.items() if name != CHECKSUM}
    text = json_text(plain | {CHECKSUM: _EMPTY})
    digest = hashlib.sha256(text.encode()).hexdigest()
    return text[: -len(_EMPTY) - 4] + digest + text[-4:]


def write_sealed(path: str | os.PathLike[str], value: dict[str, Any]) -> None:
    """Write a JSON object with its checksum, atomically."""
    text = sealed_text(value)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def read_sealed(path: str | os.PathLike[str], sealed_with: tuple[str, ...] = ()) -> Any:
    """Read a JSON file and compare its checksum, if it has one.

    Files of earlier versions have none. ``"checksum": null`` accepts an edit.

    Args:
        sealed_with: entries that only files with a checksum have.

    Returns:
        The value, without its checksum.

    Raises:
        InputError: as :func:`~a2g_jax.io.files.read_json`, or the content differs from the checksum.
    """
    path = check_readable(path, "a JSON file")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the disk.") from None
    value = parse_json(data, path)
    if not isinstance(value, dict):
        return value
    if CHECKSUM not in value:
        if lost := [name for name in sealed_with if name in value]:
            raise InputError(f"{path}: is damaged (it has {lost[0]!r} and no checksum); restore it.")
        return value
    if value.pop(CHECKSUM) is not None and not _intact(data):
        raise InputError(
            f"{path}: differs from its checksum: it is damaged, or was edited; restore it, or, to accept an edit of"
            f' your own, write "{CHECKSUM}": null in it.'
        )
    return value


def _intact(data: bytes) -> bool:
    data = data.replace(b"\r\n", b"\n")  # version control may have changed the ends of lines
    end = _END.search(data, max(len(data) - 100, 0))
    if end is None:
        return False
    start, stop = end.span(1)
    return hashlib.sha256(data[:start] + _EMPTY.encode() + data[stop:]).hexdigest().encode() == end[1]


def seal_file(path: Path) -> None:
    """Add the checksum to a JSON file, or renew it."""
    write_sealed(path, parse_json(path.read_bytes(), path))
