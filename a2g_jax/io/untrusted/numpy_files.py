"""NumPy's ``.npy`` and ``.npz`` files from untrusted sources.

``numpy.load`` allocates the size that a header claims and, with ``allow_pickle``, executes pickles. Here each claim is
checked against the size of the data and against the limits, and arrays of Python objects, where they are allowed, are
decoded as by :func:`~a2g_jax.io.untrusted.pickles.decode_pickle`.
"""

import io
import math
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Sequence
from functools import lru_cache
from typing import BinaryIO

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable
from a2g_jax.io.untrusted.arrays import check_shape, plain_array, plain_type
from a2g_jax.io.untrusted.budget import CONVERT, Budget, Limits, clip
from a2g_jax.io.untrusted.pickles import decode_with

_MAGIC = b"\x93NUMPY"
_LONGEST_HEADER = 10_000
#: Memory that an archive may take: this, and so much for each of its bytes; motion packs to half.
_LEAST, _TIMES = 2**28, 100
#: Largest single read in bytes; an archive of arrays has no longer list of members.
_LARGEST_READ = 2**20
_ITEM = r"'descr': *+'([^']{1,15})'|'fortran_order': *+(True|False)|'shape': *+\(([0-9L, ]{0,999})\)"
_HEADER = re.compile(rf"\{{ *+(?:(?:{_ITEM}),? *+){{3}}\}}")
_SIZE = re.compile(r"[0-9]{1,18}L?")
# Exceptions of zipfile and zlib for damaged bytes.
_DAMAGE = (
    zipfile.BadZipFile, zlib.error, struct.error, ArithmeticError, EOFError, IndexError, KeyError, MemoryError,
    NotImplementedError, OSError, RuntimeError, ValueError,
)  # fmt: skip


def read_npy(path: str | os.PathLike[str], *, objects: bool = False, limits: Limits | None = None) -> np.ndarray:
    """The array in an ``.npy`` file.

    Args:
        path: the file.
        objects: whether arrays of Python objects are read too (as plain values only).
        limits: bounds on its memory.

    Raises:
        InputError: no such file, damaged, beyond the limits, of records or dates, or of Python objects that are
            refused or not allowed.
    """
    path = check_readable(path, "an .npy array")
    budget = Budget(str(path), limits or Limits())
    budget.charge(path.stat().st_size, 0)
    return _array(path.read_bytes(), objects, budget)


def read_npz(
    path: str | os.PathLike[str],
    names: Sequence[str] | None = None,
    *,
    objects: bool = False,
    limits: Limits | None = None,
) -> dict[str, np.ndarray]:
    """The arrays in an ``.npz`` archive, by name.

    Args:
        path: the file.
        names: which arrays to read, without ``.npy``; None reads all.
        objects: whether arrays of Python objects are read too (as plain values only).
        limits: bounds on all of them together, unpacked.

    Raises:
        InputError: no such file, not an archive, damaged, a missing array, or for the reasons of :func:`read_npy`.
    """
    path = check_readable(path, "an .npz archive")
    with path.open("rb") as file:
        return read_npz_file(file, str(path), names, objects=objects, limits=limits)


def read_npz_file(
    file: BinaryIO | io.BytesIO,
    path: str,
    names: Sequence[str] | None = None,
    *,
    objects: bool = False,
    limits: Limits | None = None,
) -> dict[str, np.ndarray]:
    """As :func:`read_npz`, of an open file that errors call ``path``.

    The headers of all arrays are read first, so that nothing is unpacked of a file that announces too much, or other
    shapes than it has bytes for.
    """
    budget = Budget(path, limits or Limits())
    if limits is None:
        budget.bound(_LEAST + _TIMES * file.seek(0, os.SEEK_END))
        file.seek(0)
    try:
        archive = zipfile.ZipFile(_SmallReads(file))
    except InputError:
        raise
    except _DAMAGE:
        raise InputError(f"{path}: is not an .npz archive, or is damaged; copy or download it again.") from None
    members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
    missing = [name for name in names or () if name not in members]
    if missing:
        raise InputError(f"{path}: has no array {clip(missing[0])}; it has {_some(list(members))}.")
    chosen = {name: members[name] for name in names or members}
    announced = 0
    for info in chosen.values():
        announced += info.file_size
        if announced > budget.left:
            budget.charge(announced, info.header_offset)
        _check_header(archive, info, budget)
    return {name: _member(archive, info, objects, budget) for name, info in chosen.items()}


