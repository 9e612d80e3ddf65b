"""Words with times in the JSON of speech recognisers and aligners: Whisper, WhisperX, Gentle."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.reading import Note
from a2g_jax.io.words import Word

#: Names of a word's text.
_TEXT = ("word", "text")
_REMEDY = "transcribe with word times (whisper --word_timestamps True, whisperx)"


def is_recognised(value: Any) -> bool:
    """Whether a JSON value is an object with ``segments`` (Whisper, WhisperX) or ``words`` (Gentle)."""
    return isinstance(value, dict) and any(isinstance(value.get(key), list) for key in ("segments", "words"))


def recognised_words(
    path: Path, value: dict[str, Any], word: Callable[[str, Any, Any, Any], Word]
) -> tuple[tuple[Word, ...], list[Note]]:
    """The words, and a remark if some have no times: WhisperX aligns no numbers, Gentle not every word.

    Args:
        path: for messages.
        value: contents of the file (:func:`is_recognised`).
        word: a word of a place in the file, a text, a start and an end.

    Raises:
        InputError: segments without words, no times at all, or what ``word`` refuses.
    """
    found, untimed = [], 0
    for place, entry in _entries(path, value):
        if not isinstance(entry, dict) or (text := next((entry[key] for key in _TEXT if key in entry), None)) is None:
            raise InputError(f"{path}: {place}: expected an object with 'word', 'start' and 'end'; {_REMEDY}.")
        if entry.get("start") is None or entry.get("end") is None:
            untimed += 1
            continue
        found.append(word(f"{path}: {place}", text, entry["start"], entry["end"]))
    if untimed and not found:
        raise InputError(f"{path}: none of its {untimed} words has a time; {_REMEDY}.")
    if not untimed:
        return tuple(found), []
    message = f"{untimed} of {untimed + len(found)} words have no times and are left out."
    return tuple(found), [
        Note("untimed", message, "The aligner did not find them in the speech.", value=float(untimed))
    ]


def _entries(path: Path, value: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Each word's entry with its place in the file."""
    segments = value.get("segments")
    if not isinstance(segments, list):
        segments = [value]
    for number, segment in enumerate(segments, start=1):
        words = segment.get("words") if isinstance(segment, dict) else None
        if not isinstance(words, list):
            raise InputError(f"{path}: segment {number}: has no list of 'words'; {_REMEDY}.")
        for index, entry in enumerate(words, start=1):
            yield f"segment {number}, word {index}", entry
