"""An invented language: function words, content words, and how they follow one another.

Syllables are (C)(C)V(C)(C). Function words are short, unstressed and frequent; content words have one to four
syllables and one lexical stress. Words are used with Zipf's frequencies, and frequent words are shorter (Zipf 1935).
The lexicon is drawn once from a fixed seed, so a word sounds the same in every recording; a recording has a topic:
recurring words.
"""

import math
from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate

import numpy as np

from a2g_jax.talker.phones import PHONES

LEXICON_SEED = 20231
"""Seed of the lexicon: part of the language's definition."""

_FUNCTION_COUNT, _CONTENT_COUNT = 48, 4000
_SYLLABLES_FREQUENT, _SYLLABLES_RARE = (0.64, 0.29, 0.06, 0.01), (0.14, 0.46, 0.29, 0.11)
_TOPIC_WORDS = 16
_ON_TOPIC = 0.35  # share of content words that are taken from the topic
_TOPIC_DRIFT = 0.2  # chance that a newly mentioned word joins the topic


@dataclass(frozen=True)
class _Table:
    """Items with their cumulative relative frequencies."""

    items: tuple[str, ...]
    sums: tuple[float, ...]

    @staticmethod
    def of(*weighted: tuple[Sequence[str], float]) -> "_Table":
        items = [(item, weight) for group, weight in weighted for item in group]
        return _Table(tuple(item for item, _ in items), tuple(accumulate(weight for _, weight in items)))

    def pick(self, rng: np.random.Generator) -> str:
        return self.items[bisect(self.sums, rng.random() * self.sums[-1])]


_WEAK_VOWELS = _Table.of(("@", 0.55), ("i", 0.15), ("e", 0.1), ("a", 0.12), ("o", 0.08))
_VOWELS = _Table.of(
    ("a", 0.21), ("e", 0.18), ("i", 0.15), ("o", 0.14), ("u", 0.09),
    (("ai",), 0.07), (("au",), 0.04), (("ei",), 0.06), (("ou",), 0.04), (("oi",), 0.02),
)  # fmt: skip
_ONSETS = _Table.of(("ptkbdgmnlrsfvzhjw", 1.0), (("S", "T"), 0.5), (("tS", "dZ"), 0.4))
_CLUSTERS = _Table.of(
    (("pr", "tr", "kr", "br", "dr", "gr", "pl", "kl", "bl", "gl", "fr", "fl"), 1.0),
    (("st", "sp", "sk", "sm", "sn", "sl", "sw", "kw", "tw"), 0.8),
)
_CODAS = _Table.of(
    ("n", 3.0), ("s", 2.0), ("lr", 1.5), ("mtk", 1.0), ("dz", 0.7), (("N",), 0.6), ("Sfpv", 0.4), (("tS",), 0.2),
)  # fmt: skip
_CODA_CLUSTERS = _Table.of((("nt", "st", "nd", "ns", "ks", "lt", "rt", "mp", "rn", "rs", "ts", "ft"), 1.0))


@dataclass(frozen=True)
class Word:
    """One word of the lexicon."""

    text: str
    syllables: tuple[tuple[str, ...], ...]
    """Phone symbols of each syllable."""
    stress: int
    """Index of the stressed syllable; -1 for function words."""

    @property
    def is_content(self) -> bool:
        """Whether it carries lexical stress (and so may carry a pitch accent)."""
        return self.stress >= 0


HESITATION = Word("em", (("@", "m"),), -1)
"""The filled pause."""


@dataclass(frozen=True)
class Lexicon:
    """All words but the filled pause, the most frequent first."""

    function: tuple[Word, ...]
    content: tuple[Word, ...]


