"""Checks of a corpus's files against the hashes in its manifest, and of its values."""

import hashlib
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_files import differs
from a2g_jax.data.corpus_layout import ANNOTATIONS, WAVEFORM
from a2g_jax.errors import InputError
from a2g_jax.io.hashes import cached_scans, sha256_blocks
from a2g_jax.io.stored_array import StoredArray
from a2g_jax.progress import say

_ROWS_BYTES = 2**22


def verify_corpus(corpus: Corpus, force: bool = False) -> None:
    """Compare every file of a corpus with its hash, and look for values that are not finite.

    What was read once is not read again while its size and times are the same
    (:func:`~a2g_jax.io.hashes.cached_scans`). A motion that never moves is mentioned on standard error.

    Args:
        force: read everything in any case.

    Raises:
        InputError: the first file that differs, or the array, recording and frame of NaN or infinity.
    """
    found = _scans(corpus, force)
    for message in _damages(corpus, found):
        raise InputError(message)
    for name in _arrays(corpus):
        row = found[name]["bad row"]
        if row >= 0:
            entry = corpus.recordings[bisect_right([one.first for one in corpus.recordings], row) - 1]
            raise InputError(
                f"{corpus.path / name}: has NaN or infinity in recording {entry.name!r}, frame {row - entry.first};"
                " correct its source or leave it out, and prepare the corpus anew."
            )
    if corpus.splits.get("train") and np.ptp(corpus.statistics["pose"].std) == 0.0:
        say(f"{corpus.path}: no pose of its training recordings ever changes; check the motion of its sources.")


def damaged_files(corpus: Corpus, force: bool = False) -> Iterator[str]:
    """A message for each array and annotation file that differs from its hash in the manifest, or is missing.

    Other files are compared when they are read. Corpora of version 0.1.0 have no hashes of annotations.
    """
    yield from _damages(corpus, _scans(corpus, force))


def _damages(corpus: Corpus, found: dict[str, dict[str, Any]]) -> Iterator[str]:
    for name in _arrays(corpus):
        expected = corpus.hashes.get(name)
        if expected is not None and found[name]["sha256"] != expected:
            yield differs(corpus.path / name)
    if ANNOTATIONS in found and found[ANNOTATIONS]["sha256"] == _digest_of(corpus.annotation_hashes):
        return
    for number in range(len(corpus.recordings)):
        try:
            corpus.annotations(number)
        except InputError as error:
            yield str(error)


def _arrays(corpus: Corpus) -> tuple[str, ...]:
    waveform = (WAVEFORM,) if any(entry.samples for entry in corpus.recordings) else ()
    return ("audio.npy", "pose.npy", "root.npy", *waveform)


def _scans(corpus: Corpus, force: bool) -> dict[str, dict[str, Any]]:
    """What was found in the arrays, and in the folder of annotations if they have hashes, by name."""
    folder = corpus.annotation_hashes and (corpus.path / ANNOTATIONS).is_dir()
    names = (*_arrays(corpus), ANNOTATIONS) if folder else _arrays(corpus)
    return cached_scans(corpus.path, names, "array", _scan, force)


def _digest_of(hashes: Iterable[str]) -> str:
    return hashlib.sha256("".join(hashes).encode()).hexdigest()


def _scan(path: Path) -> dict[str, Any]:
    """SHA-256 of an array's file, and its first row with a value that is not finite, or -1; in one pass.

    Of a folder, one SHA-256 of those of its JSON files in the order of their names.
    """
    if path.is_dir():
        return {"sha256": _digest_of(sha256_blocks(file) for file in sorted(path.glob("*.json")))}
    array, bad = StoredArray(path), -1
    digest = hashlib.sha256()
    with path.open("rb") as file:
        digest.update(file.read(path.stat().st_size - array.nbytes))
        step = max(1, _ROWS_BYTES // max(1, array.nbytes // max(1, len(array))))
        for first in range(0, len(array), step):
            rows = array.read(first, min(first + step, len(array)))
            digest.update(np.ascontiguousarray(rows).reshape(-1).view(np.uint8).data if rows.size else b"")
            if bad < 0 and array.dtype.kind == "f":
                wrong = ~np.isfinite(rows.reshape(len(rows), -1)).all(axis=1)
                bad = first + int(np.argmax(wrong)) if wrong.any() else -1
    return {"sha256": digest.hexdigest(), "bad row": bad}
