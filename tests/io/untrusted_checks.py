"""What the tests of hostile input share: payloads by real writers, and a look at what a decoder did."""

import codecs
import sys
import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted.refused import Refused

NAME = "payload"
_WATCHED = ("exec", "compile", "open", "os.", "subprocess.", "socket.", "ctypes.", "pickle.", "shutil.", "marshal.")
_seen: list[str] | None = None


def _listen(event: str, arguments: tuple) -> None:
    harmless = event == "import" and arguments and str(arguments[0]).startswith("encodings")
    if _seen is not None and (event.startswith(_WATCHED) or (event == "import" and not harmless)):
        _seen.append(f"{event} {arguments!r:.200}")


# Python loads these when they are first used, which is no deed of the data.
for _codec in ("ascii", "latin-1", "raw-unicode-escape", "utf-8"):
    codecs.lookup(_codec)
sys.addaudithook(_listen)


def watched(decode: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a decoder that must not open, import, compile or run anything meanwhile."""
    global _seen
    _seen = []
    try:
        return decode(*arguments)
    finally:
        events, _seen = _seen, None
        assert events == [], events


def attempt(decode: Callable[..., Any], data: bytes) -> Any:
    """The value, or the text of the ``InputError``, which must be one line that names the data."""
    try:
        value = watched(decode, data, NAME)
    except InputError as error:
        message = str(error)
        assert message.startswith(NAME)
        assert "\n" not in message
        assert len(message) < 400
        return error
    assert_plain(value)
    return value


def check_message(error: InputError, path: Path) -> None:
    """A message is one line that begins with the file."""
    message = str(error)
    assert message.startswith(str(path))
    assert "\n" not in message
    assert len(message) < 400 + len(str(path))


class Calls:
    """Pickles as a call of any function with any arguments."""

    def __init__(self, function: Callable, *arguments: Any) -> None:
        self.function, self.arguments = function, arguments

    def __reduce__(self) -> tuple:
        return self.function, self.arguments


def assert_plain(value: Any, depth: int = 0) -> None:
    assert depth <= 60
    kind = type(value)
    if kind in (list, tuple, set, frozenset):
        for part in value:
            assert_plain(part, depth + 1)
    elif kind is dict:
        assert_plain(list(value.items()), depth)
    elif kind is np.ndarray and value.dtype.hasobject:
        assert_plain(value.ravel().tolist(), depth + 1)
    else:
        plain = (type(None), bool, int, float, complex, str, bytes, bytearray, np.ndarray)
        assert kind in plain or isinstance(value, np.generic | np.dtype | Refused), kind


def same(first: Any, second: Any) -> bool:
    """Whether two plain values are of the same types and contents; NaN equals NaN."""
    if type(first) is not type(second):
        return False
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, dict):
        return same(list(first.items()), list(second.items()))
    if isinstance(first, np.ndarray | np.generic):
        return (
            first.dtype == second.dtype
            and first.shape == second.shape
            and same(first.ravel().tolist(), second.ravel().tolist())
        )
    return first == second or (first != first and second != second)


def payloads(folder: str) -> dict[str, bytes]:
    """Name and bytes of each payload that a real writer made."""
    found = {}
    with tarfile.open(Path(__file__).with_name("untrusted_payloads.tar.xz")) as archive:
        for member in archive:
            if member.name.startswith(f"{folder}/"):
                file = archive.extractfile(member)
                assert file is not None
                found[member.name.removeprefix(f"{folder}/")] = file.read()
    assert found
    return found
