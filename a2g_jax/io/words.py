"""Spoken words with their times."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Word:
    """A spoken word; ``start`` and ``end`` in seconds from the start of the audio."""

    text: str
    start: float
    end: float
