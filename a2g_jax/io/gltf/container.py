"""The container of a GLB file (glTF 2.0, section 4.4): a header, a chunk of JSON, and a chunk of binary data."""

import json
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from a2g_jax.errors import InputError
from a2g_jax.io.files import atomic_path, check_readable

#: Most bytes of a file, and of the JSON in it: characters have 1 to 100 MB, their JSON up to a few.
LARGEST, LARGEST_JSON = 1 << 30, 64 << 20
_MAGIC, _JSON, _BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942


@dataclass(frozen=True, eq=False)
class Glb:
    """A GLB file in memory."""

    path: Path
    document: dict[str, Any]
    """The JSON."""
    binary: bytes
    """The binary chunk, which is buffer 0; empty without one."""


def fail(path: object, place: str, message: str) -> NoReturn:
    """Raise an ``InputError`` for a place in a file, such as ``nodes[3]``."""
    raise InputError(f"{path}, {place}: {message}")


def read_glb(path: str | os.PathLike[str]) -> Glb:
    """Read the container of a GLB (or VRM) file; nothing in it is interpreted.

    Raises:
        InputError: not a GLB file of version 2, cut short, damaged, or too large.
    """
    path = check_readable(path, "a GLB file")
    size = path.stat().st_size
    if size > LARGEST:
        raise InputError(
            f"{path}: has {size / 1e9:.1f} GB, and 1 GB is read at most; export the character with smaller textures"
            " or fewer meshes."
        )
    with path.open("rb") as file:
        content = file.read(LARGEST + 1)
    if content[:1] in (b"{", b"\xef", b"\n", b" ") and b'"asset"' in content[:1_000_000]:
        raise InputError(f"{path}: is glTF as text; export it as one binary file (glTF Binary, .glb).")
    if len(content) < 20 or struct.unpack_from("<I", content)[0] != _MAGIC:
        raise InputError(f"{path}: is not a GLB file (it does not begin with 'glTF'); export it as glTF Binary, .glb.")
    _, version, length = struct.unpack_from("<3I", content)
    if version != 2:
        raise InputError(f"{path}, header: is glTF version {version}; export it as glTF 2.0.")
    if length > len(content):
        raise InputError(
            f"{path}, header: promises {length} bytes and the file has {len(content)}: it is cut short; copy or"
            " export it again."
        )
    chunks = _chunks(path, content[:length])
    if not chunks or chunks[0][0] != _JSON:
        fail(path, "chunk 0", "expected JSON as the first chunk; the file is damaged: export it again.")
    binary = next((body for kind, body in chunks[1:2] if kind == _BINARY), b"")
    return Glb(path, _document(path, chunks[0][1]), binary)


def _chunks(path: Path, content: bytes) -> list[tuple[int, bytes]]:
    found: list[tuple[int, bytes]] = []
    at = 12
    while at + 8 <= len(content) and len(found) < 2:
        size, kind = struct.unpack_from("<2I", content, at)
        if at + 8 + size > len(content):
            fail(
                path,
                f"chunk {len(found)}",
                f"promises {size} bytes where {len(content) - at - 8} are left: the file is damaged; export it again.",
            )
        found.append((kind, content[at + 8 : at + 8 + size]))
        at += 8 + size
    return found


def _document(path: Path, text: bytes) -> dict[str, Any]:
    if len(text) > LARGEST_JSON:
        fail(path, "JSON", f"has {len(text) / 1e6:.0f} MB, and 64 MB are read at most; export fewer objects.")

    def constant(name: str) -> NoReturn:
        raise ValueError(f"the number {name}")

    try:
        document = json.loads(text.decode("utf-8"), parse_constant=constant)
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else " ".join(str(error).split())[:120]
        fail(path, "JSON", f"cannot be read ({reason}): the file is damaged; export it again.")
    if not isinstance(document, dict):
        fail(path, "JSON", "expected an object; the file is damaged: export it again.")
    for key in ("nodes", "skins", "accessors", "bufferViews", "buffers", "animations", "scenes", "meshes"):
        rows = document.get(key, [])
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            fail(path, f"JSON, {key}", "expected a list of objects; the file is damaged: export it again.")
    return document


def write_glb(path: str | os.PathLike[str], document: dict[str, Any], binary: bytes) -> None:
    """Write a GLB file, atomically.

    Args:
        document: the JSON, whose buffer 0 is as long as ``binary``.

    Raises:
        InputError: the file would be too large.
        OutputError: it cannot be written.
    """
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode("utf-8", "replace")
    text += b" " * (-len(text) % 4)
    body = binary + b"\0" * (-len(binary) % 4)
    length = 12 + 8 + len(text) + (8 + len(body) if body else 0)
    if length > LARGEST:
        raise InputError(f"{path}: not written: more than 1 GB; use a shorter speech or a smaller character.")
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(struct.pack("<3I", _MAGIC, 2, length))
        file.write(struct.pack("<2I", len(text), _JSON) + text)
        if body:
            file.write(struct.pack("<2I", len(body), _BINARY))
            file.write(body)
