"""Reading FlatBuffers tables, the metadata of Arrow messages, with every offset checked.

A table refers to a list with the offsets of its fields; strings, vectors and other tables are referred to by offsets
(FlatBuffers, "Internals").
"""

import struct

from a2g_jax.io.untrusted.budget import Budget

_LONGEST_NAME = 256


class FlatData:
    """The bytes of one FlatBuffers message, which begin at byte ``base`` of the data (for errors)."""

    def __init__(self, data: memoryview, base: int, budget: Budget) -> None:
        self.data = data
        self.base = base
        self.budget = budget

    def read(self, format: str, at: int) -> int:
        if not 0 <= at <= len(self.data) - struct.calcsize(format):
            raise self.budget.damage(self.base, "an offset points out of its message")
        return struct.unpack_from(format, self.data, at)[0]

    def root(self) -> "Table":
        return Table(self, self.read("<I", 0))


class Table:
    """One table; fields are numbered as in the schema, and every lookup is bounds-checked."""

    def __init__(self, flat: FlatData, at: int) -> None:
        self.flat = flat
        self.at = at
        self.fields = at - flat.read("<i", at)
        self.fields_size = flat.read("<H", self.fields)

    def place(self, field: int) -> int | None:
        """Position of a field, or None where it is absent."""
        entry = 4 + 2 * field
        if entry + 2 > self.fields_size:
            return None
        offset = self.flat.read("<H", self.fields + entry)
        return self.at + offset if offset else None

    def number(self, field: int, format: str, default: int = 0) -> int:
        at = self.place(field)
        return default if at is None else self.flat.read(format, at)

    def pointed(self, field: int) -> int | None:
        at = self.place(field)
        return None if at is None else at + self.flat.read("<I", at)

    def table(self, field: int) -> "Table | None":
        at = self.pointed(field)
        return None if at is None else Table(self.flat, at)

    def vector(self, field: int, width: int) -> tuple[int, int]:
        """Position of the first element of a vector and their number, checked to be within the message."""
        at = self.pointed(field)
        if at is None:
            return 0, 0
        count = self.flat.read("<I", at)
        if at + 4 + count * width > len(self.flat.data):
            raise self.flat.budget.damage(self.flat.base, f"a list of {count} elements exceeds its message")
        return at + 4, count

    def text(self, field: int) -> str:
        start, count = self.vector(field, 1)
        if count > _LONGEST_NAME:  # many fields may refer to one name, and each reads it
            raise self.flat.budget.damage(self.flat.base, f"a name of {count} bytes")
        try:
            return bytes(self.flat.data[start : start + count]).decode("utf-8")
        except UnicodeDecodeError:
            raise self.flat.budget.damage(self.flat.base, "a name is not UTF-8") from None

    def tables(self, field: int) -> list["Table"]:
        start, count = self.vector(field, 4)
        self.flat.budget.charge(256 * count, self.flat.base)
        return [Table(self.flat, at + self.flat.read("<I", at)) for at in range(start, start + 4 * count, 4)]
