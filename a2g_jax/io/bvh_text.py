"""The text of BVH files in the encodings that programs save them in."""

import codecs
import re
from pathlib import Path

from a2g_jax.errors import InputError
from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.io.files import check_readable
from a2g_jax.io.other_formats import never_text

#: Longest first: the mark of UTF-32 in little-endian order begins with that of UTF-16.
_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
#: Encodings of systems before Unicode: Western (of equally good ones the first is taken), Japanese, Chinese, Korean.
_LEGACY = ("cp1252", "cp932", "euc_jp", "gb18030", "big5", "cp949")
_NAME = re.compile(r"(?:ROOT|JOINT)[ \t]+([^\n{]+)", re.IGNORECASE)
#: Largest file, bytes: two hours of 60 joints at 120 fps. Reading takes about ten times as much memory.
_LARGEST = 2**30
#: Zeros at the end of a text that show that it was not written completely.
_UNWRITTEN = 16
#: Bytes whose zeros tell text in UTF-16 from binary data.
_PROBE = 4096


def read_text(path: Path) -> str:
    r"""The text of a BVH file with ``\n`` between lines.

    UTF-8, UTF-16 and UTF-32 are recognised with and without a byte order mark. Of other encodings the one is taken in
    which most joint names are parts of a body; numbers are the same in all.

    Raises:
        InputError: no such file, or one that is not text.
    """
    path = check_readable(path, "a BVH file")
    size = path.stat().st_size
    if size > _LARGEST:
        raise InputError(f"{path}: has {size} bytes, and the limit is {_LARGEST}; split the take.")
    try:
        return _decoded(path, path.read_bytes()).replace("\r\n", "\n").replace("\r", "\n")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the disk.") from None
    except MemoryError:
        raise InputError(f"{path}: has {size} bytes, too many for the memory that is free; split the take.") from None


def _decoded(path: Path, data: bytes) -> str:
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), None) or _unmarked(data)
    if encoding is None:
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            text = _legacy(data)
    else:
        # A file cut inside of a character is reported as one that is cut short.
        text = data.decode(encoding, "replace")
    if "\0" in text[:65536]:
        zeros = len(data) - len(data.rstrip(b"\0"))
        if zeros >= _UNWRITTEN and b"\0" not in data[:-zeros]:
            raise InputError(f"{path}: its last {zeros} bytes are zeros: it was not written completely; copy it again.")
        reason = never_text(data) or "is binary, not text; expected a BVH file."
        raise InputError(f"{path}: {reason}")
    return text


def _unmarked(data: bytes) -> str | None:
    """UTF-16 or UTF-32 without a mark, by the zeros that its ASCII characters have; None for other text."""
    probe = data[:_PROBE]
    if b"\0" not in probe or len(probe) < 8:
        return None
    zeros = [probe[at::4].count(0) / len(probe[at::4]) for at in range(4)]
    for encoding, empty in (
        ("utf-32-le", (1, 2, 3)), ("utf-32-be", (0, 1, 2)), ("utf-16-le", (1, 3)), ("utf-16-be", (0, 2)),
    ):  # fmt: skip
        # Names in other scripts have few zeros; the keywords and numbers have them.
        if all(zeros[at] > 0.5 if at in empty else zeros[at] < 0.02 for at in range(4)):
            return encoding
    return None


def _legacy(data: bytes) -> str:
    """Text in the encoding that makes sense of most joint names; Latin-1, which any bytes are, if none does."""
    end = data.find(b"MOTION")
    head = data if end < 0 else data[:end]
    best, most = "latin-1", 0
    for encoding in _LEGACY:
        try:
            names = _NAME.findall(head.decode(encoding))
        except UnicodeDecodeError:
            continue
        named = len(named_joints([name.strip() for name in names]))
        if named > most:
            best, most = encoding, named
    return data.decode(best, "replace")
