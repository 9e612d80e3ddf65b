"""Labels of a BEAT recording: the emotion of its sequence number, and the label files beside it.

From the README of github.com/PantoMatrix/PantoMatrix; names and semantic labels of BEAT2 have the same form.
"""

import math
from bisect import bisect_left
from pathlib import Path
from typing import Any

from a2g_jax.data.datasets.csv_tables import read_cells
from a2g_jax.errors import InputError
from a2g_jax.io.textgrid import read_words

#: In the order of the scores in the emotion files.
EMOTIONS = ("neutral", "happiness", "anger", "sadness", "contempt", "surprise", "fear", "disgust")
LANGUAGES = ("english", "chinese", "spanish", "japanese")
#: Last sequence number of each of :data:`EMOTIONS`.
_LAST = (64, 72, 80, 86, 94, 102, 110, 118)
_FACE_FPS = 60.0
_LARGEST_FACE = 2**30
#: Longest running text beside a recording, bytes.
_LONGEST_TEXT = 2**20


def emotion(kind: int, first: int, last: int) -> str:
    """The emotion of a speech by its sequence numbers; ``""`` for a conversation or numbers of several emotions.

    Args:
        kind: type of the recording: even for speeches, odd for conversations.
        first: first sequence number.
        last: last sequence number.
    """
    if kind % 2 or max(first, last) > _LAST[-1]:
        return ""
    found = {bisect_left(_LAST, number) for number in (first, last)}
    return EMOTIONS[found.pop()] if len(found) == 1 else ""


def read_phones(path: Path) -> list[dict[str, Any]]:
    """The phones of a TextGrid whose words can be read; an empty list without a tier of them."""
    try:
        phones = read_words(path, "phones")
    except InputError:
        return []
    return [{"text": phone.text, "start": phone.start, "end": phone.end} for phone in phones]


def read_emotions(path: Path) -> list[dict[str, Any]]:
    """Emotion over time, from ``name,start,end,duration,score``.

    Returns:
        ``label`` as written, ``emotion`` by the score (0 to 7, in the order of :data:`EMOTIONS`), ``start`` and
        ``end`` in seconds.

    Raises:
        InputError: a line of another form (with its number).
    """
    result = []
    for line, cells in read_cells(path):
        label, score = _label(path, line, cells)
        if score not in range(len(EMOTIONS)):
            raise InputError(f"{path}, line {line}: expected a score of 0 to {len(EMOTIONS) - 1}; got {cells[4][:40]}.")
        result.append({**label, "emotion": EMOTIONS[int(score)]})
    return result


def read_semantics(path: Path) -> list[dict[str, Any]]:
    """Kinds of gesture over time, from tab-separated ``name, start, end, duration, score, keywords``.

    Returns:
        ``label``, ``start`` and ``end`` in seconds, ``score`` (how meaningful the gesture is) and ``keywords``.

    Raises:
        InputError: a line of another form (with its number).
    """
    result = []
    for line, cells in read_cells(path, "\t"):
        # Some lines have spaces where the others have tabs.
        cells = cells if len(cells) > 1 else cells[0].split(maxsplit=5)
        label, score = _label(path, line, cells)
        result.append({**label, "score": score, "keywords": cells[5] if len(cells) > 5 else ""})
    return result


def _label(path: Path, line: int, cells: list[str]) -> tuple[dict[str, Any], float]:
    if len(cells) < 5:
        raise InputError(f"{path}, line {line}: expected name, start, end, duration and score; got {len(cells)} cells.")
    start, end, score = (_number(path, line, cells[at]) for at in (1, 2, 4))
    if not 0 <= start <= end:
        raise InputError(f"{path}, line {line}: expected rising times from 0 on; got {start} to {end} s.")
    return {"label": cells[0], "start": start, "end": end}, score


def _number(path: Path, line: int, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{path}, line {line}: expected a number; got {cell[:40]!r}.")
    return value


def read_text(path: Path, *, english: bool) -> dict[str, Any]:
    """Contents of the ``.txt`` beside a recording: ``semantic`` labels over time, or ``transcript``.

    Raises:
        InputError: no semantic labels in an English one; those of other languages may have running text instead.
    """
    try:
        return {"semantic": read_semantics(path)}
    except InputError:
        if english or path.stat().st_size > _LONGEST_TEXT:
            raise
    return {"transcript": " ".join(path.read_text("utf-8-sig", errors="replace").split())}


def describe_face(path: Path, offset: float) -> dict[str, Any]:
    """The file of face weights, its number of frames and rate, and the time in it at which the recording starts.

    The frames are counted without reading the file into memory.

    Raises:
        InputError: no frames, or larger than a gibibyte.
    """
    if path.stat().st_size > _LARGEST_FACE:
        raise InputError(f"{path}: is larger than {_LARGEST_FACE} bytes; expected the face of one recording.")
    key, frames, tail = b'"weights"', 0, b""
    with path.open("rb") as file:
        while block := file.read(2**20):
            block = tail + block
            frames += block.count(key)
            tail = block[-(len(key) - 1) :]
    if frames == 0:
        raise InputError(f"{path}: holds no frames of face weights; download it again or remove it.")
    return {"file": str(path), "frames": frames, "fps": _FACE_FPS, "offset": offset}
