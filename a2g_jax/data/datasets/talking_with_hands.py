"""Talking With Hands 16.2M (Lee et al., ICCV 2019): what its releases for the GENEA challenges 2022 and 2023 share.

Layout: the README of the 2023 data (github.com/genea-workshop/genea_challenge_2023, ``dataset``), and for 2022
``process_data.py`` of the IVI Lab's entry. Words are those of the TSV files, where an entry may be several words; a
file without any means that the speaker says nothing. The root joint is ``body_world``, which carries the path of the
body (the challenges' visualizer copies the place of no other joint); every other joint has a position too, which
:func:`~a2g_jax.io.bvh.read_bvh` takes for its bone.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from a2g_jax.data.datasets.csv_tables import read_cells
from a2g_jax.data.datasets.named_files import require
from a2g_jax.data.datasets.source import Take
from a2g_jax.data.recording import Recording
from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.transcripts import read_transcript

SPLITS = {"trn": "train", "val": "validation", "tst": "test"}
SUFFIXES = (".bvh", ".wav", ".tsv")
_FINGERS = {"finger_incl": True, "fingers_incl": True, "finger_excl": False, "fingers_excl": False}


class Row(NamedTuple):
    """A line of the metadata."""

    path: Path
    line: int
    cells: tuple[str, ...]

    @property
    def place(self) -> str:
        """For messages."""
        return f"{self.path}, line {self.line}"


def read_metadata(files: Sequence[Path], name: re.Pattern[str], columns: Sequence[str]) -> dict[str, Row]:
    """The rows of every metadata table, by the recording's name in their first cell; headers are read over.

    Raises:
        InputError: a row with another number of cells, another name, or a name that stood before.
    """
    result: dict[str, Row] = {}
    for path in files:
        if path.suffix.lower() != ".csv" or "metadata" not in path.stem.lower():
            continue
        rows = read_cells(path)
        if not any(name.fullmatch(cells[0]) for _, cells in rows):
            continue  # of another challenge
        for line, cells in rows:
            row = Row(path, line, tuple(cells))
            if line == 1 and not name.fullmatch(cells[0]):
                continue
            if not name.fullmatch(cells[0]) or len(cells) != len(columns):
                raise InputError(f"{row.place}: expected {', '.join(columns)}; got {', '.join(cells)[:80]!r}.")
            other = result.setdefault(cells[0], row)
            if other is not row:
                raise InputError(f"{row.place}: {cells[0]} stands in {other.place} already; remove one.")
    return result


def has_fingers(row: Row, cell: str) -> bool:
    """Whether the fingers were captured, from ``fingers_incl`` or ``fingers_excl``."""
    if cell.lower() not in _FINGERS:
        raise InputError(f"{row.place}: expected fingers_incl or fingers_excl; got {cell[:40]!r}.")
    return _FINGERS[cell.lower()]


def check_rows(named: dict[str, Path], rows: dict[str, Row], folder: Path) -> None:
    """Each recording has a row, and each row a recording.

    Args:
        named: a file of each recording, by the name that the metadata has for it.

    Raises:
        InputError: names the file without a row, or the row without a file.
    """
    if not rows:
        raise InputError(f"{folder}: holds no metadata table, such as metadata.csv, which names the speakers; add it.")
    if lonely := sorted(set(named) - set(rows)):
        raise InputError(f"{named[lonely[0]]}: has no row in {next(iter(rows.values())).path.name}; add or remove it.")
    if lonely := sorted(set(rows) - set(named)):
        raise InputError(f"{rows[lonely[0]].place}: there is no file of {lonely[0]}; add it or remove the row.")


def make_take(name: str, files: dict[str, Path], split: str, annotations: dict[str, object], speaker: str) -> Take:
    """A take that :func:`read` reads."""
    sources = tuple(
        str(require(files, suffix, f"{kind} file"))
        for suffix, kind in ((".wav", "WAV"), (".bvh", "BVH"), (".tsv", "TSV"))
    )
    return Take(name, sources, split, {"speaker": speaker, "annotations": annotations})


def read(take: Take, sample_rate: int) -> Recording:
    """One speaker of a conversation. Annotations: ``fingers`` (whether they were captured), and those of the set."""
    wav, bvh, tsv = (Path(source) for source in take.sources)
    return Recording(
        name=take.name,
        audio=read_audio(wav, sample_rate),
        sample_rate=sample_rate,
        motion=read_bvh(bvh),
        words=read_transcript(tsv) if tsv.stat().st_size else (),
        speaker=take.spec["speaker"],
        sources=take.sources,
        annotations=take.spec["annotations"],
    )
