"""Values written by ``pyarrow.serialize``, as in the TED data sets; pyarrow dropped the function in version 12.

The data is the numbers of tensors and buffers, a record batch with the structure of the value (see
:mod:`~a2g_jax.io.untrusted.arrow_batch`), and then the tensors and buffers in sequence, each aligned to 64 bytes. It is
read without pyarrow, whose reader of unions drops the None of files from before 1.0, and whose C++ code trusts offsets
that a hostile file can choose.

Source: ``cpp/src/arrow/python/serialize.cc`` and ``deserialize.cc`` of Apache Arrow, and bytes written by pyarrow
0.11.1, 0.13.0, 0.14.1, 0.15.1, 0.16.0, 0.17.1, 1.0.1, 6.0.1, 8.0.0 and 11.0.0.
"""

import math
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted.arrays import check_shape, object_array, plain_array, plain_type
from a2g_jax.io.untrusted.arrow_batch import BatchReader, Child, Sequence
from a2g_jax.io.untrusted.arrow_messages import RECORD_BATCH, SCHEMA, Stream
from a2g_jax.io.untrusted.budget import CONVERT, Budget, Limits, clip
from a2g_jax.io.untrusted.pickles import decode_with
from a2g_jax.io.untrusted.values import check_key, check_value

_TENSORS_FROM = 64
_MOST_BLOBS = 2**20
#: Memory that a value may take: this, and so much for each byte of its data, which bounds the time as well.
_LEAST, _TIMES = 2**26, 100
#: Types of the elements of an array that was written as a list, by the kind of its NumPy type.
_ELEMENTS: dict[str, tuple[type, ...]] = {
    "b": (bool,), "i": (int,), "u": (int,), "f": (int, float), "c": (), "S": (bytes,), "U": (str,),
}  # fmt: skip


def decode_arrow(data: bytes, name: str, limits: Limits | None = None) -> Any:
    """Decode a value of ``pyarrow.serialize`` (0.11 to 11) without executing any of it.

    The value consists of None, bool, int, float, float16, str, bytes, list, tuple, dict, set and NumPy arrays of plain
    numbers and text. ``OrderedDict`` and ``Counter`` become dict, ``deque`` becomes list, and pickled parts are decoded
    as by :func:`~a2g_jax.io.untrusted.pickles.decode_pickle`. Everything else is refused.

    Args:
        data: the bytes.
        name: what errors call them, such as the path and the key.

    Raises:
        InputError: damaged, beyond the limits, or with any other content.
    """
    budget = Budget(name, limits or Limits())
    budget.bound(_LEAST + _TIMES * len(data))
    try:
        value = _decode(data, budget)
    except InputError:
        raise
    except (ValueError, OverflowError, MemoryError) as error:
        raise budget.damage(0, type(error).__name__) from None
    check_value(value, budget, 0)
    return value


def _decode(data: bytes, budget: Budget) -> Any:
    budget.charge(len(data), 0)
    stream = Stream(memoryview(data), budget)
    counts = [stream.number("<i") for _ in range(2)]
    if _has_long_head(data):
        counts += [stream.number("<i") for _ in range(2)]
    schema = stream.message(SCHEMA)
    fields = schema.header.tables(1)
    if schema.header.number(0, "<h") != 0:
        raise budget.error(0, f"was written on a big-endian machine; {CONVERT}.")
    batch = stream.message(RECORD_BATCH)
    if len(fields) != 1 or batch.version != schema.version:
        raise budget.damage(batch.start, "expected one column")
    root = BatchReader(batch, budget).sequence(fields[0])
    if root.length != 1:
        raise budget.damage(batch.start, f"expected one value, found {root.length}")
    stream.end_mark()
    arrays, buffers = _counts(counts, root, budget)
    blobs = _Values(budget, batch.start)
    stream.align(_TENSORS_FROM)
    for _ in range(arrays):
        blobs.arrays.append(stream.tensor())
        stream.align(_TENSORS_FROM)
    for _ in range(buffers):
        blobs.buffers.append(bytes(stream.take(stream.number("<q"))))
    return blobs.items(root, 0, 1)[0]


def _has_long_head(data: bytes) -> bool:
    """Whether the head has 16 bytes (since 0.12) and not 8, as the next message or zeros show."""
    return data[16:20] == b"\xff\xff\xff\xff" or data[12:16] == b"\0\0\0\0"


def _counts(counts: list[int], root: Sequence, budget: Budget) -> tuple[int, int]:
    """Numbers of arrays and buffers that follow.

    The head is (arrays, buffers) to 0.11; (tensors, arrays, buffers, 0) to 0.15; and (tensors, sparse tensors, arrays,
    buffers) since. The last two can be ambiguous; then the columns show whether there are arrays.
    """
    if len(counts) == 2:
        arrays, buffers = counts
        tensors = 0
    elif counts[1] or (counts[3] == 0 and counts[2] and not _has_arrays(root)):
        tensors, arrays, buffers, last = counts
        if last:
            raise budget.error(0, f"holds sparse tensors, which are refused; {CONVERT}.")
    else:
        tensors, _, arrays, buffers = counts
    if tensors:
        raise budget.error(0, f"holds pyarrow tensors, which are refused; {CONVERT}.")
    if not (0 <= arrays <= _MOST_BLOBS and 0 <= buffers <= _MOST_BLOBS):
        raise budget.damage(0, f"{arrays} arrays and {buffers} buffers are announced")
    return arrays, buffers


