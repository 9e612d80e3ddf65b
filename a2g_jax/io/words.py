"""Spoken words with their times."""

import zlib
from dataclasses import dataclass


@dataclass(frozen=True)
class Word:
    """A spoken word; ``start`` and ``end`` in seconds from the start of the audio."""

    text: str
    start: float
    end: float


def word_id(text: str) -> int:
    """A number from 1 to 2**31 - 1 that stands for a word in models: a hash that ignores case and spaces around it.

    It is the same in every corpus, so that words of new speech need no vocabulary.
    """
    return zlib.crc32(text.strip().casefold().encode()) % (2**31 - 1) + 1
