"""Arrays in HDF5 files by h5py, in this process: see :mod:`a2g_jax.io.hdf5`."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted.budget import CONVERT, Budget, Limits, clip

#: Numbers of the allowed filters: deflate, shuffle, Fletcher's checksum, and h5py's LZF.
_FILTERS = frozenset({1, 2, 3, 32000})
#: Bytes charged for the library's bookkeeping of one chunk.
_CHUNK = 512
_MOST_SHOWN = 8
# Exceptions of h5py for errors of the C library.
_DAMAGE = (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError)


def read_hdf5_here(path: Path, names: Sequence[str], limits: Limits) -> dict[str, np.ndarray]:
    """As :func:`~a2g_jax.io.hdf5.read_hdf5`, in this process, which a damaged file may crash.

    Raises:
        InputError: as there.
    """
    import h5py

    whole = Budget(str(path), limits)
    try:
        file = h5py.File(path, "r", locking=False)
    except _DAMAGE:
        raise InputError(f"{path}: is not an HDF5 file, or is damaged; copy or download it again.") from None
    with file:
        found, result = {}, {}
        for name in names:
            with _named(path, name):
                found[name] = _find(h5py, path, file, name)
                _check(h5py, path, found[name], name, whole)
        for name, place in found.items():
            with _named(path, name):
                result[name] = _read(h5py, path, place, name, whole)
    return result


@contextmanager
def _named(path: Path, name: str) -> Iterator[None]:
    try:
        yield
    except InputError:
        raise
    except _DAMAGE as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"{path}: {clip(name)} is damaged ({reason}); copy or download it again.") from None


def _find(h5py: Any, path: Path, file: Any, name: str) -> Any:
    """The data set with this name, through groups of this file only."""
    place = file
    parts = [part for part in name.split("/") if part]
    for number, part in enumerate(parts):
        link = place.get(part, getlink=True) if isinstance(place, h5py.Group) else None
        if link is None:
            there = list(islice(place, _MOST_SHOWN + 1)) if isinstance(place, h5py.Group) else []
            shown = ", ".join(clip(entry, 30) for entry in there[:_MOST_SHOWN]) or "nothing"
            above = clip("/".join(parts[:number])) if number else "the file"
            more = " and more" if len(there) > _MOST_SHOWN else ""
            raise InputError(f"{path}: has no data set {clip(name)}; {above} has {shown}{more}.")
        if not isinstance(link, h5py.HardLink):
            target = clip(getattr(link, "filename", None) or getattr(link, "path", ""))
            raise InputError(f"{path}: {clip(name)} is a link to {target}, which is refused; {CONVERT}.")
        place = place[part]
    if not isinstance(place, h5py.Dataset):
        raise InputError(f"{path}: {clip(name)} is a group or a type; name a data set.")
    return place


def _check(h5py: Any, path: Path, found: Any, name: str, budget: Budget) -> None:
    """Refuse a data set by its header."""

    def refuse(what: str) -> InputError:
        return InputError(f"{path}: {clip(name)} {what}; {CONVERT}.")

    layout = found.id.get_create_plist()
    if layout.get_external_count() or layout.get_layout() == h5py.h5d.VIRTUAL:
        raise refuse("is stored in other files, which is refused")
    filters = [layout.get_filter(index) for index in range(layout.get_nfilters())]
    codes = [code for code, *_ in filters]
    for code, _, _, label in filters:
        if code not in _FILTERS or codes.count(code) > 1:
            raise refuse(f"is packed by filter {code} ({clip(label, 30)}), which is refused")
    text = h5py.check_string_dtype(found.dtype)
    dtype, shape = found.dtype, found.shape
    if text is not None and text.length is None:
        # A damaged heap, where such text is stored, sends the C library into an endless loop.
        raise refuse("is text of variable length, which is refused")
    if shape is None or not (text or (dtype.kind in "biuf" and dtype.itemsize <= 8)):
        raise refuse(f"is of type {clip(str(dtype))}; expected an array of plain numbers or text")
    size = math.prod(shape)
    charge = _charger(path, name, budget)
    charge(2 * size * dtype.itemsize)
    if found.chunks is not None:
        grid = [-(-length // step) for length, step in zip(shape, found.chunks, strict=True)]
        charge(2 * math.prod(found.chunks) * dtype.itemsize + _CHUNK * math.prod(grid))
    if size and not found.id.get_storage_size():
        raise InputError(f"{path}: {clip(name)} was never written; copy or download the file again.")


def _read(h5py: Any, path: Path, found: Any, name: str, budget: Budget) -> np.ndarray:
    array, dtype = found[()], found.dtype
    if h5py.check_string_dtype(dtype) is not None:
        _charger(path, name, budget)(8 * array.nbytes)
        return np.char.decode(array, "utf-8")
    array = np.array(array, dtype.newbyteorder("=").str, order="C")
    if dtype.kind == "b" and array.size and array.view(np.uint8).max() > 1:
        raise ValueError("a boolean is neither 0 nor 1")
    return array


def _charger(path: Path, name: str, budget: Budget) -> Callable[[int], None]:
    def charge(size: int) -> None:
        budget.left -= size
        if budget.left < 0:
            raise InputError(
                f"{path}: {clip(name)} would take more than {budget.limits.size} bytes of memory; if you trust the "
                "file, raise the limit."
            )

    return charge
