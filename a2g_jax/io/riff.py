"""WAV files whose header does not fit their samples: unfinished, in another variant, or cut short."""

import io
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from a2g_jax.errors import InputError
from a2g_jax.io.ffmpeg import conversion

#: Sizes from here on are placeholders if the file is shorter: of programs that write to a pipe, or that write the
#: size when they finish.
_PLACEHOLDERS = 0x7FFF0000
_CHUNK = struct.Struct("<4sI")
#: Names of usual chunks.
_NAMES = (b"fmt ", b"data", b"fact", b"LIST", b"bext", b"iXML", b"JUNK", b"cue ", b"smpl", b"id3 ", b"PEAK", b"PAD ")
_CONVERT = "convert it with the program that wrote it, or with ffmpeg."
#: Bytes that end a file of samples and are no samples: tags of MP3 players.
_TAGS = (b"TAG", b"ID3", b"APETAGEX")
#: Seconds of samples behind the end of the data by the header that show that recording went on.
_WENT_ON = 0.5


@dataclass(frozen=True)
class Layout:
    """Where the samples of a WAV file are, by its header and by its length."""

    form: bytes
    """Content of the chunk ``fmt``."""
    start: int
    """Offset of the first sample, bytes."""
    size: int
    """Bytes of samples."""
    note: str = ""
    """How the header was repaired; empty for a sound one."""
    plain: bool = True
    """Whether libsndfile reads the file as it is."""

    @property
    def frame_bytes(self) -> int:
        """Bytes of a sample of all channels."""
        return max(1, int(struct.unpack_from("<H", self.form, 12)[0]))


def wav_layout(path: Path) -> Layout | None:
    """The layout of a WAV file (RIFF, RF64 or BW64); None for another kind of file.

    A header that was never finished (a data size of 0 or a placeholder, samples behind the end that it states)
    gets the size that the file has.

    Raises:
        InputError: cut short, or without samples or a format.
    """
    length = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(12)
        if head[:4] not in (b"RIFF", b"RF64", b"BW64"):
            return None
        if len(head) < 12:
            raise InputError(f"{path}: is cut short inside its header; copy or export it again.")
        if head[8:] != b"WAVE":
            return None
        form, long_size, found = b"", None, None
        unpadded: list[bool] = []
        for name, claimed, start in _chunks(file, 12, unpadded):
            if name == b"data" and found is not None:
                raise InputError(f"{path}: has its samples in several parts ('data' chunks); {_CONVERT}")
            if name == b"ds64" and claimed >= 16:
                file.seek(start + 8)
                long_size = struct.unpack("<Q", file.read(8).ljust(8, b"\0"))[0]
            elif name == b"fmt ":
                file.seek(start)
                form = file.read(min(claimed, 4096))
            elif name == b"data":
                if len(form) < 16:
                    raise InputError(f"{path}: has no sample format before its samples; export it again.")
                size = long_size if long_size is not None and claimed == 0xFFFFFFFF else claimed
                found = Layout(form, start, size, plain=head[:4] != b"BW64" and not unpadded)
                if start + size >= length:
                    break
    if found is not None:
        with path.open("rb") as file:
            return _checked(path, file, found, length)
    raise InputError(
        f"{path}: is cut short: its header ends after {length} bytes, before any samples (no 'data' chunk);"
        " copy or export it again."
    )


def _chunks(file: BinaryIO, at: int, unpadded: list[bool] | None = None) -> Iterator[tuple[bytes, int, int]]:
    """Name, size by the header and start of each chunk: they are padded to an even number of bytes.

    Args:
        unpadded: gets an entry where a writer forgot the padding of an odd chunk.
    """
    file.seek(at)
    while len(chunk := file.read(8)) == 8:
        name, claimed = _CHUNK.unpack(chunk)
        start = file.tell()
        yield name, claimed, start
        file.seek(start + claimed + claimed % 2)
        if claimed % 2 and name != b"data":
            after = start + claimed
            file.seek(after)
            following = file.read(9)
            forgotten = following[:4] in _NAMES and following[1:5] not in _NAMES
            file.seek(after + (0 if forgotten else 1))
            if forgotten and unpadded is not None:
                unpadded.append(True)


