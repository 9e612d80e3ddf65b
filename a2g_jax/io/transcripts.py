"""Transcripts with word times, in the formats of data sets, and words at frame times."""

import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable, read_json
from a2g_jax.io.reading import Note, current_reading
from a2g_jax.io.recognised_words import is_recognised, recognised_words
from a2g_jax.io.textgrid import read_words_with_notes
from a2g_jax.io.word_tiers import word_notes
from a2g_jax.io.words import Word, is_word

#: Largest time in a transcript, in seconds: a larger number is an error in units.
_LONGEST = 1e6
_SECONDS = re.compile(r"[0-9]{1,9}(?:\.[0-9]{0,24})?s?")
_PREVIEW = 64
_SUBTITLES = frozenset({".srt", ".vtt", ".ass", ".sbv"})
_LARGEST_FILE = 2**26
#: Tolerance as a share of a frame: frame times and word times are both rounded decimals.
FRAME_SLACK = 1e-6


def read_transcript(path: str | os.PathLike[str], tier: str | None = None) -> tuple[Word, ...]:
    """Read the words of a transcript in the order in which they start.

    ==========================  ===========================================================================
    form                        written by
    ==========================  ===========================================================================
    TextGrid (``.TextGrid``)    Praat, the Montreal Forced Aligner; BEAT and BEAT2
    JSON (``.json``)            Google's speech-to-text: Trinity, GENEA 2020. The first alternative counts
    JSON (``.json``)            Whisper with word times, WhisperX, Gentle. Words without times are left out
    tab-separated (``.tsv``)    ``start<TAB>end<TAB>word`` on each line, in seconds: GENEA 2022 and 2023
    ==========================  ===========================================================================

    The suffix determines the form, or else the content. Recognisers round times, so a word may have no duration, or
    start before the previous one ends. Marks of silence, noise and unknown words are left out
    (:func:`~a2g_jax.io.words.is_word`); remarks go to the enclosing :func:`~a2g_jax.io.reading.reading`.

    Args:
        tier: of a TextGrid, as for :func:`~a2g_jax.io.textgrid.read_words`.

    Raises:
        InputError: no such file, another form, damaged (with the line or the place), or invalid times.
    """
    choices = current_reading()
    words, notes = transcript_notes(path, tier)
    for note in notes:
        choices.note(path, note)
    return words


def transcript_notes(path: str | os.PathLike[str], tier: str | None = None) -> tuple[tuple[Word, ...], list[Note]]:
    """The words of :func:`read_transcript`, and remarks on tiers and times."""
    path = check_readable(path, "a transcript (TextGrid, JSON or TSV)")
    if path.stat().st_size > _LARGEST_FILE:
        raise InputError(f"{path}: is larger than {_LARGEST_FILE} bytes; expected the transcript of one recording.")
    reader = _reader(path)
    if reader is read_words_with_notes:
        words, notes = read_words_with_notes(path, current_reading().tier if tier is None else tier)
    else:
        labels, notes = _json(path) if reader is _json else (reader(path), [])
        words = tuple(word for word in labels if is_word(word.text))
        notes = notes + word_notes(words)
    return tuple(sorted(words, key=lambda word: word.start)), notes


def words_at_frames(words: Sequence[Word], fps: float, frames: int) -> Int[np.ndarray, " frames"]:
    """Index of the word that is spoken at each frame, -1 where there is none.

    Frame k is at time k / fps; a word lasts from its start (inclusive) to its end (exclusive). Of overlapping words,
    the one that started last counts. A word shorter than a frame may fall between two frames.

    Args:
        words: in any order.
        fps: frames per second.
        frames: number of frames.
    """
    if not (math.isfinite(fps) and fps > 0):
        raise InputError(f"fps: expected a positive number; got {fps}.")
    result = np.full(max(frames, 0), -1)
    times = np.array([(word.start, word.end) for word in words], np.float64).reshape(-1, 2)
    first, stop = np.clip(np.ceil(times * fps - FRAME_SLACK), 0, frames).astype(np.int64).T
    for index in np.argsort(times[:, 0], kind="stable"):
        result[first[index] : stop[index]] = index
    return result


