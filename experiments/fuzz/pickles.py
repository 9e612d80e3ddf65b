"""``python -m experiments.fuzz.pickles``: pickle streams that are made to cost time or memory, and what they cost."""

import json
import pickle
import struct
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from experiments.fuzz.child import Outcome, read_apart
from experiments.fuzz.readers import read_pickle_file

RESULTS = Path(__file__).parent / "results"
#: Every stream has to end within this time, processor seconds.
SECONDS = 2.0
_MANY = 4_000_000


def _laughs(levels: int, width: int) -> bytes:
    """Lists of references to the list below: ``width ** levels`` elements."""
    data = b"\x80\x02]q\x000"
    for level in range(levels):
        below = b"h" + bytes([level])
        data += b"](" + below * width + b"eq" + bytes([level + 1]) + b"0"
    return data + b"h" + bytes([levels]) + b"."


def _colliding(count: int) -> bytes:
    """Keys of a dictionary with equal hashes."""
    keys = b"".join(b"\x8a\x0a" + (k * (2**61 - 1)).to_bytes(10, "little") + b"N" for k in range(1, count))
    return b"\x80\x02}(" + keys + b"u."


def _reduce(module: str, name: str, arguments: bytes, times: int) -> bytes:
    return b"\x80\x02" + f"c{module}\n{name}\n".encode() + arguments + b"R0" * times + b"N."


def _array(shape: tuple[int, ...], dtype: bytes, data: bytes) -> bytes:
    sizes = b"(" + b"".join(b"J" + struct.pack("<i", size) for size in shape) + b"t"
    rebuilt = b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(K\0tU\x01btR"
    kind = b"cnumpy\ndtype\n(" + b"U" + bytes([len(dtype)]) + dtype + b"K\0K\x01tR"
    content = b"T" + struct.pack("<i", len(data)) + data
    return b"\x80\x02" + rebuilt + b"(K\x01" + sizes + kind + b"\x89" + content + b"tb."


STREAMS: dict[str, Callable[[], bytes]] = {
    "marks": lambda: b"\x80\x02" + b"(" * _MANY + b".",
    "empty lists": lambda: b"\x80\x02" + b"]" * _MANY + b".",
    "None, popped": lambda: b"\x80\x02" + b"N0" * _MANY + b"N.",
    "duplicates": lambda: b"\x80\x02]" + b"2" * _MANY + b".",
    "nested lists": lambda: b"\x80\x02" + b"]" * 100_000 + b"a" * 99_999 + b".",
    "nested tuples": lambda: b"\x80\x02N" + b"\x85" * _MANY + b".",
    "nested dictionaries": lambda: b"\x80\x02" + b"}K\0" * 100_000 + b"N" + b"s" * 100_000 + b".",
    "references to references": lambda: _laughs(30, 100),
    "references, twice": lambda: _laughs(200, 2),
    "a list in itself": lambda: b"\x80\x02]q\0" + b"h\0a" * 1_000_000 + b".",
    "one memo, many times": lambda: b"\x80\x02]" + b"q\0" * _MANY + b".",
    "memos with large numbers": lambda: (
        b"\x80\x02]" + b"".join(b"r" + struct.pack("<I", 2**32 - 1 - k) for k in range(500_000)) + b"."
    ),
    "references, appended": lambda: b"\x80\x02](K\1q\0" + b"h\0" * _MANY + b"e.",
    "a long tuple, many times": lambda: b"\x80\x02(" + b"N" * 1_000_000 + b"tq\0" + b"0h\0" * 1_000_000 + b".",
    "a long tuple, in tuples": lambda: b"\x80\x02(" + b"N" * 1_000_000 + b"tq\0" + b"h\0\x86" * 100_000 + b".",
    "keys with equal hashes": lambda: _colliding(60_000),
    "a tuple as key, many times": lambda: (
        b"\x80\x02}(" + b"N" * 100_000 + b"tq\0NsK\1" + b"h\0" * 1 + b"0" + b"(h\0N" + b"h\0N" * 200_000 + b"u."
    ),
    "deep tuples as keys": lambda: b"\x80\x02}q\0(N" + b"\x85" * 45 + b"q\1" + b"N" + b"h\1N" * 500_000 + b"u.",
    "a number of 4 million digits": lambda: b"I" + b"9" * _MANY + b"\n.",
    "a long number of 4 million digits": lambda: b"L" + b"9" * _MANY + b"L\n.",
    "a long number of 4 MB": lambda: b"\x80\x02\x8b" + struct.pack("<i", _MANY) + b"\x7f" * _MANY + b".",
    "long numbers": lambda: b"\x80\x02](" + (b"\x8a\xff" + b"\x7f" * 255) * 30_000 + b"e.",
    "a size of 2 GB": lambda: b"\x80\x02T" + struct.pack("<i", 2**31 - 1) + b"a.",
    "a size of 2^63": lambda: b"\x80\x04\x8e" + struct.pack("<Q", 2**63 - 1) + b"a.",
    "a frame of 2^63": lambda: b"\x80\x04\x95" + struct.pack("<Q", 2**63 - 1) + b"N.",
    "escapes": lambda: b"V" + b"\\u0041" * 700_000 + b"\n.",
    "quotes": lambda: b"S'" + b"\\x41" * 1_000_000 + b"'\n.",
    "names": lambda: b"\x80\x02" + b"cos\nsystem\n0" * 300_000 + b"N.",
    "calls of what is refused": lambda: _reduce("os", "system", b"(t", 1) + b"",
    "calls": lambda: b"\x80\x02" + b"ccollections\nOrderedDict\n)R0" * 200_000 + b"N.",
    "states": lambda: b"\x80\x02ccollections\nOrderedDict\n)R" + b"}b" * 1_000_000 + b".",
    "an array of 2^31 numbers": lambda: _array((2**31 - 1,), b"f8", b""),
    "an array of 2^62 numbers": lambda: _array((2**31 - 1, 2**31 - 1), b"f8", b""),
    "arrays without elements": lambda: (
        b"\x80\x02" + b"".join(_array((0,), b"f8", b"")[2:-1] + b"0" for _ in range(20_000)) + b"N."
    ),
    "an array of objects": lambda: pickle.dumps(np.array([None] * 1_000_000, object), 2),
    "persistent names": lambda: b"Pname\n0" * 500_000 + b"N.",
    "extensions": lambda: b"\x80\x02" + b"\x82\x01" * 1_000_000 + b".",
}


def main() -> int:
    """Read all streams; the status is 1 if one takes too long, too much memory, or crashes."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.pkl"
        path.write_bytes(pickle.dumps({"a": np.arange(3)}, 2))
        read_pickle_file(path)
        for name, make in STREAMS.items():
            path.write_bytes(make())
            found: Outcome = min((read_apart(read_pickle_file, path) for _ in range(2)), key=lambda one: one.seconds)
            row = {"stream": name, "bytes": path.stat().st_size, "outcome": found.kind, "s": round(found.seconds, 2)}
            rows.append({**row, "MB": round(found.megabytes), "message": found.message.replace(folder, "")[:200]})
            print(json.dumps(rows[-1]), flush=True)
    lines = ["| stream | bytes | outcome | processor s | MB |", "| --- | --- | --- | --- | --- |"]
    lines += [f"| {row['stream']} | {row['bytes']} | {row['outcome']} | {row['s']:.2f} | {row['MB']} |" for row in rows]
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "pickles.md").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return int(any(row["s"] > SECONDS or row["outcome"] not in ("read", "refused") for row in rows))


if __name__ == "__main__":
    sys.exit(main())
