"""Word timings in Praat's TextGrid files.

Only quoted strings, free-standing numbers and ``<flags>`` have a meaning in Praat's text files, so that ``xmin = 0``
and ``0`` are equivalent, and the long and the short form are one grammar (Praat manual, "TextGrid file formats").
"""

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NoReturn

from a2g_jax.errors import InputError
from a2g_jax.io.files import atomic_path, check_readable
from a2g_jax.io.reading import Note, current_reading
from a2g_jax.io.word_tiers import Tier, choose_tier, is_other_tier, word_notes
from a2g_jax.io.words import Word, is_word

#: Labels that aligners write for silence between phones; other marks of phones look like the brackets of words.
_SILENCES = frozenset({"sil", "sp", "<sil>", "<eps>", "<p:>"})
_TOKEN = re.compile(r'"(?:[^"]|"")*+"|"|![^\n]*|[^\s"]++|\n')
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def read_words(path: str | os.PathLike[str], tier: str | None = None) -> tuple[Word, ...]:
    """Read the words of a TextGrid (long or short text form, UTF-8 or UTF-16).

    Empty intervals, silence, noise and unknown words are left out (:func:`~a2g_jax.io.words.is_word`). Remarks, such as
    on a second speaker, go to the enclosing :func:`~a2g_jax.io.reading.reading`.

    Args:
        path: the file.
        tier: name of the interval tier, or of a speaker whose words are in one. None takes the choice of
            :func:`~a2g_jax.io.reading.reading`, or else the first tier of words: one with a name such as ``words`` or
            ``speaker - words``, otherwise the first that holds no phones.

    Raises:
        InputError: no such file, not a TextGrid, damaged (with the line), or without that tier.
    """
    choices = current_reading()
    words, notes = read_words_with_notes(path, choices.tier if tier is None else tier)
    # A tier named by the caller may hold anything; phones have no words.
    for note in notes if tier is None else ():
        choices.note(path, note)
    return words


def read_words_with_notes(path: str | os.PathLike[str], tier: str | None = None) -> tuple[tuple[Word, ...], list[Note]]:
    """The words of :func:`read_words`, and remarks on tiers and times."""
    path = check_readable(path, "a TextGrid file")
    tiers = _Parser(path, _text(path)).tiers()
    if not tiers:
        raise InputError(f"{path}: has no interval tier; expected one called 'words'.")
    chosen, notes = choose_tier(path, tiers, tier)
    if is_other_tier(chosen):
        words = tuple(label for label in chosen.labels if label.text.lower() not in _SILENCES)
    else:
        words = tuple(label for label in chosen.labels if is_word(label.text))
    return words, notes + word_notes(words, f"in tier {chosen.name!r}")


def write_words(
    path: str | os.PathLike[str],
    words: Sequence[Word],
    seconds: float,
    *,
    tiers: Mapping[str, Sequence[Word]] | None = None,
) -> None:
    """Write words as a TextGrid (long form, UTF-8) with a tier ``words``, atomically; gaps become empty intervals.

    Args:
        words: in order, without overlap, within 0 to ``seconds``.
        seconds: length of the recording.
        tiers: further interval tiers by name, such as ``{"phones": ...}``, under the same conditions.

    Raises:
        InputError: times out of order or range, empty text, or a further tier called ``words``.
    """
    path = Path(path)
    if not (math.isfinite(seconds) and seconds > 0):
        raise InputError(f"{path}: not written: expected a positive length in seconds; got {seconds}.")
    if tiers and "words" in tiers:
        raise InputError(f"{path}: not written: the tier 'words' is the words themselves; rename the other.")
    everything = {"words": words, **(tiers or {})}
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "xmin = 0", f"xmax = {seconds!r}"]
    lines += ["tiers? <exists>", f"size = {len(everything)}", "item []:"]
    for number, (name, entries) in enumerate(everything.items(), start=1):
        intervals = _intervals(path, name, entries, seconds)
        lines += [f"    item [{number}]:", '        class = "IntervalTier"', f"        name = {_quoted(name)}"]
        lines += ["        xmin = 0", f"        xmax = {seconds!r}", f"        intervals: size = {len(intervals)}"]
        for index, (start, end, text) in enumerate(intervals, start=1):
            lines += [f"        intervals [{index}]:", f"            xmin = {start!r}", f"            xmax = {end!r}"]
            lines.append(f"            text = {_quoted(text)}")
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _intervals(path: Path, name: str, entries: Sequence[Word], seconds: float) -> list[tuple[float, float, str]]:
    last, result = 0.0, []
    for word in entries:
        if not word.text.strip() or not word.text.isprintable():
            raise InputError(f"{path}: not written: expected a printable word in tier {name!r}; got {word.text!r}.")
        start, end = float(word.start), float(word.end)
        if not last <= start < end <= seconds:
            raise InputError(
                f"{path}: not written: tier {name!r}: {word.text!r} is at {start} to {end} s; expected times in "
                f"order, without overlap, from 0 to {seconds} s."
            )
        if last < start:
            result.append((last, start, ""))
        result.append((start, end, word.text.strip()))
        last = end
    if last < seconds:
        result.append((last, float(seconds), ""))
    return result


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"'


