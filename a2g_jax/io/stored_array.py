"""Arrays in ``.npy`` files, read piece by piece.

A memory-mapped file that becomes shorter ends the process with SIGBUS and no message, and one that is changed changes
what was computed from it. Here every piece is read by the system's ``pread``, after a look at the file's size and time.
"""

import math
import os
from pathlib import Path
from threading import Lock
from tokenize import TokenError
from typing import Any

import numpy as np

from a2g_jax.errors import InputError

_SEEKING = Lock()


class StoredArray:
    """An array on disk; slices and rows of it are NumPy arrays in memory."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Open a file.

        Raises:
            InputError: not an array of plain numbers in C order, or longer or shorter than its header says.
        """
        self.path = Path(path)
        try:
            self._file = self.path.open("rb", buffering=0)
            self.shape, self.dtype, self._start = _header(self._file)
            status = os.fstat(self._file.fileno())
        except (OSError, ValueError, EOFError) as error:
            reason = " ".join(str(error).split())[:200]
            raise InputError(f"{self.path}: cannot be read ({reason}); prepare the corpus anew.") from None
        self._row = math.prod(self.shape[1:]) * self.dtype.itemsize
        expected = self._start + self.nbytes
        if status.st_size != expected:
            raise InputError(
                f"{self.path}: has {status.st_size} bytes, its header says {expected}; copy it again, or prepare the"
                " corpus anew."
            )
        self._state = status.st_size, status.st_mtime_ns

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    @property
    def nbytes(self) -> int:
        """Bytes of the values."""
        return math.prod(self.shape) * self.dtype.itemsize

    def __len__(self) -> int:
        return self.shape[0]

    def read(self, start: int, stop: int) -> np.ndarray:
        """Rows ``start`` to ``stop`` in memory.

        Raises:
            InputError: the file was changed since it was opened, or cannot be read.
        """
        rows = np.empty((max(stop - start, 0), *self.shape[1:]), self.dtype)
        view = rows.reshape(-1).view(np.uint8).data if rows.size else memoryview(b"")
        at, done = self._start + start * self._row, 0
        try:
            status = os.fstat(self._file.fileno())
            if (status.st_size, status.st_mtime_ns) != self._state:
                raise InputError(
                    f"{self.path}: was changed while it was in use (it had {self._state[0]} bytes, now"
                    f" {status.st_size}); restore it, then run the command again."
                )
            while done < len(view):
                got = _read_at(self._file, view[done:], at + done)
                if got == 0:
                    raise InputError(f"{self.path}: became shorter while it was in use; restore it.")
                done += got
        except OSError as error:
            raise InputError(f"{self.path}: cannot be read ({error.strerror}); check the disk.") from None
        return rows

    def __getitem__(self, index: Any) -> np.ndarray:
        if isinstance(index, tuple):
            first, *rest = index
            rows = self[first]
            return rows[tuple(rest)] if isinstance(first, int | np.integer) else rows[(slice(None), *rest)]
        if isinstance(index, slice):
            start, stop, step = index.indices(len(self))
            if step == 1:
                return self.read(start, stop)
            return self[np.arange(start, stop, step)]
        if isinstance(index, int | np.integer):
            row = int(index) + (len(self) if index < 0 else 0)
            if not 0 <= row < len(self):
                raise IndexError(f"row {index} of {len(self)}")
            return self.read(row, row + 1)[0]
        chosen = np.asarray(index)
        if chosen.dtype == bool:
            chosen = np.flatnonzero(chosen)
        flat = [self[int(row)] for row in chosen.reshape(-1)]
        rows = np.stack(flat) if flat else self.read(0, 0)
        return rows.reshape(*chosen.shape, *self.shape[1:])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        if copy is False:
            raise ValueError("an array on disk cannot be used without a copy")
        whole = self.read(0, len(self))
        return whole if dtype is None else whole.astype(dtype, copy=False)

    def __repr__(self) -> str:
        return f"StoredArray({str(self.path)!r}, {self.dtype}, {self.shape})"

    def __del__(self) -> None:
        file = getattr(self, "_file", None)
        if file is not None:
            file.close()


def _read_at(file: Any, view: memoryview, at: int) -> int:
    if hasattr(os, "preadv"):
        return os.preadv(file.fileno(), [view], at)
    with _SEEKING:  # Windows; a training reads ahead in a thread
        file.seek(at)
        return file.readinto(view)


def _header(file: Any) -> tuple[tuple[int, ...], np.dtype, int]:
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"it is an array of format {version[0]}.{version[1]}")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    try:
        shape, fortran, dtype = read(file)
    except (SyntaxError, TokenError, TypeError, RecursionError, MemoryError) as error:
        raise ValueError(str(error)) from None
    if fortran or dtype.kind not in "iuf" or not shape or any(size < 0 for size in shape):
        raise ValueError(f"it holds {dtype} of shape {shape}; expected rows of plain numbers")
    return shape, dtype, file.tell()
