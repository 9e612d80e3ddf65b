"""What the names of BEAT's recordings say, and its table of meanings; BEAT2 has both too.

A name is ``<speaker number>_<speaker>_<type>_<first>_<last sequence>``. Types 0, 2, 4 and 6 are speeches in English,
Chinese, Spanish and Japanese, the odd ones conversations. A speech's emotion follows from its sequence number (readme
of BEAT): 0 to 64 are neutral, and the seven others come in that order.
"""

import math
import re
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable

_NAME = re.compile(r"\d{1,3}_([^\W\d_]+)_(\d)_(\d{1,4})_\d{1,4}")
#: Last sequence number of each emotion.
_EMOTIONS = {
    "neutral": 64, "happiness": 72, "anger": 80, "sadness": 86, "contempt": 94, "surprise": 102, "fear": 110,
    "disgust": 118,
}  # fmt: skip
_COLUMNS = ("name", "start", "end", "duration", "score", "keywords")


def speaker_and_emotion(name: str) -> tuple[str, str]:
    """Speaker and emotion of a recording; the emotion is empty for conversations, both for other names."""
    match = _NAME.fullmatch(name)
    if not match:
        return "", ""
    speaker, kind, sequence = match.group(1), int(match.group(2)), int(match.group(3))
    emotion = next((emotion for emotion, last in _EMOTIONS.items() if sequence <= last), "") if kind % 2 == 0 else ""
    return speaker, emotion


def read_meanings(path: Path) -> list[dict[str, Any]]:
    """The stretches of a semantic file (tab-separated: name, start, end, duration, score, keywords).

    Returns:
        ``label``, ``start`` and ``end`` in seconds, ``score`` (how much the gesture means) and ``words`` of each.

    Raises:
        InputError: no such file, not UTF-8 text, or a line of another form (with its number).
    """
    path = check_readable(path, "a semantic table of BEAT")
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start}); save the table as UTF-8.") from None
    result: list[dict[str, Any]] = []
    for number, line in enumerate(text.split("\n"), start=1):
        if not line.strip():
            continue
        cells = [cell.strip() for cell in line.split("\t")]
        if len(cells) not in (len(_COLUMNS) - 1, len(_COLUMNS)):
            raise InputError(f"{path}, line {number}: expected {', '.join(_COLUMNS)} between tabs; got {len(cells)}.")
        start, end, score = (_number(path, number, cells[at]) for at in (1, 2, 4))
        if not 0.0 <= start <= end:
            raise InputError(f"{path}, line {number}: expected rising times from 0 on; got {start} to {end} s.")
        words = cells[5] if len(cells) == len(_COLUMNS) else ""
        result.append({"label": cells[0], "start": start, "end": end, "score": score, "words": words})
    return result


def _number(path: Path, line: int, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{path}, line {line}: expected a number; got {cell[:40]!r}.")
    return value
