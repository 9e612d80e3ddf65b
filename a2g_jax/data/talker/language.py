"""An invented language: a small lexicon of function and content words, and how they follow one another.

Syllables are (C)(C)V(C). Function words are short, unstressed and frequent; content words have one to four syllables
and one lexical stress. The lexicon is drawn once from a fixed seed, so a word sounds the same in every recording.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from a2g_jax.data.talker.phones import PHONES

LEXICON_SEED = 20231
"""Seed of the lexicon: part of the language's definition."""

_FULL_VOWELS = (("a", 0.22), ("e", 0.18), ("i", 0.15), ("o", 0.14), ("u", 0.09))
_DIPHTHONGS = (("ai", 0.07), ("au", 0.04), ("ei", 0.07), ("ou", 0.04))
_WEAK_VOWELS = (("@", 0.55), ("i", 0.15), ("e", 0.1), ("a", 0.12), ("o", 0.08))
_ONSETS = (*((phone, 1.0) for phone in "ptkbdgmnlrsfvzhjw"), ("S", 0.5), ("tS", 0.4))
_STOP_CLUSTERS = ("pr", "tr", "kr", "br", "dr", "gr", "pl", "kl", "bl")
_CLUSTERS = tuple((pair, 1.0) for pair in (*_STOP_CLUSTERS, "st", "sp", "sk", "sm", "fl"))
_CODAS = (("n", 3.0), ("s", 2.0), ("l", 1.5), ("r", 1.5), ("m", 1.0), ("t", 1.2), ("k", 0.8), ("N", 0.6), ("S", 0.4))


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


@dataclass(frozen=True)
class Lexicon:
    """All words and how often they are used."""

    function: tuple[Word, ...]
    content: tuple[Word, ...]
    function_probability: Float[np.ndarray, " F"]
    content_probability: Float[np.ndarray, " C"]


def _pick(rng: np.random.Generator, table: tuple[tuple[str, float], ...]) -> str:
    weights = np.array([weight for _, weight in table])
    return table[int(rng.choice(len(table), p=weights / weights.sum()))][0]


def _syllable(rng: np.random.Generator, stressed: bool, initial: bool, short: bool = False) -> tuple[str, ...]:
    onset: tuple[str, ...] = ()
    draw = rng.random()
    if stressed and not short and draw < 0.16:
        onset = tuple(_pick(rng, _CLUSTERS))
    elif draw < (0.9 if not initial else 0.82):
        onset = (_pick(rng, _ONSETS),)
    vowel = _pick(rng, _FULL_VOWELS + _DIPHTHONGS if stressed else _WEAK_VOWELS)
    coda = (_pick(rng, _CODAS),) if rng.random() < (0.38 if stressed else 0.2) else ()
    return (*onset, vowel, *coda)


def _spell(syllables: tuple[tuple[str, ...], ...]) -> str:
    return "".join(PHONES[symbol].spelling for syllable in syllables for symbol in syllable)


def _content_word(rng: np.random.Generator) -> Word:
    count = 1 + int(rng.choice(4, p=(0.3, 0.42, 0.21, 0.07)))
    # Stress prefers the last but one syllable, as in many languages; never further back than the third from the end.
    stress = max(0, count - 1 - int(rng.choice(3, p=(0.25, 0.6, 0.15))))
    syllables = tuple(_syllable(rng, index == stress, index == 0) for index in range(count))
    return Word(_spell(syllables), syllables, stress)


def _function_word(rng: np.random.Generator) -> Word:
    syllables = (_syllable(rng, stressed=False, initial=True, short=True),)
    return Word(_spell(syllables), syllables, -1)


def _zipf(count: int) -> Float[np.ndarray, " C"]:
    weights = 1.0 / (np.arange(count) + 2.7)
    return weights / weights.sum()


@lru_cache(maxsize=1)
def lexicon() -> Lexicon:
    """The language's words: 36 function words and 700 content words, all spelled differently."""
    rng = np.random.default_rng(LEXICON_SEED)
    taken: set[str] = set()
    function: list[Word] = []
    content: list[Word] = []
    for words, count, make in ((function, 36, _function_word), (content, 700, _content_word)):
        while len(words) < count:
            word = make(rng)
            if word.text not in taken:
                taken.add(word.text)
                words.append(word)
    return Lexicon(tuple(function), tuple(content), _zipf(len(function)), _zipf(len(content)))


def draw_group(rng: np.random.Generator) -> tuple[Word, ...]:
    """A run of zero to two function words and one or two content words, as in "of the old house"."""
    words = lexicon()
    n_function = int(rng.choice(3, p=(0.22, 0.5, 0.28)))
    n_content = 1 + int(rng.random() < 0.25)
    function = rng.choice(len(words.function), size=n_function, replace=False, p=words.function_probability)
    content = rng.choice(len(words.content), size=n_content, replace=False, p=words.content_probability)
    return (*(words.function[i] for i in function), *(words.content[i] for i in content))
