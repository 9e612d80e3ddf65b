"""Writers of what only readers are needed for otherwise: payloads of old pyarrow, and LMDB databases.

From another folder of tests: ``from tests.io.untrusted_writers import arrow_payload, write_lmdb``.
"""

import struct
from pathlib import Path
from typing import Any

import numpy as np

from tests.io.flat_for_tests import Inline, Structs, Table, Tables, flat

_TYPES = {  # number of a column -> of what type: number in Arrow's union ``Type``, and fields of its table
    0: (6, ()),
    1: (2, (("i", 64), ("B", 1))),
    3: (4, ()),
    4: (5, ()),
    5: (3, (("h", 0),)),
    6: (3, (("h", 1),)),
    7: (3, (("h", 2),)),
    14: (2, (("i", 32), ("B", 1))),
    15: (2, (("i", 32), ("B", 1))),
}
_NUMBERS = {1: "<i8", 5: "<f2", 6: "<f4", 7: "<f8", 14: "<i4", 15: "<i4"}
_BOOL, _INT, _BYTES, _TEXT, _HALF, _FLOAT, _DOUBLE = 0, 1, 3, 4, 5, 6, 7
_LIST, _DICT, _TUPLE, _SET, _ARRAY, _BUFFER = 9, 10, 11, 12, 14, 15
_KINDS = {
    bool: _BOOL, int: _INT, bytes: _BYTES, str: _TEXT, np.float16: _HALF, np.float32: _FLOAT, float: _DOUBLE,
    list: _LIST, dict: _DICT, tuple: _TUPLE, set: _SET, np.ndarray: _ARRAY, memoryview: _BUFFER,
}  # fmt: skip


def arrow_payload(value: Any) -> bytes:
    """The bytes that ``pyarrow.serialize(value).to_buffer()`` of pyarrow 0.16 and 0.17 stands for.

    The same columns and messages, laid out differently within the metadata; pyarrow 0.17.1 reads them back to the
    value. A ``memoryview`` becomes a pyarrow buffer, and a float32 comes back as a float, as with pyarrow.

    Args:
        value: of None, bool, int of 64 bits, float, float16, float32, str, bytes, list, tuple, dict, set and arrays
            of plain numbers.
    """
    arrays: list[np.ndarray] = []
    buffers: list[bytes] = []
    root = _Union(arrays, buffers)
    root.add([value])
    columns = _Columns()
    field = root.write("list", columns)
    out = struct.pack("<4i", 0, 0, len(arrays), len(buffers))
    out += _message(1, Table((("h", 0), Tables([field]))))
    batch = Table((("q", 1), Structs("qq", columns.nodes), Structs("qq", columns.buffers)))
    out += _message(3, batch, bytes(columns.body))
    out += b"\xff\xff\xff\xff\0\0\0\0"
    out += bytes(-len(out) % 64)
    for array in arrays:
        out += _tensor(array, len(out))
        out += bytes(-len(out) % 64)
    for buffer in buffers:
        out += struct.pack("<q", len(buffer)) + buffer
    return out


class _Columns:
    """Lengths and buffers of columns in the order in which Arrow walks them."""

    def __init__(self) -> None:
        self.nodes: list[tuple[int, int]] = []
        self.buffers: list[tuple[int, int]] = []
        self.body = bytearray()

    def column(self, length: int, *buffers: bytes, missing: int = 0) -> None:
        self.nodes.append((length, missing))
        for buffer in buffers:
            self.buffers.append((len(self.body), len(buffer)))
            self.body += buffer + bytes(-len(buffer) % 8)