def _text(path: Path) -> str:
    data = path.read_bytes()
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        raise InputError(f"{path}: is neither UTF-8 nor UTF-16 text; save the TextGrid in one of them.") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


#: A number with a decimal comma.
_COMMA = re.compile(r"-?\d+,\d+")


class _Parser:
    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.tokens = self.scan(text)
        self.line = 1

    def fail(self, message: str) -> NoReturn:
        raise InputError(f"{self.path}, line {self.line}: {message}")

    def scan(self, text: str) -> Iterator[str | float]:
        """Strings (with their opening quote), flags (``<...>``) and numbers; the rest is skipped."""
        for match in _TOKEN.finditer(text):
            token = match.group()
            if token == '"':
                self.fail("a quote opens here and never closes; is the file cut short?")
            if token.startswith('"'):
                yield token[:-1].replace('""', '"') if len(token) > 2 else '"'
            elif token.startswith("<") and token.endswith(">"):
                yield token
            elif _NUMBER.fullmatch(token):
                yield float(token)
            elif _COMMA.fullmatch(token):
                self.fail(f"has a decimal comma in {token[:40]!r}; write points in numbers, or save it with Praat.")
            self.line += token.count("\n")

    def string(self, what: str) -> str:
        token = next(self.tokens, None)
        if not isinstance(token, str) or not token.startswith('"'):
            self.fail(f"expected {what} in quotes; got {_shown(token)}.")
        return token[1:]

    def number(self, what: str) -> float:
        token = next(self.tokens, None)
        if not isinstance(token, float) or not math.isfinite(token):
            self.fail(f"expected {what}; got {_shown(token)}.")
        return token

    def count(self, what: str) -> int:
        value = self.number(what)
        if value < 0 or value != int(value):
            self.fail(f"expected {what}; got {_shown(value)}.")
        return int(value)

    def tiers(self) -> list[Tier]:
        """The interval tiers; point tiers are skipped."""
        kind = next(self.tokens, None)
        if kind not in ('"ooTextFile', '"ooTextFile short') or next(self.tokens, None) != '"TextGrid':
            self.fail('expected a TextGrid text file, which starts with File type = "ooTextFile"; save it as text.')
        self.number("the start time")
        self.number("the end time")
        if next(self.tokens, None) != "<exists>":
            return []
        result = []
        for _ in range(self.count("the number of tiers")):
            kind = self.string("the class of a tier")
            if kind not in ("IntervalTier", "TextTier"):
                self.fail(f"expected IntervalTier or TextTier; got {kind[:40]!r}.")
            name = self.string("the name of a tier")
            self.number(f"the start time of tier {name!r}")
            self.number(f"the end time of tier {name!r}")
            count = self.count(f"the number of intervals of tier {name!r}")
            if kind == "IntervalTier":
                result.append(Tier(name, tuple(self.labels(name, count))))
            else:
                for _ in range(count):
                    self.number(f"a time in tier {name!r}")
                    self.string(f"a mark in tier {name!r}")
        return result

    def labels(self, name: str, count: int) -> Iterator[Word]:
        last = -math.inf
        for _ in range(count):
            start, end = self.number(f"a start time in tier {name!r}"), self.number(f"an end time in tier {name!r}")
            if not start < end or start < last - 1e-6:
                self.fail(f"expected rising times in tier {name!r}; got {start} to {end}.")
            text = " ".join(self.string(f"a text in tier {name!r}").split())
            if text:
                yield Word(text, start, end)
            last = end


def _shown(token: str | float | None) -> str:
    if token is None:
        return "the end of the file"
    return repr(token) if isinstance(token, float) else repr(token[:40].lstrip('"'))
