"""Spoken words with their times."""

import re
import zlib
from dataclasses import dataclass

#: Labels of silence, noise and unknown words that aligners write without brackets.
_MARKS = frozenset({"sil", "sp", "spn", "nsn", "oov", "unk", "eps", "nib", "xxx", "yyy"})
#: Marks that are words elsewhere in lower case.
_UPPER = frozenset({"NOISE", "LAUGH", "LAUGHTER", "BREATH", "SILENCE", "COUGH", "MUSIC", "PAUSE", "INAUDIBLE"})
_BRACKETED = re.compile(r"<.*>|\[.*\]|\(.*\)|\{.*\}|\*.*\*|\+[^+]+\+|%\S+|&=\S+", re.DOTALL)


@dataclass(frozen=True)
class Word:
    """A spoken word; ``start`` and ``end`` in seconds from the start of the audio."""

    text: str
    start: float
    end: float


def is_word(text: str) -> bool:
    """Whether a label of a transcript is a spoken word.

    Empty labels, marks of silence and noise (``sil``, ``sp``, ``spn``), anything in brackets as a whole (``<eps>``,
    ``<unk>``, ``[laughter]``, ``(noise)``, ``{spn}``, ``+breath+``), events in capitals (``NOISE``), codes with ``%``
    or ``&=``, and labels without a letter or digit are no words.
    """
    label = text.strip()
    if label.casefold() in _MARKS or label in _UPPER or not any(letter.isalnum() for letter in label):
        return False
    return _BRACKETED.fullmatch(label) is None


def word_id(text: str) -> int:
    """A number from 1 to 2**31 - 1 that stands for a word in models: a hash that ignores case and spaces around it.

    It is the same in every corpus, so that words of new speech need no vocabulary.
    """
    return zlib.crc32(text.strip().casefold().encode()) % (2**31 - 1) + 1