class _Union:
    """Elements of mixed types, in the order in which they are added."""

    def __init__(self, arrays: list[np.ndarray], buffers: list[bytes]) -> None:
        self.arrays, self.buffers = arrays, buffers
        self.types: list[int] = []
        self.places: list[int] = []
        self.valid: list[bool] = []
        self.atoms: dict[int, list[Any]] = {}  # in the order of the columns
        self.parts: dict[int, list[_Union]] = {}

    def add(self, values: Any) -> None:
        for value in values:
            self.valid.append(value is not None)
            if value is None:
                self.types.append(0)
                self.places.append(0)
                continue
            kind = _KINDS[type(value)]
            entries = self.atoms.setdefault(kind, [])
            self.types.append(list(self.atoms).index(kind))
            self.places.append(len(entries))
            if kind in (_ARRAY, _BUFFER):
                blobs: list = self.arrays if kind == _ARRAY else self.buffers
                entries.append(len(blobs))
                blobs.append(value if kind == _ARRAY else bytes(value))
                continue
            entries.append(value)
            if kind in (_LIST, _TUPLE, _SET, _DICT):
                is_dict = kind == _DICT
                if kind not in self.parts:
                    self.parts[kind] = [_Union(self.arrays, self.buffers) for _ in range(1 + is_dict)]
                for part, members in zip(
                    self.parts[kind], (value.keys(), value.values()) if is_dict else (value,), strict=True
                ):
                    part.add(members)

    def write(self, name: str, columns: _Columns) -> Table:
        missing = self.valid.count(False)
        columns.column(
            len(self.valid),
            np.packbits(self.valid, bitorder="little").tobytes() if missing else b"",
            np.array(self.types, "<i1").tobytes(),
            np.array(self.places, "<i4").tobytes(),
            missing=missing,
        )
        children = [self.child(kind, entries, columns) for kind, entries in self.atoms.items()]
        return _field(name, 14, (("h", 1), Structs("i", [(n,) for n in range(len(children))])), children)

    def child(self, kind: int, entries: list[Any], columns: _Columns) -> Table:
        length = len(entries)
        if kind in _NUMBERS:
            columns.column(length, b"", np.array(entries, _NUMBERS[kind]).tobytes())
            return _field(str(kind), *_TYPES[kind])
        if kind == _BOOL:
            columns.column(length, b"", np.packbits(entries, bitorder="little").tobytes())
            return _field("0", *_TYPES[0])
        if kind in (_TEXT, _BYTES):
            raw = [entry.encode() if kind == _TEXT else entry for entry in entries]
            columns.column(length, b"", _bounds(raw), b"".join(raw))
            return _field(str(kind), *_TYPES[kind])
        columns.column(length, b"", _bounds(entries))
        parts = self.parts[kind]
        if kind != _DICT:
            return _field(str(kind), 12, (), [parts[0].write("item", columns)])
        columns.column(len(parts[0].valid), b"")
        pair = [part.write(name, columns) for name, part in zip(("keys", "vals"), parts, strict=True)]
        return _field(str(kind), 12, (), [_field("item", 13, (), pair)])


def _bounds(entries: list[Any]) -> bytes:
    return np.cumsum([0, *map(len, entries)]).astype("<i4").tobytes()


def _field(name: str, kind: int, detail: tuple, children: list[Table] | None = None) -> Table:
    return Table((name, ("B", 1), ("B", kind), Table(detail), None, Tables(children or [])))


def _message(kind: int, header: Table, body: bytes = b"", at: int = 0) -> bytes:
    """A message; its body lies on a multiple of 64 bytes where it begins at byte ``at``."""
    metadata = flat(Table((("h", 3), ("B", kind), header, ("q", len(body)))))
    if at:
        metadata += bytes(-(at + 8 + len(metadata)) % 64)
    return b"\xff\xff\xff\xff" + struct.pack("<I", len(metadata)) + metadata + body


def _tensor(array: np.ndarray, at: int) -> bytes:
    if array.dtype.kind not in "iuf" or array.dtype.byteorder == ">":
        raise TypeError(f"Arrow has no tensors of {array.dtype}")
    width = array.dtype.itemsize
    kind, detail = (
        (3, (("h", {2: 0, 4: 1, 8: 2}[width]),))
        if array.dtype.kind == "f"
        else (2, (("i", 8 * width), ("B", array.dtype.kind == "i")))
    )
    content = np.ascontiguousarray(array)
    sizes = Tables([Table((("q", size), "")) for size in array.shape])
    steps = Structs("q", [(step,) for step in content.strides[: array.ndim]])
    data = Inline("qq", (0, array.nbytes))
    body = content.tobytes()
    return _message(4, Table((("B", kind), Table(detail), sizes, steps, data)), body + bytes(-len(body) % 64), at)


