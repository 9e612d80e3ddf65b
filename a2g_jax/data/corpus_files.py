"""The small files of a corpus, compared with their hashes in the manifest when they are read."""

import hashlib
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.data.corpus_layout import ARRAYS, MANIFEST, Entry
from a2g_jax.data.splits import Splits
from a2g_jax.errors import InputError
from a2g_jax.features.statistics import RunningStatistics, Statistics
from a2g_jax.io.files import check_readable, parse_json
from a2g_jax.io.untrusted import Limits
from a2g_jax.io.untrusted.numpy_files import read_npz_file

#: Lower bounds on standard deviations, which are used as divisors.
_FLOORS = {"audio": 1.0, "pose": 0.01, "root": 0.01}
#: Rows read at once for the statistics.
_ROWS = 65536


def read_json_file(path: Path, expected: str | None) -> Any:
    """The value of a JSON file.

    Args:
        expected: its SHA-256; not compared if None.

    Raises:
        InputError: it cannot be read, is no JSON, or differs from its hash.
    """
    return parse_json(_bytes(path, expected), path)


def read_statistics(path: Path, expected: str | None) -> dict[str, Statistics]:
    """``audio`` (width,), ``pose`` (R, D) and ``root`` (3,).

    Arguments and errors of :func:`read_json_file`.
    """
    names = ("audio", "pose", "root")
    try:
        data = _bytes(path, expected)
        keys = [f"{name}_{part}" for name in names for part in ("mean", "std")]
        arrays = read_npz_file(io.BytesIO(data), str(path), keys, limits=Limits(size=2**26))
    except InputError as error:
        if str(error) == differs(path):
            raise
        reason = str(error).removeprefix(f"{path}").lstrip(":, ").rstrip(".")
        raise InputError(f"{path}: cannot be read ({reason}); prepare the corpus anew.") from None
    return {name: Statistics(arrays[f"{name}_mean"], arrays[f"{name}_std"]) for name in names}


def write_statistics(folder: Path, entries: Sequence[Entry], splits: Splits) -> None:
    """Write means and standard deviations of a corpus's arrays over its training split only."""
    values: dict[str, Any] = {}
    for name in ARRAYS:
        key = name.removesuffix(".npy")
        array = np.load(folder / name, mmap_mode="r", allow_pickle=False)
        running = RunningStatistics()
        for recording, start, stop in splits["train"]:
            first = entries[recording].first
            for row in range(first + start, first + stop, _ROWS):
                running.add(array[row : min(row + _ROWS, first + stop)])
        statistics = running.result(_FLOORS[key])
        values[f"{key}_mean"], values[f"{key}_std"] = statistics.mean, statistics.std
    np.savez(folder / "statistics.npz", **values)


def differs(path: Path) -> str:
    """The message for a file whose content is not that of its hash."""
    return (
        f"{path}: differs from its hash in {MANIFEST}: it was damaged or changed; copy the corpus again, or prepare it"
        " anew."
    )


def _bytes(path: Path, expected: str | None) -> bytes:
    path = check_readable(path, "a file of a corpus")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the disk.") from None
    if expected is not None and hashlib.sha256(data).hexdigest() != expected:
        raise InputError(differs(path))
    return data
