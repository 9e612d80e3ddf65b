"""Reading LMDB databases (``data.mdb``) without LMDB.

The C library trusts the file: it maps it and follows page numbers and offsets without checks, so a hostile or damaged
database can crash the process. The format is small enough to read with every step checked: two start pages refer to the
root of a B+ tree; its pages hold keys in order, and values or the numbers of further pages; large values are stored in
separate runs of pages. Pages are read and not mapped, because truncating a mapped file kills the process too.

Source: the comments and structures of ``mdb.c`` (LMDB 0.9, data version 1; 64-bit, little-endian).
"""

import bisect
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable
from a2g_jax.io.untrusted.budget import Limits

_MAGIC, _VERSION = 0xBEEFC0DE, 1
_HEADER = struct.Struct("<QHHHH")  # page number, padding, flags, where its gap begins and ends
_RUN = struct.Struct("<QHHI")  # page number, padding, flags, pages
_META = struct.Struct("<IIQQ48s48sQQ")  # magic, version, address, map size, free and main tree, last page, transaction
_TREE = struct.Struct("<IHHQQQQQ")  # padding, flags, depth, branch, leaf and overflow pages, entries, root
_NODE = struct.Struct("<HHHH")  # low and high bits of size or page number, flags, size of the key
_BRANCH, _LEAF, _OVERFLOW, _IS_META, _DIRTY = 1, 2, 4, 8, 16
_BIG = 1
_NO_PAGE = 2**64 - 1
_DEEPEST = 32
_FLAGS = {
    0x02: "keys in reversed order (MDB_REVERSEKEY)",
    0x04: "several values for a key (MDB_DUPSORT)",
    0x08: "keys that are integers (MDB_INTEGERKEY)",
}


@dataclass(frozen=True)
class _Page:
    number: int
    data: bytes
    nodes: tuple[int, ...]
    keys: tuple[bytes, ...]


