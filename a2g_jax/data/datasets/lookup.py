"""Helpers that find the recordings of a data set: folders, large tables, names."""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from a2g_jax.data.datasets.named_files import list_files
from a2g_jax.data.datasets.source import Take
from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable

#: Parts of the official splits by the data sets' names of them.
SPLIT_NAMES = {"train": "train", "val": "validation", "valid": "validation", "dev": "validation", "test": "test"}


def check_folder(folder: Path, expected: str) -> None:
    """Raise ``InputError`` unless there is such a folder; ``expected`` is the folder that the user should name."""
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder; name {expected}.")


def files_with(folder: Path, suffix: str, expected: str) -> list[Path]:
    """Files under a folder with a suffix, as :func:`~a2g_jax.data.datasets.named_files.list_files` finds them."""
    return [path for path in list_files(folder, expected) if path.suffix.lower() == suffix]


def table_rows(path: Path, columns: Sequence[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """Line number and named columns of each row of a comma-separated table with a header, one row at a time.

    For tables with a row a window, too large for :func:`~a2g_jax.data.datasets.csv_tables.read_columns`.

    Raises:
        InputError: no such file, not UTF-8 text, without a column, or a row that is too short.
    """
    path = check_readable(path, f"a table with the columns {', '.join(columns)}")
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = csv.reader(file)
        try:
            header = [name.strip() for name in next(rows, [])]
            missing = [name for name in columns if name not in header]
            if missing:
                raise InputError(f"{path}, line 1: has no column {missing[0]!r}; expected {', '.join(columns)}.")
            places = [header.index(name) for name in columns]
            for row in rows:
                if not any(cell.strip() for cell in row):
                    continue
                if len(row) <= max(places):
                    raise InputError(f"{path}, line {rows.line_num}: has {len(row)} cells; expected {len(header)}.")
                yield rows.line_num, {name: row[at].strip() for name, at in zip(columns, places, strict=True)}
        except UnicodeDecodeError:
            raise InputError(f"{path}: is not UTF-8 text; save the table as UTF-8.") from None
        except csv.Error as error:
            raise InputError(f"{path}, line {rows.line_num}: is damaged ({error}); download it again.") from None


def unique_names(takes: Sequence[Take]) -> list[Take]:
    """The takes, with ``-2``, ``-3`` ... appended to repeated names."""
    used: set[str] = set()
    result = []
    for take in takes:
        name, number = take.name, 1
        while name in used:
            number += 1
            name = f"{take.name}-{number}"
        used.add(name)
        result.append(take if number == 1 else replace(take, name=name))
    return result
