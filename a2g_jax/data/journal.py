"""An unfinished corpus: a hidden folder beside its final place, from which a killed preparation resumes.

Every finished recording is a line in a journal, which reaches the disk after its rows. Resuming keeps the rows of valid
lines and cuts off all that follows, so the finished corpus is the same byte for byte.
"""

import hashlib
import json
import os
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from a2g_jax.data.body_json import body_from_json, body_to_json
from a2g_jax.data.corpus_layout import ANNOTATIONS, ARRAYS, WAVEFORM, Entry
from a2g_jax.data.featurise import Prepared, Skipped
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_rows import layout_rows
from a2g_jax.geometry.pose_space import WIDTHS
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.files import make_folder, sha256_file, write_json

_JOURNAL = "journal.txt"


class Unfinished:
    """Rows and annotations of a corpus that is being prepared; call :meth:`recover` first."""

    def __init__(self, folder: Path, features: Features) -> None:
        self.folder = folder
        self.corpus = folder / "corpus"
        """The corpus itself, to be moved to its final place when it is complete."""
        self.entries: list[Entry] = []
        self.skipped: list[Skipped] = []
        """Recordings that could not be prepared."""
        self.body: Skeleton | PoseLayout | None = None
        self.annotation_hashes: list[str] = []
        """SHA-256 of the annotations of each entry."""
        self.spread = 0.0
        """Largest difference of a bone offset from that of the first recording, metres."""
        self._features = features
        self._arrays = (*ARRAYS, WAVEFORM) if features.waveform else ARRAYS
        self._hashes: dict[str, str] = {}
        self._files: dict[str, BinaryIO] = {}

    def trust(self, hashes: Mapping[str, str]) -> None:
        """Take SHA-256 of source files that are not at hand."""
        self._hashes.update(hashes)

    @property
    def frames(self) -> int:
        """Rows so far."""
        return sum(entry.frames for entry in self.entries)

    @property
    def done(self) -> int:
        """Number of finished recordings, prepared or skipped."""
        return len(self.entries) + len(self.skipped)

    def recover(self, sources: Sequence[tuple[str, tuple[str, ...]]]) -> tuple[int, int]:
        """Keep the recordings that are still valid, in order, and cut off the rest.

        Returns the numbers of those kept and of those found.

        Args:
            sources: name and files of every recording of the corpus.
        """
        make_folder(self.corpus / ANNOTATIONS)
        lines = self._journal_lines()
        valid = 0
        for line, (name, files) in zip(lines, sources, strict=False):
            if not self._accept(line, name, files):
                break
            valid += 1
        self._cut(lines[:valid])
        return valid, len(lines)

    def append(self, item: Prepared) -> None:
        """Add a recording; it is on the disk when this returns.

        Raises:
            InputError: its joints differ from those of the recordings before it.
        """
        self._check_body(item)
        values = (item.audio, item.pose, item.root, item.waveform)[: len(self._arrays)]
        arrays = [np.ascontiguousarray(each, _kind(name)) for name, each in zip(self._arrays, values, strict=True)]
        for name, array in zip(self._arrays, arrays, strict=True):
            file = self._file(name)
            file.write(array.reshape(-1).view(np.uint8).data)
            _sync(file)
        annotations = self._annotations(len(self.entries))
        write_json(annotations, item.annotations)
        entry = Entry(
            item.name,
            self.frames,
            len(item.audio),
            item.speaker,
            item.emotion,
            self.hashes_of(item.sources),
            item.split,
            self._samples,
            0 if item.waveform is None else len(item.waveform),
            item.waveform_gain,
        )
        digest = sha256_file(annotations)
        value = {
            "entry": entry.to_json(),
            "rows": hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest(),
            "annotations": digest,
            "spread": self.spread,
            "body": None if self.entries else body_to_json(item.body),
        }
        self._write_line(value)
        self.entries.append(entry)
        self.annotation_hashes.append(digest)

    def skip(self, item: Skipped) -> None:
        """Note a recording that cannot be prepared; it is tried again once one of its files has changed."""
        self._write_line({"skipped": asdict(item), "sources": self.hashes_of(item.sources)})
        self.skipped.append(item)

    def _write_line(self, value: dict[str, Any]) -> None:
        with (self.folder / _JOURNAL).open("a", encoding="utf-8", newline="\n") as journal:
            journal.write(_sealed(json.dumps(value)))
            journal.flush()
            os.fsync(journal.fileno())

    def hashes_of(self, sources: tuple[str, ...]) -> dict[str, str]:
        """SHA-256 of files, each read once: large ones are the sources of many recordings."""
        for source in sources:
            if source not in self._hashes:
                try:
                    self._hashes[source] = sha256_file(source)
                except (InputError, OSError):
                    self._hashes[source] = ""  # a skipped recording may lack a file
        return {source: self._hashes[source] for source in sources}

    def finish_arrays(self) -> None:
        """Put the final shapes into the headers of the arrays, and close them."""
        for name in self._arrays:
            file = self._file(name)
            file.seek(0)
            file.write(_header(name, (self._count(name), *self._row_shape(name))))
            _sync(file)
        self.close()

    def close(self) -> None:
        """Close the arrays."""
        files, self._files = self._files, {}
        for file in files.values():
            with suppress(OSError):  # what a full disk did not take; the journal has no line of it
                file.close()

    def _check_body(self, item: Prepared) -> None:
        where, body = " and ".join(item.sources) or item.name, item.body
        if self.body is None:
            self.body = body
        elif isinstance(body, Skeleton) and isinstance(self.body, Skeleton):
            if not self.body.same_tree(body):
                raise InputError(
                    f"{where}: has other joints ({body.joints} of them) than the recordings before it"
                    f" ({self.body.joints}); prepare rigs of one kind together."
                )
            difference = np.abs(body.offsets[1:] - self.body.offsets[1:]).max(initial=0)
            self.spread = max(self.spread, float(difference))
        elif not _same_rows(self.body, body):
            raise InputError(f"{where}: has other points or bones than those before it; prepare it separately.")

    def _journal_lines(self) -> list[dict[str, Any]]:
        """Lines of the journal up to the first that is incomplete or damaged."""
        values: list[dict[str, Any]] = []
        with suppress(OSError, UnicodeDecodeError):
            for line in (self.folder / _JOURNAL).read_text(encoding="utf-8").split("\n")[:-1]:
                seal, _, text = line.partition(" ")
                if seal != f"{zlib.crc32(text.encode()):08x}":
                    break
                values.append(json.loads(text))
        return values

    def _accept(self, line: dict[str, Any], name: str, files: tuple[str, ...]) -> bool:
        """Whether a recording is complete on the disk and its sources are unchanged; if so, add it to the entries."""
        if "skipped" in line:
            skipped = Skipped(name, files, line["skipped"]["reason"])
            if line["skipped"]["name"] != name or line["sources"] != self.hashes_of(files):
                return False
            self.skipped.append(skipped)
            return True
        entry = Entry(**line["entry"])
        number = len(self.entries)
        if entry.name != name or entry.first != self.frames or tuple(entry.sources) != files:
            return False
        if self.body is None:
            self.body = body_from_json(line["body"])
        try:
            same = self.hashes_of(files) == entry.sources
            same = same and sha256_file(self._annotations(number)) == line["annotations"]
        except InputError:
            same = False
        if not same or self._hash_rows(entry) != line["rows"]:
            if number == 0:
                self.body = None
            return False
        self.entries.append(entry)
        self.annotation_hashes.append(line["annotations"])
        self.spread = line["spread"]
        return True

    def _hash_rows(self, entry: Entry) -> str:
        digest = hashlib.sha256()
        for name in self._arrays:
            width = self._row_bytes(name)
            first, count = (entry.first_sample, entry.samples) if name == WAVEFORM else (entry.first, entry.frames)
            with suppress(FileNotFoundError), (self.corpus / name).open("rb") as file:
                file.seek(_HEADER_BYTES + first * width)
                digest.update(file.read(count * width))
        return digest.hexdigest()

    def _cut(self, lines: list[dict[str, Any]]) -> None:
        journal = self.folder / _JOURNAL
        # The journal first: no line may be left without its rows.
        temporary = journal.with_suffix(".new")
        temporary.write_text("".join(_sealed(json.dumps(line)) for line in lines), encoding="utf-8", newline="\n")
        temporary.replace(journal)
        for name in self._arrays:
            path = self.corpus / name
            if self.body is None:
                path.unlink(missing_ok=True)
            else:
                os.truncate(path, _HEADER_BYTES + self._count(name) * self._row_bytes(name))
        keep = {self._annotations(number).name for number in range(len(self.entries))}
        for path in (self.corpus / ANNOTATIONS).iterdir():
            if path.name not in keep:
                path.unlink()

    def _file(self, name: str) -> BinaryIO:
        if name not in self._files:
            path = self.corpus / name
            if not path.exists():
                path.write_bytes(_header(name, (0, *self._row_shape(name))))
            self._files[name] = path.open("r+b")
            self._files[name].seek(0, os.SEEK_END)
        return self._files[name]

    @property
    def _samples(self) -> int:
        return sum(entry.samples for entry in self.entries)

    def _count(self, name: str) -> int:
        return self._samples if name == WAVEFORM else self.frames

    def _row_shape(self, name: str) -> tuple[int, ...]:
        pose = self._features.pose
        if isinstance(self.body, Skeleton):
            rows = self.body.joints
        else:
            assert self.body is not None
            rows = layout_rows(self.body, pose)
        shapes: dict[str, tuple[int, ...]] = {"audio.npy": (self._features.mel.width,), "root.npy": (3,), WAVEFORM: ()}
        return {**shapes, "pose.npy": (rows, WIDTHS[pose])}[name]

    def _row_bytes(self, name: str) -> int:
        return np.dtype(_kind(name)).itemsize * int(np.prod(self._row_shape(name)))

    def _annotations(self, number: int) -> Path:
        return self.corpus / ANNOTATIONS / f"{number:05d}.json"


def _kind(name: str) -> type[np.generic]:
    return np.int16 if name == WAVEFORM else np.float32


def _same_rows(first: Skeleton | PoseLayout, second: Skeleton | PoseLayout) -> bool:
    if isinstance(first, Skeleton) or isinstance(second, Skeleton):
        return False
    return (first.names, first.bones) == (second.names, second.bones)


def _header(name: str, shape: tuple[int, ...]) -> bytes:
    """The header of an .npy file; NumPy leaves room in it for any number of rows, so its length is fixed."""
    file = BytesIO()
    descr = np.lib.format.dtype_to_descr(np.dtype(_kind(name)))
    np.lib.format.write_array_header_1_0(file, {"descr": descr, "fortran_order": False, "shape": shape})
    return file.getvalue()


_HEADER_BYTES = len(_header(ARRAYS[0], (0, 3)))
assert len(_header(WAVEFORM, (0,))) == _HEADER_BYTES


def _sealed(text: str) -> str:
    return f"{zlib.crc32(text.encode()):08x} {text}\n"


def _sync(file: BinaryIO) -> None:
    file.flush()
    os.fsync(file.fileno())
