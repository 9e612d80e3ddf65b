"""Changes to the bytes, the text or the parts of a file."""

import io
import json
import re
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

#: Little- and big-endian sizes that lie.
_INTEGERS = [
    b"\0", b"\xff", b"\x80", b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\x7f\xff\xff\xff", b"\0\0\0\x80", b"\0\0\0\0",
    b"\0\0\0\x40", b"\xff" * 8, b"\xff" * 7 + b"\x7f", b"\0\0\0\0\1\0\0\0", b"\0\0\0\0\0\0\0\x40", b"\0" * 8,
    b"\0\0\xc0\x7f", b"\0\0\x80\xff", b"\0\0\0\0\0\0\xf8\x7f", b"\xff\xff\x7f\x7f",
]  # fmt: skip
_NUMBERS = [
    "nan", "inf", "-inf", "1e999", "1e308", "-1e308", "1e38", "1e-320", "0", "-0", "-1", "1", "2", "7", "65535",
    "2147483648", "99999999", "999999999999", "99999999999999999999", "0x10", "1,5", "1e", "--1", "9" * 400, "", "٣",
    "1_000", "1.#QNAN",
]  # fmt: skip
#: Largest changed file; larger ones need more memory because they are large.
_LARGEST = 16 * 2**20
_TEXTS = [
    "\n",
    "\r",
    "\t",
    "\0",
    " ",
    "{",
    "}",
    '"',
    "'",
    "\\",
    "<",
    "é",
    "\ud7ff",
    "\U0001f600",
    "\x1b[31m",
    "\u202e",
    ",",
]
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
_WORD = re.compile(rb"[^\s]+")
_VALUES: list[Any] = [
    None, True, False, 0, -1, 1, 2**31, 2**63, 10**30, 1e308, -1e308, 5e-324, 0.5, "", "a", "nan", "a" * 100_000, [],
    {}, [[]], [[[[[[1]]]]]], [0] * 10_000, {"a": {"a": {"a": {}}}}, "\0", "../../etc/passwd", "é\n", [None], [-1],
]  # fmt: skip


def change_bytes(data: bytes, rng: np.random.Generator, others: list[bytes]) -> bytes:
    """One to four changes at random places, a third of them near the beginning, where headers are."""
    for _ in range(int(rng.integers(1, 5))):
        data = _change(data, rng, others)[:_LARGEST]
    return data