def _check_header(archive: zipfile.ZipFile, info: zipfile.ZipInfo, whole: Budget) -> None:
    """Compare the shape in an array's header with its size."""
    name = f"{whole.name}, {clip(info.filename)}"
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InputError(f"{name}: is packed in a way that NumPy never uses; {CONVERT}.")
    try:
        with archive.open(info) as file:
            beginning = file.read(min(_LONGEST_HEADER + 12, info.file_size))
    except _DAMAGE as error:
        raise InputError(f"{name}: is damaged ({_reason(error)}); copy or download it again.") from None
    budget = Budget(name, whole.limits)
    dtype, shape, _, start = _header(beginning, budget)
    expected = math.prod(shape) * dtype.itemsize
    if not dtype.hasobject and start + expected != info.file_size:
        raise budget.damage(
            start, f"{dtype} of shape {clip(shape)} takes {expected} bytes and has {info.file_size - start}"
        )


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, objects: bool, whole: Budget) -> np.ndarray:
    name = f"{whole.name}, {clip(info.filename)}"
    whole.charge(info.file_size, info.header_offset)
    try:
        with archive.open(info) as file:
            data = bytearray()
            while piece := file.read(_LARGEST_READ // 2):  # never more than the file has, whatever size is announced
                data += piece
            if len(data) != info.file_size:
                raise EOFError("it is shorter than announced")
    except _DAMAGE as error:
        raise InputError(f"{name}: is damaged ({_reason(error)}); copy or download it again.") from None
    budget = Budget(name, whole.limits)
    budget.left, budget.most = whole.left, whole.most
    array = _array(data, objects, budget)
    whole.left = budget.left
    return array


def _array(data: bytes | bytearray, objects: bool, budget: Budget) -> np.ndarray:
    dtype, shape, fortran, start = _header(data, budget)
    content = memoryview(data)[start:]
    if not dtype.hasobject:
        return plain_array(content, dtype, shape, "F" if fortran else "C", budget, start)
    if not objects:
        raise budget.error(start, f"is an array of Python objects, which are not allowed here; {CONVERT}.")
    array = decode_with(bytes(content), budget)
    if not isinstance(array, np.ndarray) or array.shape != shape:
        raise budget.damage(start, f"expected an array of shape {clip(shape)}")
    return array


def _header(data: bytes | bytearray, budget: Budget) -> tuple[np.dtype, tuple[int, ...], bool, int]:
    """Type, shape, whether the first axis varies fastest, and the position of the content."""
    if data[:6] != _MAGIC or len(data) < 12:
        raise budget.error(0, "is not a NumPy array; expected one as numpy.save writes.")
    if data[6] not in (1, 2, 3) or data[7] != 0:
        raise budget.error(6, f"is an array of format {data[6]}.{data[7]}; expected 1.0 to 3.0.")
    start = 10 if data[6] == 1 else 12
    size = int.from_bytes(data[8:start], "little")
    if size > _LONGEST_HEADER or start + size > len(data):
        raise budget.damage(8, f"a header of {size} bytes")
    text = data[start : start + size].decode("latin-1").rstrip()
    parsed = _parsed(text)
    if parsed is None:
        if "'descr': [" in text:
            raise budget.error(start, f"is an array of records; expected plain numbers or text; {CONVERT}.")
        raise budget.damage(start, "its header is not as numpy.save writes it")
    description, fortran, sizes = parsed
    dtype = plain_type(description, budget, start, objects=True)
    return dtype, check_shape(sizes, budget, start), fortran, start + size


@lru_cache(maxsize=64)  # headers are read before arrays, so each one twice
def _parsed(text: str) -> tuple[str, bool, tuple[int, ...]] | None:
    """Type, whether the first axis varies fastest, and shape in a header; None if it is not as NumPy writes it."""
    if not _HEADER.fullmatch(text):
        return None
    items = [next((part for part in match if part), "") for match in re.findall(_ITEM, text)]
    found = dict(zip(re.findall(r"'(descr|fortran_order|shape)':", text), items, strict=True))
    sizes = [part.strip() for part in found.get("shape", "").split(",")]
    if len(found) != 3 or not all(_SIZE.fullmatch(part) for part in sizes if part):
        return None
    return found["descr"], found["fortran_order"] == "True", tuple(int(part.rstrip("L")) for part in sizes if part)


class _SmallReads(io.RawIOBase):
    """A file that refuses large reads, such as those of ``zipfile`` for the sizes that a file claims."""

    def __init__(self, file: BinaryIO | io.BytesIO) -> None:
        self.file = file

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self.file.tell()

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        return self.file.seek(offset, whence)

    def read(self, size: int = -1) -> bytes:
        data = self.file.read(size if 0 <= size <= _LARGEST_READ else _LARGEST_READ + 1)
        if len(data) > _LARGEST_READ:
            raise zipfile.BadZipFile("a part of it is too large")
        return data


def _some(names: list[str]) -> str:
    shown = ", ".join(clip(name, 30) for name in names[:8])
    return shown + (" and more" if len(names) > 8 else "") if shown else "none"


def _reason(error: BaseException) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__
