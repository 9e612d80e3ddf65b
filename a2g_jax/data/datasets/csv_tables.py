"""Tables as text, with cells between commas or tabs."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable

_LARGEST_FILE = 2**26
#: Cells of a table, which bounds time and memory.
_MOST_CELLS = 2_000_000


def read_cells(path: Path, delimiter: str = ",") -> list[tuple[int, list[str]]]:
    """Line number and stripped cells of each line that is not blank; an empty list for an empty file.

    Any line ends; UTF-8 with or without a byte-order mark, or UTF-16 with one. Quotes are special between commas only.

    Raises:
        InputError: no such file, binary, in another encoding, too large, or with an open quote (with the line).
    """
    if path.is_file() and path.stat().st_size == 0:
        return []
    path = check_readable(path, "a table")
    if path.stat().st_size > _LARGEST_FILE:
        raise InputError(f"{path}: is larger than {_LARGEST_FILE} bytes; expected a table of one data set.")
    data = path.read_bytes()
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start}); save the table as UTF-8.") from None
    if "\0" in text:
        raise InputError(f"{path}: is binary, not text; expected a table.")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if text.count(delimiter) + text.count("\n") > _MOST_CELLS:
        raise InputError(f"{path}: has more than {_MOST_CELLS} cells; expected a table of one data set.")
    if delimiter != ",":
        lines = enumerate(text.split("\n"), start=1)
        return [(line, [cell.strip() for cell in row.split(delimiter)]) for line, row in lines if row.strip()]
    rows = csv.reader(io.StringIO(text), skipinitialspace=True, strict=True)
    result = []
    try:
        for row in rows:
            if any(cell.strip() for cell in row):
                result.append((rows.line_num, [cell.strip() for cell in row]))
    except csv.Error as error:
        raise InputError(f"{path}, line {rows.line_num}: is damaged ({error}); correct that line.") from None
    return result


def read_columns(path: Path, columns: Sequence[str]) -> list[tuple[int, dict[str, str]]]:
    """Line number and the named columns of each row of a comma-separated table with a header.

    Names of columns are compared without regard to case; other columns are left out.

    Raises:
        InputError: as :func:`read_cells`; no such column; or a row without a cell for one.
    """
    rows = read_cells(path)
    header = [name.lower() for name in rows[0][1]] if rows else []
    missing = [name for name in columns if name.lower() not in header]
    if missing:
        raise InputError(f"{path}, line 1: has no column {missing[0]!r}; expected a header with {', '.join(columns)}.")
    places = {name: header.index(name.lower()) for name in columns}
    for line, cells in rows[1:]:
        if len(cells) <= max(places.values()):
            raise InputError(f"{path}, line {line}: expected {len(header)} cells, as the header has; got {len(cells)}.")
    return [(line, {name: cells[at] for name, at in places.items()}) for line, cells in rows[1:]]
