"""Damaged bytes, and the files of a folder."""

from pathlib import Path

import a2g_jax

PACKAGE = Path(a2g_jax.__file__).parent


def changes(data: bytes, rng, count: int) -> list[bytes]:
    """The bytes with single bits changed, blocks of zeros, and cuts."""
    if not data:
        return [b"x"]
    places = [0, len(data) - 1, *rng.integers(0, len(data), count).tolist()]
    flipped = [data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :] for at in places]
    at = len(data) // 2
    zeroed = data[:at] + bytes(min(4096, len(data) - at)) + data[at + 4096 :]
    return [*flipped, zeroed, data[:-1], data[: len(data) // 3], b"", data + b"\n"]


def names(folder):
    return sorted(path.name for path in folder.iterdir())
