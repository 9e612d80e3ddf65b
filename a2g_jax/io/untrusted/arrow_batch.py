"""The record batch in which ``pyarrow.serialize`` stores the structure of a value, as columns.

A sequence is a dense union: for each element the number of a child column and an index into it. There is a child for
each type that occurs; lists, tuples and sets are list columns over a further union, and dictionaries are list columns
over pairs of unions. The identification of the children changed twice:

=============  =========================================================================================
pyarrow        children
=============  =========================================================================================
to 0.11        without names: by the Arrow type; containers in a struct whose field is named ``list`` ...
0.12 to 0.17   numbers as names, ``0`` (bool) to ``15`` (buffer); None is a missing element of the union
1.0 to 11      numbers one higher, after a child ``0`` of nulls, for None
=============  =========================================================================================
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from a2g_jax.io.untrusted.arrow_messages import (
    BINARY,
    BOOL,
    FLOAT,
    INT,
    LIST,
    NULL,
    STRUCT,
    UNION,
    UTF8,
    VERSION_5,
    Message,
)  # fmt: skip
from a2g_jax.io.untrusted.budget import CONVERT, Budget, clip
from a2g_jax.io.untrusted.flatbuffers import Table

_NUMBERED = (
    *("bool", "int", "int", "bytes", "str", "half", "float", "double", "date"),
    *("list", "dict", "tuple", "set", "tensor", "ndarray", "buffer"),
)
_SEQUENCES = ("list", "tuple", "set")
#: Arrow type, with its width in bits or its precision, and NumPy type of the children that hold numbers.
_NUMBERS = {
    "int": (INT, 64, "<i8"),
    "half": (FLOAT, 0, "<f2"),
    "float": (FLOAT, 1, "<f4"),
    "double": (FLOAT, 2, "<f8"),
    "ndarray": (INT, 32, "<i4"),
    "buffer": (INT, 32, "<i4"),
}


@dataclass
class Sequence:
    """Elements of mixed types: the child of each and the index into it; ``valid`` is 0 for None."""

    length: int
    valid: np.ndarray | None
    types: np.ndarray
    places: np.ndarray
    children: "list[Child]"


@dataclass
class Child:
    """The elements of one type.

    ``values`` holds numbers or booleans; for text, bytes and containers ``bounds`` holds the start of each element and
    the end of the last one, in ``content`` or in the sequences ``parts`` (two for dictionaries).
    """

    kind: str
    length: int
    values: np.ndarray | None = None
    bounds: np.ndarray | None = None
    content: memoryview | None = None
    parts: tuple[Sequence, ...] = ()


class BatchReader:
    """Reads the columns of a batch, in the order of their lengths and buffers."""

    def __init__(self, message: Message, budget: Budget) -> None:
        self.body = message.body
        self.at = message.start
        self.budget = budget
        self.has_union_bits = message.version < VERSION_5
        if message.header.table(3) is not None:
            raise budget.error(self.at, f"is compressed, which pyarrow.serialize never was; {CONVERT}.")
        flat = message.header.flat
        self.nodes = self.pairs(flat.data, *message.header.vector(1, 16))
        self.buffers = self.pairs(flat.data, *message.header.vector(2, 16))

    def pairs(self, data: memoryview, start: int, count: int) -> Iterator[tuple[int, int]]:
        self.budget.charge(64 * count, self.at)
        return struct.iter_unpack("<qq", data[start : start + 16 * count])  # type: ignore[return-value]

    def node(self, missing: bool = False) -> int:
        """Length of the next column."""
        length, nulls = next(self.nodes, (-1, 0))
        if not 0 <= length <= self.budget.limits.size or (nulls and not missing):
            raise self.budget.damage(self.at, "a column has no length or misses elements")
        return length

    def buffer(self, size: int | None = None) -> memoryview:
        """Bytes of the next buffer: ``size`` of them, or all."""
        start, length = next(self.buffers, (-1, -1))
        if start < 0 or length < 0 or start + length > len(self.body) or (size or 0) > length:
            raise self.budget.damage(self.at, "a buffer is outside of its message, or too short")
        return self.body[start : start + (length if size is None else size)]

    def numbers(self, dtype: str, count: int) -> np.ndarray:
        data = self.buffer(count * np.dtype(dtype).itemsize)
        self.budget.charge(len(data), self.at)  # columns may share a buffer, and each scans it
        return np.frombuffer(data, dtype)

    def bits(self, count: int, packed: memoryview | None = None) -> np.ndarray:
        packed = self.buffer((count + 7) // 8) if packed is None else packed
        self.budget.charge(count, self.at)
        return np.unpackbits(np.frombuffer(packed, np.uint8), count=count, bitorder="little")

    def validity(self, count: int) -> np.ndarray | None:
        """Which elements are present; None if all are."""
        packed = self.buffer()
        if len(packed) == 0:
            return None
        if len(packed) < (count + 7) // 8:
            raise self.budget.damage(self.at, "a buffer is too short")
        return self.bits(count, packed)

    def bounds(self, count: int) -> np.ndarray:
        """Starts of ``count`` lists, and the end of the last one."""
        if count == 0:
            self.buffer()
            return np.zeros(1, "<i4")
        found = self.numbers("<i4", count + 1)
        if found[0] < 0 or np.any(np.diff(found) < 0):
            raise self.budget.damage(self.at, "a list ends before it begins")
        return found

    def sequence(self, field: Table, depth: int = 0) -> Sequence:
        """A union column with all columns below it.

        Raises:
            InputError: damaged, nested too deeply, or with anything but plain values.
        """
        if depth > self.budget.limits.depth:
            raise self.budget.error(self.at, f"is nested more than {self.budget.limits.depth} levels deep.")
        detail = self.expect(field, UNION)
        if detail.number(0, "<h") != 1:
            raise self.budget.damage(self.at, "a union is not dense")
        length = self.node(missing=True)
        valid = self.validity(length) if self.has_union_bits else None
        types, places = self.numbers("<i1", length), self.numbers("<i4", length)
        fields = field.tables(5)
        shift = 1 if fields and fields[0].number(2, "<B") == NULL else 0
        # The union's own list of type numbers has another order to 0.11; pyarrow never used it.
        return Sequence(length, valid, types, places, [self.child(part, shift, depth + 1) for part in fields])

    def child(self, field: Table, shift: int, depth: int) -> Child:
        kind = self.kind(field, shift)
        if field.number(2, "<B") == STRUCT:
            self.node()
            self.buffer()
            inner = field.tables(5)
            if len(inner) != 1:
                raise self.budget.damage(self.at, "a column is of another type than its name says")
            field = inner[0]
        if kind == "none":
            return Child(kind, self.node(missing=True))
        length = self.node()
        self.buffer()  # the validity bits; node() has refused missing elements
        if kind == "bool":
            self.expect(field, BOOL)
            return Child(kind, length, values=self.bits(length))
        if kind in _NUMBERS:
            type_number, width, dtype = _NUMBERS[kind]
            detail = self.expect(field, type_number)
            if detail.number(0, "<i" if type_number == INT else "<h") != width:
                raise self.budget.damage(self.at, f"a column for {kind} has another width")
            return Child(kind, length, values=self.numbers(dtype, length))
        if kind in ("bytes", "str"):
            self.expect(field, UTF8 if kind == "str" else BINARY)
            bounds = self.bounds(length)
            content = self.buffer()
            if bounds[-1] > len(content):
                raise self.budget.damage(self.at, "a text exceeds its buffer")
            return Child(kind, length, bounds=bounds, content=content)
        self.expect(field, LIST)
        bounds = self.bounds(length)
        items = field.tables(5)
        if len(items) != 1:
            raise self.budget.damage(self.at, "a list column without its items")
        if kind in _SEQUENCES:
            parts: tuple[Sequence, ...] = (self.sequence(items[0], depth),)
        else:
            self.expect(items[0], STRUCT)
            self.node()
            self.buffer()
            pair = items[0].tables(5)
            if len(pair) != 2:
                raise self.budget.damage(self.at, "a dictionary without keys and values")
            parts = (self.sequence(pair[0], depth), self.sequence(pair[1], depth))
        if any(bounds[-1] > part.length for part in parts):
            raise self.budget.damage(self.at, "a list exceeds its items")
        return Child(kind, length, bounds=bounds, parts=parts)

    def kind(self, field: Table, shift: int) -> str:
        """Kind of the elements of a child of a union, by its name, or by its type in the oldest files."""
        name, type_number = field.text(0), field.number(2, "<B")
        if name.isascii() and name.isdigit():
            number = int(name[:4]) - shift
            if number == -1 and type_number == NULL:
                return "none"
            kind = _NUMBERED[number] if 0 <= number < len(_NUMBERED) else "a sparse tensor"
        elif type_number == STRUCT and len(inner := field.tables(5)) == 1:
            kind = inner[0].text(0)
        elif name in ("tensor", "buffer"):
            kind = "ndarray" if name == "tensor" else name
        else:
            detail = field.table(3)
            width = detail.number(0, "<h") if detail is not None and type_number == FLOAT else -1
            by_type = {INT: "int", BINARY: "bytes", UTF8: "str", BOOL: "bool"}
            kind = ("half", "float", "double")[width] if 0 <= width < 3 else by_type.get(type_number, "another type")
        if kind not in (*_NUMBERS, *_SEQUENCES, "bool", "bytes", "str", "dict"):
            raise self.budget.error(self.at, f"holds {clip(kind)}, which is refused; {CONVERT}.")
        return kind

    def expect(self, field: Table, type_number: int) -> Table:
        detail = field.table(3)
        if field.number(2, "<B") != type_number or detail is None or field.table(4) is not None:
            raise self.budget.damage(self.at, "a column is of another type than its name says")
        return detail