def _syllable(rng: np.random.Generator, stressed: bool, initial: bool, short: bool = False) -> tuple[str, ...]:
    onset: tuple[str, ...] = ()
    draw = rng.random()
    if not short and draw < (0.18 if stressed else 0.05):
        onset = tuple(_CLUSTERS.pick(rng))
    elif draw < (0.9 if not initial else 0.82):
        onset = (_ONSETS.pick(rng),)
    vowel = (_VOWELS if stressed else _WEAK_VOWELS).pick(rng)
    coda: tuple[str, ...] = ()
    draw = rng.random()
    if stressed and draw < 0.08:
        coda = tuple(_CODA_CLUSTERS.pick(rng))
    elif draw < (0.44 if stressed else 0.2):
        coda = (_CODAS.pick(rng),)
    return (*onset, vowel, *coda)


def _spell(syllables: tuple[tuple[str, ...], ...]) -> str:
    return "".join(PHONES[symbol].spelling for syllable in syllables for symbol in syllable)


def _content_word(rng: np.random.Generator, rarity: float) -> Word:
    shares = (a + rarity * (b - a) for a, b in zip(_SYLLABLES_FREQUENT, _SYLLABLES_RARE, strict=True))
    count = 1 + min(3, bisect(list(accumulate(shares)), rng.random()))
    # Mostly the last but one syllable, as in many languages; never further back than the third from the end.
    stress = max(0, count - 1 - bisect((0.25, 0.85), rng.random()))
    syllables = tuple(_syllable(rng, index == stress, index == 0) for index in range(count))
    return Word(_spell(syllables), syllables, stress)


def _function_word(rng: np.random.Generator) -> Word:
    syllables = (_syllable(rng, stressed=False, initial=True, short=True),)
    return Word(_spell(syllables), syllables, -1)


@lru_cache(maxsize=1)
def lexicon() -> Lexicon:
    """The language's words: 48 function words and 4000 content words, all spelled differently."""
    rng = np.random.default_rng(LEXICON_SEED)
    taken = {HESITATION.text}

    def fresh(word: Word) -> bool:
        return word.text not in taken and not taken.add(word.text)  # type: ignore[func-returns-value]

    function: list[Word] = []
    while len(function) < _FUNCTION_COUNT:
        word = _function_word(rng)
        if fresh(word):
            function.append(word)
    content: list[Word] = []
    while len(content) < _CONTENT_COUNT:
        word = _content_word(rng, math.log(len(content) + 1.0) / math.log(_CONTENT_COUNT))
        if fresh(word):
            content.append(word)
    return Lexicon(tuple(function), tuple(content))


@lru_cache(maxsize=4)
def _zipf(count: int) -> tuple[float, ...]:
    return tuple(accumulate(1.0 / (rank + 2.7) for rank in range(count)))


def _draw(rng: np.random.Generator, words: Sequence[Word]) -> Word:
    """A word by Zipf's law of its rank: frequency proportional to 1 / (rank + 2.7) (Mandelbrot 1953)."""
    sums = _zipf(len(words))
    return words[bisect(sums, rng.random() * sums[-1])]


class Topic:
    """A recording's topic: a few recurring content words, joined occasionally by new ones."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.words = [_draw(rng, lexicon().content[20:]) for _ in range(_TOPIC_WORDS)]

    def content_word(self) -> Word:
        """Draw the next content word, of the topic or not."""
        rng = self.rng
        if rng.random() < _ON_TOPIC:
            return _draw(rng, self.words)
        word = _draw(rng, lexicon().content)
        if rng.random() < _TOPIC_DRIFT:
            self.words[int(rng.integers(len(self.words)))] = word
        return word

    def group(self) -> tuple[Word, ...]:
        """Draw zero to two function words and one or two content words, as in "of the old house"."""
        rng = self.rng
        words: list[Word] = []
        for _ in range(bisect((0.2, 0.68), rng.random())):
            words.append(_draw(rng, [word for word in lexicon().function if word not in words]))
        words.append(self.content_word())
        if rng.random() < 0.25:
            words.append(self.content_word())
        return tuple(words)
