"""Files that a page sent: kept under names of the server's own, limited, and read by the package's readers at once.

A client's file name is only ever text. The suffix decides which reader looks at a file, and comes from a fixed list.
"""

import secrets
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from a2g_jax.errors import InputError, brief

#: Files that are kept at most, and their bytes together; the oldest make room.
MOST_FILES, MOST_BYTES = 64, 2_000_000_000
#: Beginning of the server's own names.
PREFIX = "upload-"
_LONGEST_NAME = 120


@dataclass(frozen=True)
class Kind:
    """What a file can be uploaded as."""

    what: str
    """Noun for messages, such as ``speech``."""
    suffixes: tuple[str, ...]
    most_bytes: int
    read: Callable[[Path], dict[str, Any]]
    """What the page shows of a file; raises an ``InputError`` for one that cannot be used."""


@dataclass(frozen=True)
class Upload:
    """A file that can be used in requests."""

    id: str
    kind: str
    name: str
    """The client's, shortened; for people alone."""
    path: Path
    about: Mapping[str, Any] = field(default_factory=dict)
    size: int = 0
    """Bytes."""
    keep: bool = False
    """Whether it comes with the package, and never makes room."""

    def to_json(self) -> dict[str, Any]:
        """The file as JSON values."""
        return {"id": self.id, "kind": self.kind, "name": self.name, **self.about}


class Uploads:
    """The files of a studio."""

    def __init__(
        self,
        folder: Path,
        kinds: Mapping[str, Kind],
        *,
        files: int = MOST_FILES,
        most_bytes: int = MOST_BYTES,
        in_use: Callable[[], Iterable[Path]] = tuple,
    ) -> None:
        """
        Args:
            folder: for the files; it is empty.
            kinds: by name.
            in_use: the files that make no room.
        """
        self.folder, self.kinds = folder, kinds
        self._files, self._bytes, self._in_use = files, most_bytes, in_use
        self._kept: dict[str, Upload] = {}
        self._arriving: dict[str, int] = {}
        """Bytes of files that arrive, by their identifiers."""
        self._lock = threading.Lock()

    def add(self, upload: Upload) -> None:
        """Keep a file that lies elsewhere."""
        with self._lock:
            self._kept[upload.id] = upload

    def find(self, id: object, kind: str) -> Upload:
        """The file of an identifier.

        Raises:
            InputError: there is none of that kind, or no longer.
        """
        found = self._kept.get(id) if isinstance(id, str) else None
        if found is None or found.kind != kind:
            raise InputError(f"this {self.kinds[kind].what} is no longer kept; choose the file again.")
        return found

    def incoming(self, kind: str, name: str) -> "Incoming":
        """A file that arrives.

        Raises:
            InputError: no such kind of upload, or a suffix that its reader does not take.
        """
        if kind not in self.kinds:
            raise InputError(f"no uploads of the kind {brief(kind)!r}.")
        return Incoming(self, kind, display_name(name))

    def all(self) -> list[Upload]:
        """All files, the oldest first."""
        return list(self._kept.values())

    def arrive(self, id: str, size: int) -> None:
        """Count a file that arrives, with its bytes so far; the oldest files over the limits, of those that are not in
        use, are removed.

        Raises:
            InputError: files that arrive and those in use are more than is kept; none is removed.
        """
        in_use = set(self._in_use())
        with self._lock:
            self._arriving[id] = size
            own = [upload for upload in self._kept.values() if not upload.keep]
            count = len(own) + len(self._arriving)
            total = sum(upload.size for upload in own) + sum(self._arriving.values())
            removed = []
            for upload in own:
                if count <= self._files and total <= self._bytes:
                    break
                if upload.path not in in_use:
                    count, total = count - 1, total - upload.size
                    removed.append(upload)
            if count > self._files or total > self._bytes:
                raise InputError("too many files arrive at the same time; wait for the others, and send it again.")
            for upload in removed:
                del self._kept[upload.id]
                upload.path.unlink(missing_ok=True)

    def arrived(self, id: str) -> None:
        """Count a file as arriving no longer."""
        with self._lock:
            self._arriving.pop(id, None)


class Incoming:
    """A file while it arrives; a context manager that leaves nothing behind unless :meth:`finish` accepts it."""

    def __init__(self, uploads: Uploads, kind: str, name: str) -> None:
        self._uploads, self._kind, self._name = uploads, kind, name
        suffix = Path(name).suffix.lower()
        rule = uploads.kinds[kind]
        if suffix not in rule.suffixes:
            usual = ", ".join(one.removeprefix(".").upper() for one in rule.suffixes[:6])
            more = " and more" if len(rule.suffixes) > 6 else ""
            raise InputError(f"{name}: is not a file for {rule.what}; choose {usual}{more}.")
        self._suffix, self._most = suffix, rule.most_bytes
        self._bytes = 0
        self._done = False

    def __enter__(self) -> "Incoming":
        self._id = secrets.token_hex(8)
        self.path = self._uploads.folder / f"{PREFIX}{self._id}{self._suffix}"
        try:
            self._uploads.arrive(self._id, 0)
            self._file: IO[bytes] = self.path.open("xb")
        except BaseException:
            self._uploads.arrived(self._id)
            raise
        return self

    def write(self, data: bytes) -> None:
        """Append bytes.

        Raises:
            InputError: the file has more than it may, or too many arrive at the same time.
        """
        self._bytes += len(data)
        if self._bytes > self._most:
            megabytes = self._most // 1_000_000
            raise InputError(f"{self._name}: is larger than {megabytes} MB, the most that is taken; cut it first.")
        self._uploads.arrive(self._id, self._bytes)
        self._file.write(data)

    def finish(self) -> Upload:
        """Read the file and keep it.

        Raises:
            InputError: a file that cannot be used, with its client's name.
        """
        self._file.close()
        if self._bytes == 0:
            raise InputError(f"{self._name}: is empty; choose another file.")
        try:
            about = self._uploads.kinds[self._kind].read(self.path)
        except InputError as error:
            raise InputError(self._plain(str(error))) from None
        about = {key: self._plain(value) for key, value in about.items()}
        upload = Upload(self._id, self._kind, self._name, self.path, about, self._bytes)
        self._uploads.arrived(self._id)
        self._uploads.add(upload)
        self._done = True
        return upload

    def __exit__(self, *error: object) -> None:
        self._file.close()
        self._uploads.arrived(self._id)
        if not self._done:
            self.path.unlink(missing_ok=True)

    def _plain(self, value: Any) -> Any:
        """Text with the client's name in place of the server's."""
        if isinstance(value, str):
            return " ".join(with_client_name(value, self.path, self._name).split())
        return [self._plain(one) for one in value] if isinstance(value, list) else value


def with_client_name(text: str, path: Path, name: str) -> str:
    """A text with the client's name of a file in place of the server's, also in names derived from it."""
    text = text.replace(str(path), name).replace(path.name, name)
    if path.stem.startswith(PREFIX):
        text = text.replace(str(path.parent / path.stem), Path(name).stem).replace(path.stem, Path(name).stem)
    return text


def display_name(name: str) -> str:
    """A client's file name as text: without folders and control characters, and short."""
    last = name.replace("\\", "/").rpartition("/")[2]
    clean = "".join(character for character in last if character.isprintable()).strip() or "file"
    stem, dot, suffix = clean.rpartition(".")
    return clean if len(clean) <= _LONGEST_NAME else f"{stem[: _LONGEST_NAME - len(suffix) - 2]}…{dot}{suffix[-20:]}"
