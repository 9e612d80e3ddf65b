"""Reading and writing files safely: one-line errors and atomic writes."""

import errno
import hashlib
import json
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError, OutputError
from a2g_jax.io.other_formats import never_right
from a2g_jax.io.temporary import temporary_path

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS}
#: The same in messages of libraries that raise errors of their own.
_FULL_TEXTS = ("No space left on device", "Disk quota exceeded", "File too large", "Read-only file system")


def check_readable(path: str | os.PathLike[str], kind: str) -> Path:
    """The path, checked to be a readable, ordinary, non-empty file.

    Args:
        kind: what the file should be, with its article, for the messages: ``"a BVH file"``.

    Raises:
        InputError: no such file, no permission to read it, a folder or a device, an empty file, a web page, a
            pointer of Git LFS, or a packed file.
    """
    path = Path(path)
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise InputError(f"{path}: is a folder; name {kind} in it.")
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{path}: is not an ordinary file; save {kind} to disk first.")
        with path.open("rb") as file:
            head = file.read(64)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file; check the path.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path and its permissions.") from None
    except ValueError as error:  # a null character in the path
        if isinstance(error, InputError):
            raise
        raise InputError(f"{str(path)!r}: is not a usable path; check its characters.") from None
    if status.st_size == 0:
        raise InputError(f"{path}: is empty (0 bytes); expected {kind}.")
    reason = "" if "HTML" in kind else never_right(head)
    if reason:
        raise InputError(f"{path}: {reason}")
    return path


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a file completely or not at all.

    Yields a temporary path in the same folder with the same suffix. When the block succeeds, that file replaces
    ``path``; when it raises, it is removed and ``path`` stays unchanged. Missing folders are created. Temporary files
    that killed processes left in the folder are removed.

    Raises:
        OutputError: the folder cannot be created or written to, or the disk is full.
        InputError: ``path`` is a folder or a device.
    """
    path = Path(path)
    # Links are followed: the file is replaced, not the link.
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise InputError(f"{path}: is a folder; name a file in it.")
    # Renaming over a device such as /dev/null would replace the device.
    if target.exists() and not target.is_file():
        raise InputError(f"{path}: is not an ordinary file; write to another path.")
    temporary = temporary_path(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield temporary
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        if error.filename not in (None, str(temporary), str(target), str(target.parent)):
            raise
        raise unwritable(path, error) from error


def unwritable(path: str | os.PathLike[str], error: BaseException, remedy: str = "") -> OutputError:
    """The error for a file or folder that cannot be written.

    Args:
        error: an ``OSError``, or one that was raised because of it.
        remedy: in place of the usual one.
    """
    remedy = remedy or "check the folder, its permissions and free space"
    cause: BaseException | None = error
    while cause is not None and not (isinstance(cause, OSError) and cause.strerror):
        cause = cause.__cause__ or cause.__context__
    found = [text for text in _FULL_TEXTS if text in str(error)]
    reason = cause.strerror if isinstance(cause, OSError) else (found or str(error).splitlines() or [""])[0][:200]
    return OutputError(f"{path}: cannot be written ({reason}); {remedy}.")


def disk_full(error: BaseException | None) -> bool:
    """Whether an error or one of its causes says that nothing can be written: a full or read-only disk, a quota."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in _FULL:
            return True
        if any(text in str(error) for text in _FULL_TEXTS):
            return True
        error = error.__cause__ or error.__context__
    return False


def check_folder_writable(path: str | os.PathLike[str]) -> None:
    """Check that a folder can be written to, or created, by creating a file there and removing it.

    Raises:
        InputError: it or one of its parents is a file.
        OutputError: nothing can be written there.
    """
    path = Path(path)
    if "\0" in str(path):
        raise InputError(f"{str(path)!r}: is not a usable path; check its characters.")
    try:
        whole = place = Path(os.path.abspath(path))  # noqa: PTH100 - links stay
        while not os.path.lexists(place) and place != place.parent:
            place = place.parent
        if not place.is_dir():
            raise InputError(f"{path}: {'is' if place == whole else f'{place} is'} a file; name a folder.")
        probe = temporary_path(place / "probe")
        try:
            probe.write_bytes(b"a")
        finally:
            probe.unlink(missing_ok=True)
    except OSError as error:
        raise unwritable(path, error) from None


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Create a folder and its parents unless they exist.

    Raises:
        InputError: the path is a file, or the folder cannot be created or written to.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(f"{path}: is a file; name a folder.") from None
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path}: cannot be made ({getattr(error, 'strerror', error)}); name another folder."
        ) from None
    if not os.access(path, os.W_OK):
        raise InputError(f"{path}: may not be written to; name another folder or change its permissions.")
    return path


def sha256_file(path: str | os.PathLike[str]) -> str:
    """SHA-256 of a file's bytes, as 64 hexadecimal digits."""
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path.") from None


def json_text(value: Any) -> str:
    """``value`` as indented JSON with a line feed at its end: see :func:`write_json`."""
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False, default=_plain) + "\n"


def write_json(path: str | os.PathLike[str], value: Any) -> None:
    """Write ``value`` as indented UTF-8 JSON, atomically.

    NumPy scalars, arrays and paths become numbers, lists and text; NaN and infinities, which JSON lacks, raise
    ``ValueError``.
    """
    text = json_text(value)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):  # arrays and scalars, without importing NumPy for them
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"Expected a value that JSON can represent; got {type(value).__name__}.")


def read_json(path: str | os.PathLike[str]) -> Any:
    """Read a JSON file.

    Raises:
        InputError: no such file, not UTF-8, or not JSON (with the line and column), as with NaN and infinities.
    """
    path = check_readable(path, "a JSON file")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read as JSON ({error}).") from None
    return parse_json(data, path)


def parse_json(data: bytes, path: str | os.PathLike[str]) -> Any:
    """The value of the bytes of a JSON file; errors name ``path``.

    Raises:
        InputError: as :func:`read_json`.
    """

    def refuse(name: str) -> None:
        raise InputError(f"{path}: contains {name}, which is not JSON; replace it by null or a number.")

    try:
        return json.loads(data.decode("utf-8-sig"), parse_constant=refuse)
    except InputError:
        raise
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start}); expected a JSON file.") from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"{path}, line {error.lineno}, column {error.colno}: is not JSON ({error.msg}); correct it there."
        ) from None
    except RecursionError:
        raise InputError(f"{path}: is nested too deeply; expected a flatter JSON file.") from None
    except ValueError as error:  # such as an integer of thousands of digits
        raise InputError(f"{path}: cannot be read as JSON ({error}).") from None