_HEADER, _NODE = struct.Struct("<QHHHH"), struct.Struct("<HHHH")
_BRANCH, _LEAF, _OVERFLOW, _META = 1, 2, 4, 8
_NO_PAGE = 2**64 - 1


def write_lmdb(folder: Path, entries: dict[bytes, bytes], page_size: int = 4096) -> Path:
    """Write ``data.mdb`` into a folder (made if missing) as LMDB 0.9 does; returns its path.

    Python's lmdb 3.0.0 reads and changes these with pages of 4096 bytes, from none to 20000 entries.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pages: list[bytes] = [b"", b""]
    counts = {_BRANCH: 0, _LEAF: 0, _OVERFLOW: 0}
    largest = ((page_size - 16) // 2 & -2) - 2  # a page must take two nodes

    def large(value: bytes) -> bytes:
        number, count = len(pages), -(-(16 + len(value)) // page_size)
        run = struct.pack("<QHHI", number, 0, _OVERFLOW, count) + value
        run += bytes(count * page_size - len(run))
        pages.extend(run[at : at + page_size] for at in range(0, len(run), page_size))
        counts[_OVERFLOW] += count
        return struct.pack("<Q", number)

    def leaf(key: bytes, value: bytes) -> bytes:
        is_large = _NODE.size + len(key) + len(value) > largest
        head = _NODE.pack(len(value) & 0xFFFF, len(value) >> 16, int(is_large), len(key))
        return head + key + (large(value) if is_large else value)

    def branch(key: bytes, number: int) -> bytes:
        return _NODE.pack(number & 0xFFFF, number >> 16 & 0xFFFF, number >> 32, len(key)) + key

    def store(nodes: list[tuple[bytes, bytes]], flag: int) -> list[tuple[bytes, int]]:
        """Pages of one level: the first key of each and its number."""
        groups: list[list[bytes]] = []
        firsts: list[bytes] = []
        room = 0
        for key, node in nodes:
            size = len(node) + len(node) % 2 + 2
            if size > room:
                groups.append([])
                firsts.append(key)
                room = page_size - 16
                if flag == _BRANCH:  # the first key of a branch is left out
                    node = _NODE.pack(*_NODE.unpack_from(node)[:3], 0)
                    size = _NODE.size + 2
            groups[-1].append(node)
            room -= size
        result = []
        for first, group in zip(firsts, groups, strict=True):
            result.append((first, len(pages)))
            pages.append(_filled(len(pages), flag, group, page_size))
            counts[flag] += 1
        return result

    level = store([(key, leaf(key, value)) for key, value in sorted(entries.items())], _LEAF)
    depth = 1 if level else 0
    while len(level) > 1:
        level = store([(key, branch(key, number)) for key, number in level], _BRANCH)
        depth += 1
    root = level[0][1] if level else _NO_PAGE
    main = struct.pack("<IHH5Q", 0, 0, depth, *counts.values(), len(entries), root)
    free = struct.pack("<IHH5Q", page_size, 8, 0, 0, 0, 0, 0, _NO_PAGE)
    for number in range(2):
        tree = main if number else struct.pack("<IHH5Q", 0, 0, 0, 0, 0, 0, 0, _NO_PAGE)
        size, last = max(2**20, len(pages) * page_size), len(pages) - 1 if number else 1
        meta = struct.pack("<IIQQ", 0xBEEFC0DE, 1, 0, size) + free + tree + struct.pack("<QQ", last, number)
        pages[number] = (_HEADER.pack(number, 0, _META, 0, 0) + meta).ljust(page_size, b"\0")
    path = folder / "data.mdb"
    path.write_bytes(b"".join(pages))
    return path


def _filled(number: int, flag: int, nodes: list[bytes], page_size: int) -> bytes:
    """A page: where its nodes lie, from the front, and the nodes, from the back."""
    places, content, upper = [], b"", page_size
    for node in nodes:
        node += bytes(len(node) % 2)
        upper -= len(node)
        places.append(upper)
        content = node + content
    lower = _HEADER.size + 2 * len(nodes)
    head = _HEADER.pack(number, 0, flag, lower, upper) + struct.pack(f"<{len(places)}H", *places)
    return head + bytes(upper - lower) + content
