"""Messages of Arrow's stream format: the frame around metadata and body, and tensors (Arrow, "IPC format")."""

import math
import struct
from dataclasses import dataclass

import numpy as np

from a2g_jax.io.untrusted.arrays import check_shape, plain_array
from a2g_jax.io.untrusted.budget import CONVERT, Budget
from a2g_jax.io.untrusted.flatbuffers import FlatData, Table

#: Values of the unions ``MessageHeader`` and ``Type`` in Arrow's schema.
SCHEMA, RECORD_BATCH, TENSOR = 1, 3, 4
NULL, INT, FLOAT, BINARY, UTF8, BOOL = 1, 2, 3, 4, 5, 6
LIST, STRUCT, UNION = 12, 13, 14
#: Metadata version 5 and later have no validity bits for unions.
VERSION_5 = 4


@dataclass
class Message:
    """One message: its kind, its metadata, and its body, which begins at byte ``start`` of the data."""

    kind: int
    version: int
    header: Table
    body: memoryview
    start: int


class Stream:
    """A position in the data that advances message by message."""

    def __init__(self, data: memoryview, budget: Budget) -> None:
        self.data = data
        self.budget = budget
        self.at = 0

    def take(self, count: int) -> memoryview:
        if not 0 <= count <= len(self.data) - self.at:
            raise self.budget.damage(
                self.at, f"{count} bytes are announced and {max(len(self.data) - self.at, 0)} are left"
            )
        part = self.data[self.at : self.at + count]
        self.at += count
        return part

    def number(self, format: str) -> int:
        return struct.unpack(format, self.take(struct.calcsize(format)))[0]

    def align(self, size: int) -> None:
        self.at = math.ceil(self.at / size) * size

    def end_mark(self) -> None:
        """Skip the end of a stream: four zero bytes, since 0.15 after four of 255."""
        if self.data[self.at : self.at + 4] == b"\xff\xff\xff\xff":
            self.take(4)
        if self.number("<I"):
            raise self.budget.damage(self.at, "more than one batch")

    def message(self, kind: int) -> Message:
        """The next message.

        Raises:
            InputError: damaged, compressed, or of another kind.
        """
        size = self.number("<I")
        if size == 0xFFFFFFFF:  # since 0.15
            size = self.number("<I")
        base = self.at
        table = FlatData(self.take(size), base, self.budget).root()
        header = table.table(2)
        if header is None or table.number(1, "<B") != kind:
            raise self.budget.damage(base, "a message is of the wrong kind")
        start = self.at
        return Message(kind, table.number(0, "<h"), header, self.take(table.number(3, "<q")), start)

    def tensor(self) -> np.ndarray:
        """The next message as an array.

        Raises:
            InputError: damaged, or of numbers without a NumPy type.
        """
        message = self.message(TENSOR)
        header, at = message.header, message.start
        dtype = _number_type(header, at, self.budget)
        shape = check_shape(tuple(size.number(0, "<q") for size in header.tables(2)), self.budget, at)
        buffer = header.place(4)
        if buffer is None:
            raise self.budget.damage(at, "a tensor without data")
        offset, length = header.flat.read("<q", buffer), header.flat.read("<q", buffer + 8)
        if offset != 0 or length > len(message.body) or length < 0:
            raise self.budget.damage(at, "a tensor is outside of its message")
        first, count = header.vector(3, 8)
        strides = tuple(header.flat.read("<q", first + 8 * axis) for axis in range(count))
        order = _order(shape, strides, dtype.itemsize)
        if order is None:
            raise self.budget.error(at, f"has a tensor with gaps between its elements; {CONVERT}.")
        size = math.prod(shape) * dtype.itemsize
        return plain_array(message.body[: min(size, length)], dtype, shape, order, self.budget, at)


def _number_type(header: Table, at: int, budget: Budget) -> np.dtype:
    kind, detail = header.number(0, "<B"), header.table(1)
    if kind == INT and detail is not None:
        bits = detail.number(0, "<i")
        if bits in (8, 16, 32, 64):
            return np.dtype(f"<{'i' if detail.number(1, '<B') else 'u'}{bits // 8}")
    if kind == FLOAT and detail is not None:
        precision = detail.number(0, "<h")
        if precision in (0, 1, 2):
            return np.dtype(("<f2", "<f4", "<f8")[precision])
    raise budget.error(at, f"has a tensor of another type than plain numbers; {CONVERT}.")


def _order(shape: tuple[int, ...], strides: tuple[int, ...], width: int) -> str | None:
    """Memory order by the strides: ``"C"``, ``"F"`` or None for neither."""
    if not strides or 0 in shape:
        return "C"
    if len(strides) != len(shape):
        return None
    long = [axis for axis, size in enumerate(shape) if size > 1]
    for order in "CF":
        step, right = width, True
        for axis in reversed(long) if order == "C" else long:
            right = right and strides[axis] == step
            step *= shape[axis]
        if right:
            return order
    return None
