"""Talking With Hands 16.2M (Lee et al., ICCV 2019): what its releases for the GENEA challenges 2022 and 2023 share.

Layout: the README of the 2023 data (github.com/genea-workshop/genea_challenge_2023, ``dataset``), and for 2022
``process_data.py`` of the IVI Lab's entry. Words are those of the TSV files, where an entry may be several words; a
file without any is that of a silent speaker. The root joint is ``body_world``, which holds the path of the
body (the challenges' visualizer copies the position of no other joint); every other joint has a position too, which
:func:`~a2g_jax.io.bvh.read_bvh` takes for its bone.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from a2g_jax.data.datasets.csv_tables import read_cells
from a2g_jax.data.datasets.named_files import NamedFiles, files_by_name, list_files, require, without_motion
from a2g_jax.data.datasets.source import Take
from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.transcripts import read_transcript
from a2g_jax.recording import Recording

_SPLITS = {"trn": "train", "val": "validation", "tst": "test"}
_SUFFIXES = (".bvh", ".wav", ".tsv")
_FINGERS = {"finger_incl": True, "fingers_incl": True, "finger_excl": False, "fingers_excl": False}


class Row(NamedTuple):
    """A line of the metadata."""

    path: Path
    line: int
    cells: tuple[str, ...]

    @property
    def place(self) -> str:
        """File and line, for messages."""
        return f"{self.path}, line {self.line}"


class Release(NamedTuple):
    """Files and metadata of one challenge."""

    files: NamedFiles
    rows: dict[str, Row]
    """Metadata by the recording's name, without the role in the conversation."""
    with_motion: list[str]
    """Names of the recordings, sorted, without the test recordings that were released without motion."""


def find_release(folder: Path, year: int, columns: Sequence[str], expected: str, roles: Sequence[str] = ()) -> Release:
    """The recordings of a challenge's release; their splits are the first part of their names.

    Args:
        columns: of the metadata.
        expected: the folder to name instead, for messages.
        roles: ends of the recordings' names, where both speakers of a conversation share one row. The test motion of
            the first may be missing.

    Raises:
        InputError: no recordings of that year, none with motion, or recordings and metadata that do not match.
    """
    conversation = re.compile(rf"({'|'.join(_SPLITS)})_{year}_v[0-9]+_[0-9]{{3}}")
    pattern = re.compile(rf"({conversation.pattern})_({'|'.join(roles)})") if roles else conversation
    found = list_files(folder, expected)
    files = files_by_name(found, lambda stem: stem if pattern.fullmatch(stem) else None, _SUFFIXES)
    if not files:
        raise InputError(f"{folder}: holds no recordings of the GENEA Challenge {year}; name {expected}.")
    rows = _read_metadata(found, conversation, columns)
    in_row = {(name.rpartition("_")[0] if roles else name): min(group.values()) for name, group in files.items()}
    _check_rows(in_row, rows, folder)
    left_out = without_motion(files, lambda name: name.startswith("tst") and name.endswith(tuple(roles[:1]) or ""))
    with_motion = [name for name in files if name not in left_out]
    if not with_motion:
        raise InputError(f"{folder}: none of its {len(left_out)} recordings has motion; name {expected}.")
    return Release(files, rows, with_motion)


def _read_metadata(files: Sequence[Path], name: re.Pattern[str], columns: Sequence[str]) -> dict[str, Row]:
    """The rows of every metadata table, by the recording's name in their first cell; headers are skipped.

    Raises:
        InputError: a row with another number of cells, another name, or the name of an earlier row.
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
                raise InputError(f"{row.place}: {cells[0]} is in {other.place} already; remove one.")
    return result


def has_fingers(row: Row, cell: str) -> bool:
    """Whether the fingers were captured, from ``fingers_incl`` or ``fingers_excl``."""
    if cell.lower() not in _FINGERS:
        raise InputError(f"{row.place}: expected fingers_incl or fingers_excl; got {cell[:40]!r}.")
    return _FINGERS[cell.lower()]


def _check_rows(named: dict[str, Path], rows: dict[str, Row], folder: Path) -> None:
    """Each recording has a row, and each row a recording.

    Args:
        named: a file of each recording, by its name in the metadata.

    Raises:
        InputError: a file without a row, or a row without a file.
    """
    if not rows:
        raise InputError(f"{folder}: holds no metadata table, such as metadata.csv, which names the speakers; add it.")
    if unmatched := sorted(set(named) - set(rows)):
        table = next(iter(rows.values())).path.name
        raise InputError(f"{named[unmatched[0]]}: has no row in {table}; add or remove it.")
    if unmatched := sorted(set(rows) - set(named)):
        raise InputError(f"{rows[unmatched[0]].place}: there is no file of {unmatched[0]}; add it or remove the row.")


def make_take(release: Release, name: str, speaker: str, annotations: dict[str, object]) -> Take:
    """A take that :func:`read` reads."""
    sources = tuple(
        str(require(release.files[name], suffix, f"{kind} file"))
        for suffix, kind in ((".wav", "WAV"), (".bvh", "BVH"), (".tsv", "TSV"))
    )
    return Take(name, sources, _SPLITS[name[:3]], {"speaker": speaker, "annotations": annotations})


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
