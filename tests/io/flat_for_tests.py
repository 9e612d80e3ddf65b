"""A writer of FlatBuffers tables, as far as Arrow's metadata needs one (FlatBuffers, "Internals").

A value of a field is None (left out), ``(format, number)``, ``Table``, ``Tables``, ``Structs`` or text. What a table
points at is written behind it, so that all offsets point forward.
"""

import struct
from dataclasses import dataclass


@dataclass
class Table:
    fields: tuple


@dataclass
class Tables:
    tables: list[Table]


@dataclass
class Structs:
    """A list of structs, or of numbers, of one format."""

    format: str
    rows: list[tuple]


@dataclass
class Inline:
    """A struct that lies in its table."""

    format: str
    row: tuple


def flat(root: Table) -> bytes:
    """The bytes of a message, filled up to a multiple of eight."""
    out = bytearray(4)
    struct.pack_into("<I", out, 0, _table(out, root))
    _fill(out, 8)
    return bytes(out)


def _fill(out: bytearray, width: int) -> None:
    out.extend(bytes(-len(out) % width))


def _table(out: bytearray, table: Table) -> int:
    sizes = [8 if value is None else _width(value) for value in table.fields]
    places, size = [], 4
    for value, width in zip(table.fields, sizes, strict=True):
        if value is None:
            places.append(0)
            continue
        size += -size % min(width, 8)
        places.append(size)
        size += width
    _fill(out, 2)
    listed = struct.pack(f"<HH{len(places)}H", 4 + 2 * len(places), size, *places)
    vtable = len(out)
    out.extend(listed)
    _fill(out, 8)
    start = len(out)
    out.extend(bytes(size))
    struct.pack_into("<i", out, start, start - vtable)
    for value, place in zip(table.fields, places, strict=True):
        at = start + place
        if value is None:
            continue
        if isinstance(value, tuple):
            struct.pack_into("<" + value[0], out, at, value[1])
        elif isinstance(value, Inline):
            struct.pack_into("<" + value.format, out, at, *value.row)
        else:
            struct.pack_into("<I", out, at, _pointed(out, value) - at)
    return start


def _width(value: object) -> int:
    if isinstance(value, tuple):
        return struct.calcsize("<" + value[0])
    return struct.calcsize("<" + value.format) if isinstance(value, Inline) else 4


def _pointed(out: bytearray, value: object) -> int:
    if isinstance(value, Table):
        return _table(out, value)
    if isinstance(value, str):
        raw = value.encode()
        _fill(out, 4)
        start = len(out)
        out.extend(struct.pack("<I", len(raw)) + raw + b"\0")
        return start
    _fill(out, 8)
    out.extend(bytes(4))  # so that elements of eight bytes lie on multiples of eight
    start = len(out)
    if isinstance(value, Structs):
        out.extend(struct.pack("<I", len(value.rows)))
        out.extend(b"".join(struct.pack("<" + value.format, *row) for row in value.rows))
        return start
    assert isinstance(value, Tables)
    out.extend(struct.pack("<I", len(value.tables)) + bytes(4 * len(value.tables)))
    for index, table in enumerate(value.tables):
        at = start + 4 + 4 * index
        struct.pack_into("<I", out, at, _table(out, table) - at)
    return start