def _change(data: bytes, rng: np.random.Generator, others: list[bytes]) -> bytes:
    top = len(data) if rng.random() < 0.67 else min(len(data), 256)
    at = int(rng.integers(0, max(top, 1)))
    length = int(rng.integers(1, 9)) if rng.random() < 0.5 else int(rng.integers(1, max(len(data), 2)))
    match str(rng.choice(["bit", "bit", "integer", "integer", "cut", "hole", "repeat", "many", "splice", "zeros"])):
        case "bit":
            return data[:at] + bytes([data[at] ^ 1 << int(rng.integers(8))]) + data[at + 1 :] if data else data
        case "integer":
            new = _INTEGERS[int(rng.integers(len(_INTEGERS)))]
            at = at - at % 4 if rng.random() < 0.5 else at
            return data[:at] + new + data[at + len(new) :]
        case "cut":
            return data[:at]
        case "hole":
            return data[:at] + data[at + length :]
        case "repeat":
            return data[: at + length] + data[at:]
        case "many":
            piece = data[at : at + min(length, 4000)]
            return data[:at] + piece * int(rng.integers(2, 2 + 4_000_000 // max(len(piece), 400))) + data[at:]
        case "splice":
            other = others[int(rng.integers(len(others)))]
            start = int(rng.integers(0, max(len(other), 1)))
            return data[:at] + other[start : start + length] + data[at:]
    return data[:at] + bytes(len(data[at : at + length])) + data[at + length :]


def change_text(data: bytes, rng: np.random.Generator, others: list[bytes]) -> bytes:
    """Changed numbers, words, lines and encodings; a third of the files are changed as bytes."""
    if rng.random() < 0.33:
        return change_bytes(data, rng, others)
    for _ in range(int(rng.integers(1, 4))):
        data = _change_text(data, rng)[:_LARGEST]
    return data


def _change_text(data: bytes, rng: np.random.Generator) -> bytes:
    kind = str(rng.choice(["number", "number", "number", "word", "text", "line", "lines", "nest", "encode", "end"]))
    if kind in ("number", "word", "text"):
        near = data[:3000] if rng.random() < 0.5 else data
        found = list((_NUMBER if kind == "number" else _WORD).finditer(near))
        if not found:
            return data
        one = found[int(rng.integers(len(found)))]
        if kind == "number":
            new = _NUMBERS[int(rng.integers(len(_NUMBERS)))].encode()
        elif kind == "word":
            new = found[int(rng.integers(len(found)))][0]
        else:
            new = one[0] + _TEXTS[int(rng.integers(len(_TEXTS)))].encode()
        return data[: one.start()] + new + data[one.end() :]
    lines = data.split(b"\n")
    at, other = (int(rng.integers(len(lines))) for _ in range(2))
    if kind == "line":
        lines[at], lines[other] = lines[other], lines[at]
        return b"\n".join(lines if rng.random() < 0.5 else lines[:at] + lines[at + 1 :])
    if kind == "lines":
        return b"\n".join(lines[:at] + [lines[at]] * int(rng.integers(2, 30_000)) + lines[at:])
    if kind == "nest":
        piece = rng.choice([b"{", b"[", b'{"a":', b"JOINT a {OFFSET 0 0 0 CHANNELS 0 ", b"(", b"<a>"])
        return b"\n".join([*lines[:at], bytes(piece) * int(rng.integers(1, 100_000)), *lines[at:]])
    if kind == "encode":
        text = data.decode("utf-8", "replace")
        name = str(rng.choice(["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig", "shift-jis", "cp1252"]))
        return text.encode(name, "replace")
    return data.replace(b"\n", b"\r" if rng.random() < 0.5 else b"\r\n")


def change_json(data: bytes, rng: np.random.Generator, others: list[bytes]) -> bytes:
    """Values of an object replaced, removed or exchanged, with a checksum that accepts the edit; or changed text."""
    if rng.random() < 0.25:
        return change_text(data, rng, others)
    value = json.loads(data)
    for _ in range(int(rng.integers(1, 3))):
        _change_value(value, rng)
    if "checksum" in value:
        value["checksum"] = None
    return json.dumps(value).encode()


def _change_value(value: Any, rng: np.random.Generator) -> None:
    while True:
        keys = list(value) if isinstance(value, dict) else list(range(len(value)))
        if not keys:
            return
        key = keys[int(rng.integers(len(keys)))]
        if isinstance(value[key], dict | list) and value[key] and rng.random() < 0.8:
            value = value[key]
            continue
        if rng.random() < 0.15:
            del value[key]
        elif rng.random() < 0.2:
            value[key] = value[keys[int(rng.integers(len(keys)))]]
        else:
            value[key] = _VALUES[int(rng.integers(len(_VALUES)))]
        return


def change_zip(data: bytes, rng: np.random.Generator, others: list[bytes]) -> bytes:
    """A changed member of an archive, with right sizes and checksums around it; or changed bytes."""
    if rng.random() < 0.4:
        return change_bytes(data, rng, others)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as changed:
        names = archive.namelist()
        victim = names[int(rng.integers(len(names)))]
        for name in names:
            member = archive.read(name)
            if name == victim:
                change = _change_header if rng.random() < 0.5 else _change
                member = change(member, rng, [member])
            changed.writestr(name, member)
    return out.getvalue()


def _change_header(data: bytes, rng: np.random.Generator, _others: list[bytes]) -> bytes:
    head, rest = data[:128], data[128:]
    return change_text(head, rng, [head]).ljust(128)[:128] + rest


Change = Callable[[bytes, np.random.Generator, list[bytes]], bytes]