def _checked(path: Path, file: BinaryIO, layout: Layout, length: int) -> Layout:
    there = max(length - layout.start, 0)
    claimed = layout.size
    if claimed > there:
        if claimed < _PLACEHOLDERS:
            seconds = there / max(_bytes_a_second(layout.form), 1)
            raise InputError(
                f"{path}: is cut short: the header says {claimed} bytes of samples and the file has {there}"
                f" ({seconds:.2f} s); copy it again, or keep what is there: {conversion(path, '_whole')}"
            )
        return _finished(layout, there, "a placeholder as its size")
    if claimed == 0 and there and not _is_chunks(file, layout.start, length):
        return _finished(layout, there, "a size of 0 bytes")
    behind = layout.start + claimed + claimed % 2
    rest = length - behind
    if claimed and rest > _WENT_ON * _bytes_a_second(layout.form) > 0 and not _is_chunks(file, behind, length):
        file.seek(behind)
        first = file.read(4096)
        if first.strip(b"\0") and not first.startswith(_TAGS):
            return _finished(layout, there, f"a size of {claimed} bytes")
    return layout


def _finished(layout: Layout, there: int, found: str) -> Layout:
    size = there - there % layout.frame_bytes
    note = f"its header was not finished ({found}): all {size} bytes behind it are read as samples."
    # A pipe's writer cannot know the size: no fault.
    return Layout(layout.form, layout.start, size, "" if found.startswith("a placeholder") else note, plain=False)


def _bytes_a_second(form: bytes) -> int:
    return int(struct.unpack_from("<I", form, 8)[0])


def _is_chunks(file: BinaryIO, at: int, length: int) -> bool:
    """Whether chunks follow one another from an offset to the end of the file."""
    if length - at < 8:
        return True
    for name, claimed, start in _chunks(file, at):
        if not (name.isascii() and name.decode("ascii").isprintable()) or start + claimed > length:
            return False
        if length - (start + claimed + claimed % 2) < 8:
            return True
    return True


def rebuilt(path: Path, layout: Layout) -> io.RawIOBase:
    """A readable file with a new header before the samples of a WAV file."""
    form = _CHUNK.pack(b"fmt ", len(layout.form)) + layout.form + b"\0" * (len(layout.form) % 2)
    if layout.size < 2**32 - 4096:
        body = form + _CHUNK.pack(b"data", layout.size)
        header = b"RIFF" + struct.pack("<I", 4 + len(body) + layout.size) + b"WAVE" + body
    else:
        frames = layout.size // layout.frame_bytes
        body = form + _CHUNK.pack(b"data", 0xFFFFFFFF)
        sizes = struct.pack("<QQQI", 40 + len(body) + layout.size, layout.size, frames, 0)
        header = b"RF64" + struct.pack("<I", 0xFFFFFFFF) + b"WAVE" + _CHUNK.pack(b"ds64", len(sizes)) + sizes + body
    return _Joined(header, path, layout)


class _Joined(io.RawIOBase):
    """Bytes, and after them a part of a file."""

    def __init__(self, header: bytes, path: Path, layout: Layout) -> None:
        self._header, self._start, self._at = header, layout.start, 0
        self._length = len(header) + layout.size
        self._file = path.open("rb")

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        origin = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._length}[whence]
        self._at = max(0, origin + offset)
        return self._at

    def readinto(self, buffer) -> int:  # type: ignore[no-untyped-def]
        size = max(0, min(len(buffer), self._length - self._at))
        data = self._header[self._at : self._at + size]
        if len(data) < size:
            self._file.seek(self._start + self._at + len(data) - len(self._header))
            data += self._file.read(size - len(data))
        buffer[: len(data)] = data
        self._at += len(data)
        return len(data)

    def close(self) -> None:
        self._file.close()
        super().close()
