"""Which tier of a TextGrid has the words, and what is unusual about words and their times."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.reading import Note
from a2g_jax.io.words import Word

_WORDS = frozenset({"words", "word", "wort", "worte", "wörter", "mots", "palabras", "parole", "ort", "orthography"})
_NO_WORDS = frozenset(
    {"phones", "phone", "phonemes", "phoneme", "phons", "segments", "segment", "mau", "kan", "ipa", "sampa", "arpabet",
     "syllables", "syllable", "syll", "sounds", "visemes", "tones", "pitch", "gestures", "emotion", "emotions",
     "comments", "notes"}
)  # fmt: skip
#: Seconds from which a word is not one: the longest words of fast and slow speech last two.
_LONGEST = 5.0
#: Median length from which times are in another unit, seconds.
_OTHER_UNIT = 20.0
#: Code, name and factor of other units, and medians of a word's length in them.
_UNITS = (
    ("time-unit", "hundredths of a second", 100, (20.0, 80.0)),
    ("milliseconds", "milliseconds", 1000, (80.0, 2000.0)),
    ("time-unit", "units of 100 ns, as HTK writes", 10_000_000, (5e5, 2e7)),
)
#: Phones of English by the Montreal Forced Aligner's older models, and the share of labels that shows them.
_ARPABET = frozenset(
    {"AA", "AE", "AH", "AO", "AW", "AY", "B", "CH", "D", "DH", "EH", "ER", "EY", "F", "G", "HH", "IH", "IY", "JH", "K",
     "L", "M", "N", "NG", "OW", "OY", "P", "R", "S", "SH", "T", "TH", "UH", "UW", "V", "W", "Y", "Z", "ZH", "sp", "sil",
     "spn"}
)  # fmt: skip
_MOSTLY = 0.9
#: Phones in other alphabets: labels up to this long, in seconds up to this long, at least so many.
_PHONE_LETTERS, _PHONE_SECONDS, _PHONES = 2, 0.2, 20


class Tier(NamedTuple):
    """An interval tier: labels that are not empty, with their times."""

    name: str
    labels: tuple[Word, ...]


def is_word_tier(name: str) -> bool:
    """Whether a name is that of a tier of words, such as ``words`` or ``anna - words``."""
    return bool(_parts(name) & _WORDS) or name.strip().lower().endswith(("words", "word"))


def is_other_tier(tier: Tier) -> bool:
    """Whether a tier holds phones, syllables or annotations, by its name or its labels."""
    if is_word_tier(tier.name):
        return False
    if _parts(tier.name) & _NO_WORDS:
        return True
    labels = [label for label in tier.labels if label.text.isascii() or label.text.islower()]
    if len(labels) < _PHONES or len(labels) < len(tier.labels):
        return False
    if np.mean([label.text.rstrip("012") in _ARPABET for label in labels]) > _MOSTLY:
        return True
    letters = float(np.median([len(label.text) for label in labels]))
    return letters <= _PHONE_LETTERS and float(np.median([one.end - one.start for one in labels])) < _PHONE_SECONDS


def choose_tier(path: Path, tiers: Sequence[Tier], wanted: str | None) -> tuple[Tier, list[Note]]:
    """The tier of words, and a remark if others are left out.

    Args:
        path: of the TextGrid, for messages.
        wanted: name of a tier, or of the speaker whose words are wanted; None for the first tier of words.

    Raises:
        InputError: no tier of words, or none of that name.
    """
    names = ", ".join(repr(tier.name) for tier in tiers)
    if wanted is not None:
        return _named(path, tiers, wanted, names), []
    found = [tier for tier in tiers if is_word_tier(tier.name)]
    found = found or [tier for tier in tiers if not is_other_tier(tier)]
    if not found:
        kind = "tier is" if len(tiers) == 1 else "tiers are"
        raise InputError(
            f"{path}: has no tier of words; its {kind} {names}. Align words too, or name a tier with --tier."
        )
    chosen = next((tier for tier in found if tier.labels), found[0])
    left = [tier.name for tier in found if tier is not chosen and tier.labels]
    if not left:
        return chosen, []
    others = ", ".join(repr(name) for name in left)
    message = f"has {len(left) + 1} tiers of words; {chosen.name!r} is read, and {others} left out."
    return chosen, [Note("tiers", message, f"Choose another speaker with --tier {_speaker(left[0])!r}.")]


def _named(path: Path, tiers: Sequence[Tier], wanted: str, names: str) -> Tier:
    for match in (
        lambda name: name == wanted,
        lambda name: name.strip().casefold() == wanted.strip().casefold(),
        lambda name: is_word_tier(name) and _parts(name) - _WORDS == _parts(wanted) - _WORDS != set(),
    ):
        found = [tier for tier in tiers if match(tier.name)]
        if found:
            return found[0]
    raise InputError(f"{path}: has no interval tier {wanted!r}; its tiers are {names}.")


def _parts(name: str) -> set[str]:
    return set(re.split(r"[\W_]+", name.casefold())) - {""}


def _speaker(name: str) -> str:
    """The name without the part that says words, where one is left."""
    short = re.sub(r"(?i)[\s_:.-]*\b(words?)\b[\s_:.-]*", "", name).strip()
    return short if short and _parts(short) == _parts(name) - _WORDS else name


def word_notes(words: Sequence[Word], where: str = "") -> list[Note]:
    """Remarks on a transcript: no words, times in another unit, words of minutes, sentences in place of words.

    Args:
        where: such as ``"in tier 'words'"``.
    """
    if not words:
        place = f" {where}" if where else ""
        return [Note("no-words", f"has no words{place}.", "Did the aligner fail? Align the transcript again.")]
    lengths = np.array([word.end - word.start for word in words])
    median, longest = float(np.median(lengths)), int(np.argmax(lengths))
    if median > _OTHER_UNIT and (len(words) > 2 or _whole(words)):
        for code, name, factor, (least, most) in _UNITS:
            if least < median <= most:
                message = f"times look like {name}: a word lasts {median:.4g} s (median)."
                return [Note(code, message, f"Divide them by {factor}: times are in seconds.", value=median)]
    notes = []
    if (early := min(word.start for word in words)) < 0:
        message = f"a word begins before the recording, at {early:.3g} s."
        notes.append(Note("early-word", message, "Are the times of another recording, or shifted?", early, early))
    if median > _OTHER_UNIT:
        message = f"times are not in seconds: a word lasts {median:.4g} s (median)."
        notes.append(Note("time-unit", message, "Convert them to seconds.", value=median))
    elif lengths[longest] > _LONGEST:
        word, count = words[longest], int((lengths > _LONGEST).sum())
        many = "a word lasts" if count == 1 else f"{count} words last"
        message = f"{many} longer than {_LONGEST:.0f} s, {word.text[:40]!r} {lengths[longest]:.1f} s."
        fix = "Did the aligner lose the speech there? Align it again."
        notes.append(Note("long-word", message, fix, word.start, float(lengths[longest])))
    if float(np.median([len(word.text.split()) for word in words])) >= 3:
        notes.append(Note("sentences", "its labels are whole phrases, not words.", "Align single words."))
    return notes


def _whole(words: Sequence[Word]) -> bool:
    return all(float(time).is_integer() for word in words for time in (word.start, word.end))
