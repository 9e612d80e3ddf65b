"""A corpus in the making: a hidden folder beside its place, from which a killed preparation goes on.

Every finished recording is a line in a journal that reached the disk after its rows. Going on, the rows of the lines
that hold are kept and whatever follows them is cut off, so the finished corpus is the same byte for byte.
"""

import hashlib
import json
import os
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from a2g_jax.data.corpus import ARRAYS, Entry, skeleton_from_json, skeleton_to_json
from a2g_jax.data.rows import Prepared
from a2g_jax.errors import InputError
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.files import make_folder, sha256_file, write_json

_JOURNAL = "journal.txt"


class Unfinished:
    """Rows and annotations of a corpus that is being prepared; call :meth:`recover` first."""

    def __init__(self, folder: Path, bands: int) -> None:
        self.folder = folder
        self.corpus = folder / "corpus"
        """The corpus itself, to be moved to its place when it is complete."""
        self.entries: list[Entry] = []
        self.skeleton: Skeleton | None = None
        self.spread = 0.0
        """Largest difference of a bone offset from that of the first recording, metres."""
        self._bands = bands
        self._lines: list[str] = []
        self._files: dict[str, BinaryIO] = {}

    @property
    def frames(self) -> int:
        """Rows so far."""
        return sum(entry.frames for entry in self.entries)

    def recover(self, sources: Sequence[tuple[str, tuple[str, ...]]]) -> tuple[int, int]:
        """Keep the recordings that are still good, in order, and cut off the rest.

        Returns how many are kept, and how many there were.

        Args:
            sources: name and files of every recording that the corpus shall have.
        """
        make_folder(self.corpus / "annotations")
        lines = self._journal_lines()
        good = 0
        for line, (name, files) in zip(lines, sources, strict=False):
            if not self._take(line, name, files):
                break
            good += 1
        self._cut(lines[:good])
        return good, len(lines)

    def append(self, item: Prepared) -> None:
        """Add a recording; when this returns it is on the disk.

        Raises:
            InputError: it has other joints than those before it.
        """
        self._check_rig(item)
        arrays = [np.ascontiguousarray(values, np.float32) for values in (item.audio, item.pose, item.root)]
        for name, array in zip(ARRAYS, arrays, strict=True):
            file = self._file(name)
            array.tofile(file)
            _sync(file)
        annotations = self._annotations(len(self.entries))
        write_json(annotations, item.annotations)
        hashes = {str(source): sha256_file(source) for source in item.sources}
        entry = Entry(item.name, self.frames, len(item.audio), item.speaker, item.emotion, hashes)
        value = {
            "entry": asdict(entry),
            "rows": hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest(),
            "annotations": sha256_file(annotations),
            "spread": self.spread,
            "skeleton": None if self.entries else skeleton_to_json(item.skeleton),
        }
        with (self.folder / _JOURNAL).open("a", encoding="utf-8", newline="\n") as journal:
            journal.write(_sealed(json.dumps(value)))
            journal.flush()
            os.fsync(journal.fileno())
        self.entries.append(entry)

    def finish_arrays(self) -> None:
        """Put the final shapes into the headers of the arrays, and close them."""
        for name in ARRAYS:
            file = self._file(name)
            file.seek(0)
            file.write(_header((self.frames, *self._row_shape(name))))
            _sync(file)
        self.close()

    def close(self) -> None:
        """Close the arrays."""
        for file in self._files.values():
            file.close()
        self._files = {}

    def _check_rig(self, item: Prepared) -> None:
        if self.skeleton is None:
            self.skeleton = item.skeleton
        elif not self.skeleton.same_tree(item.skeleton):
            raise InputError(
                f"{' and '.join(item.sources) or item.name}: has other joints ({item.skeleton.joints} of them) than"
                f" the recordings before it ({self.skeleton.joints}); prepare rigs of one kind together."
            )
        else:
            difference = np.abs(item.skeleton.offsets[1:] - self.skeleton.offsets[1:]).max(initial=0)
            self.spread = max(self.spread, float(difference))

    def _journal_lines(self) -> list[dict[str, Any]]:
        """What the journal tells, up to the first line that a kill cut short or that was damaged."""
        values: list[dict[str, Any]] = []
        with suppress(OSError, UnicodeDecodeError):
            for line in (self.folder / _JOURNAL).read_text(encoding="utf-8").split("\n")[:-1]:
                seal, _, text = line.partition(" ")
                if seal != f"{zlib.crc32(text.encode()):08x}":
                    break
                values.append(json.loads(text))
        return values

    def _take(self, line: dict[str, Any], name: str, files: tuple[str, ...]) -> bool:
        """Whether a recording is whole on the disk and made from the files as they are now; if so, count it in."""
        entry = Entry(**line["entry"])
        number = len(self.entries)
        if entry.name != name or entry.first != self.frames or tuple(entry.sources) != files:
            return False
        if self.skeleton is None:
            self.skeleton = skeleton_from_json(line["skeleton"])
        try:
            same = all(sha256_file(file) == before for file, before in entry.sources.items())
            same = same and sha256_file(self._annotations(number)) == line["annotations"]
        except InputError:
            same = False
        if not same or self._hash_rows(entry) != line["rows"]:
            if number == 0:
                self.skeleton = None
            return False
        self.entries.append(entry)
        self.spread = line["spread"]
        return True

    def _hash_rows(self, entry: Entry) -> str:
        digest = hashlib.sha256()
        for name in ARRAYS:
            width = self._row_bytes(name)
            with suppress(FileNotFoundError), (self.corpus / name).open("rb") as file:
                file.seek(_HEADER_BYTES + entry.first * width)
                digest.update(file.read(entry.frames * width))
        return digest.hexdigest()

    def _cut(self, lines: list[dict[str, Any]]) -> None:
        journal = self.folder / _JOURNAL
        # The journal first: a line never tells of rows that are gone.
        temporary = journal.with_suffix(".new")
        temporary.write_text("".join(_sealed(json.dumps(line)) for line in lines), encoding="utf-8", newline="\n")
        temporary.replace(journal)
        for name in ARRAYS:
            path = self.corpus / name
            if self.skeleton is None:
                path.unlink(missing_ok=True)
            else:
                os.truncate(path, _HEADER_BYTES + self.frames * self._row_bytes(name))
        keep = {self._annotations(number).name for number in range(len(self.entries))}
        for path in (self.corpus / "annotations").iterdir():
            if path.name not in keep:
                path.unlink()

    def _file(self, name: str) -> BinaryIO:
        if name not in self._files:
            path = self.corpus / name
            if not path.exists():
                path.write_bytes(_header((0, *self._row_shape(name))))
            self._files[name] = path.open("r+b")
            self._files[name].seek(0, os.SEEK_END)
        return self._files[name]

    def _row_shape(self, name: str) -> tuple[int, ...]:
        assert self.skeleton is not None
        return {"audio.npy": (self._bands,), "pose.npy": (self.skeleton.joints, 6), "root.npy": (3,)}[name]

    def _row_bytes(self, name: str) -> int:
        return 4 * int(np.prod(self._row_shape(name)))

    def _annotations(self, number: int) -> Path:
        return self.corpus / "annotations" / f"{number:05d}.json"


def _header(shape: tuple[int, ...]) -> bytes:
    """The header of a float32 .npy file; NumPy leaves room in it for any number of rows, so its length is fixed."""
    file = BytesIO()
    descr = np.lib.format.dtype_to_descr(np.dtype(np.float32))
    np.lib.format.write_array_header_1_0(file, {"descr": descr, "fortran_order": False, "shape": shape})
    return file.getvalue()


_HEADER_BYTES = len(_header((0, 3)))


def _sealed(text: str) -> str:
    return f"{zlib.crc32(text.encode()):08x} {text}\n"


def _sync(file: BinaryIO) -> None:
    file.flush()
    os.fsync(file.fileno())