class LmdbFile:
    """The entries of an LMDB database in the order of their keys; a context manager.

    Args:
        path: the folder with ``data.mdb`` in it, or a database file.
        limits: ``size`` bounds each value.

    Raises:
        InputError: no such file, not a database, or one with features that no data set uses (several values for a key,
            keys in another order, named databases). Damage is detected at the latest when the page is read.
    """

    def __init__(self, path: str | os.PathLike[str], limits: Limits | None = None) -> None:
        path = Path(path)
        self.path = check_readable(path / "data.mdb" if path.is_dir() else path, "an LMDB database (data.mdb)")
        self._limits = limits or Limits()
        self._file = self.path.open("rb")
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "LmdbFile":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return self._entries

    def close(self) -> None:
        """Close the file; values that were read stay valid."""
        self._file.close()

    def items(self, start: bytes = b"") -> Iterator[tuple[bytes, bytes]]:
        """Keys and values in the order of the keys, from ``start`` on.

        Raises:
            InputError: the file is damaged, after the entries before the damage.
        """
        for key, page, node in self._entries_from(start):
            yield key, self._value(page, node)

    def keys(self) -> Iterator[bytes]:
        """The keys in order, without reading large values."""
        return (key for key, _, _ in self._entries_from(b""))

    def get(self, key: bytes) -> bytes | None:
        """The value of a key, or None."""
        for found, page, node in self._entries_from(key):
            return self._value(page, node) if found == key else None
        return None

    def _fail(self, message: str) -> NoReturn:
        raise InputError(f"{self.path}: {message}")

    def _damaged(self, page: int, what: str) -> NoReturn:
        self._fail(f"page {page} is damaged ({what}); copy or download the database again.")

    def _read(self, at: int, size: int) -> bytes:
        if self._file.closed:
            self._fail("is closed; open it again.")
        try:
            self._file.seek(at)
            return self._file.read(size)
        except OSError as error:
            self._fail(f"cannot be read ({error.strerror}); check the disk.")

    def _open(self) -> None:
        self._size = self.path.stat().st_size
        first = self._meta(0)
        if first is None:
            self._fail("is not an LMDB database (version 1, 64-bit, little-endian); expected the data.mdb of one.")
        self._page_size = first[1]
        second = self._meta(self._page_size)
        if second is None or second[1] != self._page_size:
            self._damaged(1, "expected the second of two start pages")
        newest = max(first, second)
        _, _, self._last, tree = newest
        _, flags, self._depth, _, _, _, self._entries, self._root = _TREE.unpack(tree)
        for flag, name in _FLAGS.items():
            if flags & flag:
                self._fail(f"has {name}, which is not supported; copy its entries into a plain database.")
        is_empty = self._entries == 0
        if self._depth > _DEEPEST or self._entries > self._size // _NODE.size or is_empty != (self._root == _NO_PAGE):
            self._damaged(0, f"it claims {self._entries} entries, {self._depth} levels deep")

    def _meta(self, at: int) -> tuple[int, int, int, bytes] | None:
        """One of the two start pages: transaction, page size, last page, tree; None if it is no start page."""
        page = self._read(at, _HEADER.size + _META.size)
        if len(page) < _HEADER.size + _META.size:
            return None
        magic, version, _, _, free, main, last, transaction = _META.unpack_from(page, _HEADER.size)
        size = _TREE.unpack(free)[0]
        is_meta = _HEADER.unpack_from(page)[2] & _IS_META and (magic, version) == (_MAGIC, _VERSION)
        if not is_meta or not 512 <= size <= 65536 or size & (size - 1):
            return None
        return transaction, size, last, main

    def _page(self, number: int, level: int) -> _Page:
        """A page of the tree, with its nodes and keys checked to be within it and disjoint."""
        if not 2 <= number <= self._last:
            self._damaged(number, f"it is outside of 2 to {self._last}")
        data = self._read(number * self._page_size, self._page_size)
        if len(data) < self._page_size:
            self._damaged(number, "the file ends before it")
        own, _, flags, lower, upper = _HEADER.unpack_from(data)
        expected = _LEAF if level == self._depth else _BRANCH
        if own != number or flags & ~_DIRTY != expected:
            self._damaged(number, f"expected a {'leaf' if expected == _LEAF else 'branch'}")
        count = (lower - _HEADER.size) // 2
        if not count > 0 or not lower <= upper <= self._page_size:
            self._damaged(number, "its header is inconsistent")
        nodes = struct.unpack_from(f"<{count}H", data, _HEADER.size)
        keys, room = [], self._page_size - upper
        for node in nodes:
            if not upper <= node <= self._page_size - _NODE.size:
                self._damaged(number, "an entry is outside of it")
            low, high, kind, length = _NODE.unpack_from(data, node)
            start = node + _NODE.size
            end = start + length
            room -= _NODE.size + length
            if expected == _LEAF:
                room -= 8 if kind & _BIG else low | high << 16
            if end > self._page_size or room < 0:
                self._damaged(number, "its entries exceed it or overlap")
            keys.append(data[start:end])
        return _Page(number, data, nodes, tuple(keys))

    def _entries_from(self, start: bytes) -> Iterator[tuple[bytes, _Page, int]]:
        """Key, page and node of each entry from ``start`` on.

        Checks that keys increase, and that no more pages are visited than there are.
        """
        if self._root == _NO_PAGE:
            return
        last, count, large, pages = None, 0, 0, 0
        waiting = [(self._root, 1)]
        while waiting:
            number, level = waiting.pop()
            page = self._page(number, level)
            pages += 1
            if pages > self._size // self._page_size:
                self._damaged(number, "its pages form a cycle")
            if level < self._depth:
                # The first key of a branch is empty: entries below it come before the second key.
                first = bisect.bisect_right(page.keys, start, lo=1) - 1 if last is None else 0
                waiting += [(self._child(page, node), level + 1) for node in reversed(page.nodes[first:])]
                continue
            first = bisect.bisect_left(page.keys, start) if last is None else 0
            for key, node in zip(page.keys[first:], page.nodes[first:], strict=True):
                if last is not None and key <= last:
                    self._damaged(number, "its keys do not increase")
                last = key
                count += 1
                size, flags = self._size_and_flags(page, node)
                large += size if flags & _BIG else 0
                if count > self._entries or large > self._size:
                    self._damaged(number, "the tree has more data than the file")
                yield key, page, node
        if not start and count != self._entries:
            self._damaged(self._root, f"{self._entries} entries are announced and {count} exist")

    def _child(self, page: _Page, node: int) -> int:
        low, high, top, _ = _NODE.unpack_from(page.data, node)
        return low | high << 16 | top << 32

    def _size_and_flags(self, page: _Page, node: int) -> tuple[int, int]:
        low, high, flags, _ = _NODE.unpack_from(page.data, node)
        if flags & ~_BIG:
            self._fail("has databases or several values under one key, which is not supported; copy its entries.")
        return low | high << 16, flags

    def _value(self, page: _Page, node: int) -> bytes:
        size, flags = self._size_and_flags(page, node)
        start = node + _NODE.size + _NODE.unpack_from(page.data, node)[3]
        stored = 8 if flags & _BIG else size
        if start + stored > self._page_size:
            self._damaged(page.number, "a value exceeds it")
        if not flags & _BIG:
            return page.data[start : start + size]
        if size > self._limits.size:
            self._fail(
                f"holds a value of {size} bytes, and the limit is {self._limits.size}; raise it if you trust it."
            )
        number = struct.unpack_from("<Q", page.data, start)[0]
        if not 2 <= number <= self._last:
            self._damaged(page.number, f"a value is on page {number} of {self._last}")
        head = self._read(number * self._page_size, _RUN.size)
        own, _, kind, pages = _RUN.unpack(head) if len(head) == _RUN.size else (-1, 0, 0, 0)
        if own != number or not kind & _OVERFLOW or _RUN.size + size > pages * self._page_size:
            self._damaged(number, "expected the start of a large value")
        at = number * self._page_size + _RUN.size
        if at + size > self._size:
            self._damaged(number, "the file ends within a large value")
        value = self._read(at, size)
        if len(value) < size:
            self._damaged(number, "the file ends within a large value")
        return value