def _has_arrays(sequence: Sequence) -> bool:
    return any(child.kind == "ndarray" or any(_has_arrays(part) for part in child.parts) for child in sequence.children)


class _Values:
    """Builds values from columns, and from the arrays and buffers to which the columns refer by number."""

    def __init__(self, budget: Budget, at: int) -> None:
        self.budget = budget
        self.at = at
        self.arrays: list[np.ndarray] = []
        self.buffers: list[bytes] = []

    def items(self, sequence: Sequence, start: int, stop: int) -> list[Any]:
        self.budget.charge(64 * (stop - start), self.at)
        types, places = sequence.types[start:stop].tolist(), sequence.places[start:stop].tolist()
        valid = [1] * len(types) if sequence.valid is None else sequence.valid[start:stop].tolist()
        return [
            self.item(sequence.children, kind, place) if is_valid else None
            for kind, place, is_valid in zip(types, places, valid, strict=True)
        ]

    def item(self, children: list[Child], kind: int, place: int) -> Any:
        if not (0 <= kind < len(children) and 0 <= place < children[kind].length):
            raise self.budget.damage(self.at, "an element is in no column")
        child = children[kind]
        if child.kind == "none":
            return None
        if child.values is not None:
            return self.number(child.kind, child.values[place])
        assert child.bounds is not None
        start, stop = int(child.bounds[place]), int(child.bounds[place + 1])
        if child.content is not None:
            self.budget.charge(4 * (stop - start), self.at)
            raw = bytes(child.content[start:stop])
            return raw.decode("utf-8") if child.kind == "str" else raw
        parts = [self.items(part, start, stop) for part in child.parts]
        if child.kind == "dict":
            return self.mapping(*parts)
        if child.kind == "set":
            for member in parts[0]:
                check_key(member, parts[0], self.budget, self.at)
            return set(parts[0])
        return tuple(parts[0]) if child.kind == "tuple" else parts[0]

    def number(self, kind: str, value: np.generic) -> Any:
        if kind == "bool":
            return bool(value)
        if kind in ("ndarray", "buffer"):
            blobs = self.arrays if kind == "ndarray" else self.buffers
            number = int(value)
            if not 0 <= number < len(blobs):
                raise self.budget.damage(self.at, f"refers to {kind} {number} and has {len(blobs)}")
            return blobs[number]
        return value if kind == "half" else value.item()

    def mapping(self, keys: list[Any], values: list[Any]) -> Any:
        self.budget.charge(128 * len(keys) + 128, self.at)
        result: dict[Any, Any] = {}
        for key, value in zip(keys, values, strict=True):
            check_key(key, result, self.budget, self.at)
            result[key] = value
        return self.rebuilt(result) if "_pytype_" in result else result

    def rebuilt(self, stored: dict[Any, Any]) -> Any:
        """The value of a type without an Arrow type, as the default handlers of ``pyarrow.serialize`` wrote it."""
        kind, data = stored["_pytype_"], stored.get("data")
        if stored.get("pickle") is True and type(data) is bytes:
            return decode_with(data, self.budget)
        match kind, data:
            case "int", str(digits) if digits.removeprefix("-").isdecimal() and len(digits) < 2500:
                return int(digits)
            case "collections.OrderedDict" | "collections.Counter", (list(keys), list(values)):
                if len(keys) == len(values):
                    return self.mapping(keys, values)
            case "collections.deque", list():
                return data
            case "np.array", (list() | np.ndarray() as content, descr):
                return self.array(content, descr)
        shown = kind if isinstance(kind, str) else "an unknown type"
        raise self.budget.error(self.at, f"holds {clip(shown)}, which is refused, and nothing was run; {CONVERT}.")

    def array(self, content: list | np.ndarray, descr: Any) -> np.ndarray:
        dtype = plain_type(descr, self.budget, self.at, objects=True)
        if isinstance(content, np.ndarray):  # its bytes
            shape = content.shape
            if content.dtype != np.uint8 or not shape or shape[-1] % dtype.itemsize or dtype.hasobject:
                raise self.budget.damage(self.at, "an array's bytes do not fit its type")
            shape = (*shape[:-1], shape[-1] // dtype.itemsize)
            check_shape(shape, self.budget, self.at)
            return plain_array(content.tobytes(), dtype, shape, "C", self.budget, self.at)
        if dtype.hasobject:
            return object_array(content, (len(content),), "C", self.budget, self.at)
        shape, flat = (len(content),), content
        while flat and all(type(part) is list and len(part) == len(flat[0]) for part in flat):
            shape = check_shape((*shape, len(flat[0])), self.budget, self.at)
            self.budget.charge(16 * math.prod(shape), self.at)
            flat = [value for part in flat for value in part]
        if any(type(value) not in _ELEMENTS[dtype.kind] for value in flat):
            raise self.budget.damage(self.at, "an array's elements do not fit its type")
        self.budget.charge(len(flat) * dtype.itemsize, self.at)
        return np.array(flat, dtype).reshape(shape)