def _reader(path: Path) -> Callable[[Path], Any]:
    by_suffix: dict[str, Callable[[Path], Any]] = {".textgrid": read_words_with_notes, ".json": _json, ".tsv": _table}
    reader = by_suffix.get(path.suffix.lower())
    if reader is not None:
        return reader
    with path.open("rb") as file:
        start = file.read(_PREVIEW)
    if b"ooTextFile" in start.replace(b"\0", b""):
        return read_words_with_notes
    start = start.removeprefix(b"\xef\xbb\xbf").lstrip()
    if start[:1] in (b"[", b"{"):
        return _json
    if b"\t" in start:
        return _table
    if path.suffix.lower() in _SUBTITLES or b"-->" in start:
        raise InputError(
            f"{path}: is not a transcript in a supported form: subtitles have times of phrases, not of words; name the"
            " recogniser's JSON with word times (whisper --word_timestamps True, whisperx), or a TextGrid."
        )
    raise InputError(f"{path}: is not a transcript in a supported form; expected a TextGrid, JSON or TSV file.")


def _json(path: Path) -> tuple[Iterable[Word], list[Note]]:
    value = read_json(path)
    return recognised_words(path, value, _word) if is_recognised(value) else (_google(path, value), [])


def _google(path: Path, results: Any) -> Iterator[Word]:
    if isinstance(results, dict):
        results = results.get("results")
    for number, result in enumerate(_list(path, results, "the file")):
        place = f"result {number + 1}"
        alternatives = _list(path, _entry(path, result, place, "alternatives"), place)
        if not alternatives:
            continue
        words = _entry(path, alternatives[0], place, "words", default=[])
        for index, word in enumerate(_list(path, words, place)):
            at = f"{place}, word {index + 1}"
            start = _entry(path, word, at, "start_time", "startTime", default="0s")
            end = _entry(path, word, at, "end_time", "endTime")
            yield _word(f"{path}: {at}", _entry(path, word, at, "word"), start, end)


def _list(path: Path, value: Any, place: str) -> list[Any]:
    if not isinstance(value, list):
        raise InputError(
            f"{path}: {place}: expected a list as Google's speech-to-text writes, with 'alternatives' and 'words', or"
            " the JSON of Whisper, WhisperX or Gentle."
        )
    return value


def _entry(path: Path, value: Any, place: str, *names: str, default: Any = None) -> Any:
    found = next((value[name] for name in names if name in value), default) if isinstance(value, dict) else None
    if found is None:
        raise InputError(f"{path}: {place}: expected {names[0]!r}; write the file again with word times.")
    return found


def _table(path: Path) -> Iterator[Word]:
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text (byte {error.start}); save the table as UTF-8.") from None
    for number, line in enumerate(text.split("\n"), start=1):
        if not line.strip():
            continue
        parts = line.rstrip("\r").split("\t")
        if len(parts) != 3:
            raise InputError(
                f"{path}, line {number}: expected start, end and word, separated by tabs; got {len(parts)} parts."
            )
        if not parts[2].strip():
            continue  # the challenge's own loaders skip times without a word too
        yield _word(f"{path}, line {number}", parts[2], parts[0].strip(), parts[1].strip())


def _word(place: str, text: Any, start: Any, end: Any) -> Word:
    if not isinstance(text, str) or not text.strip() or any("\ud800" <= letter <= "\udfff" for letter in text):
        raise InputError(f"{place}: expected a word; got {_shown(text)}.")
    first, last = _seconds(place, start), _seconds(place, end)
    if first > last:
        raise InputError(f"{place}: ends at {last} s, before it starts at {first} s; correct the times.")
    return Word(" ".join(text.split()), first, last)


def _seconds(place: str, value: Any) -> float:
    if isinstance(value, str) and _SECONDS.fullmatch(value):
        value = float(value.removesuffix("s"))
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= _LONGEST:
        comma = isinstance(value, str) and "," in value
        hint = "; write a point in place of the comma" if comma else ""
        raise InputError(f"{place}: expected a time in seconds from 0 on; got {_shown(value)}{hint}.")
    return float(value)


def _shown(value: Any) -> str:
    if isinstance(value, str):
        return ascii(value[:40])
    return str(value) if isinstance(value, float) else type(value).__name__
