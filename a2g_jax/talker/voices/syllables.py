"""Words and syllables of a spoken clause, from the phonemes' times."""

import re
from dataclasses import dataclass, replace
from itertools import islice

from a2g_jax.talker.voices.library import Phoneme, Utterance
from a2g_jax.talker.voices.sentences import plain

_VOWELS = frozenset("iyɨʉɯuɪʏʊeøɘɵɤoəɛœɜɞʌɔæɐaɶɑɒᵻɚɝ")
_SYLLABIC = "\u0329"
_LIQUIDS = frozenset("lɫrɹɾʁʀjwɥ")  # may follow an obstruent in an onset
_OBSTRUENTS = frozenset("pbtdkɡgfvθðβɣ")
_SHORTEST = 0.004  # seconds of a phone


@dataclass(frozen=True)
class SpokenSyllable:
    """A syllable; times in seconds of the utterance."""

    phones: tuple[str, ...]
    starts: tuple[float, ...]
    """Where each phone starts."""
    end: float
    vowel: int
    """Which of the phones is the nucleus."""
    stress: int
    """0 none, 1 secondary, 2 primary."""


@dataclass(frozen=True)
class SpokenWord:
    """A word with its syllables, one at least."""

    text: str
    syllables: tuple[SpokenSyllable, ...]


def is_vowel(ipa: str) -> bool:
    """Whether a phoneme is the nucleus of a syllable: a vowel or a syllabic consonant."""
    return ipa[:1] in _VOWELS or _SYLLABIC in ipa


def spoken_words(text: str, utterance: Utterance) -> tuple[SpokenWord, ...]:
    """Words of a clause with their syllables; every word has a vowel.

    The library speaks some groups of words, such as "of the", as one: their syllables are shared out, one to each of
    the later words. Words without a vowel of their own join their neighbour.
    """
    tokens = [(match.start(), plain(match[0])) for match in re.finditer(r"\S+", text) if plain(match[0])]
    starts = dict(utterance.words)
    groups: list[tuple[list[str], list[Phoneme]]] = []
    for index, (first, token) in enumerate(tokens):
        last = tokens[index + 1][0] if index + 1 < len(tokens) else len(text) + 1
        phonemes = [phoneme for phoneme in utterance.phonemes if first <= phoneme.character < last]
        # Leading punctuation, as in Spanish, belongs to the first word.
        if not groups:
            phonemes = [phoneme for phoneme in utterance.phonemes if phoneme.character < last]
        if any(is_vowel(phoneme.ipa) for phoneme in phonemes) or not groups:
            groups.append(([token], phonemes))
        else:
            groups[-1] = ([*groups[-1][0], token], groups[-1][1] + phonemes)
    following = [group[1][0].start for group in groups[1:] if group[1]]
    words: list[SpokenWord] = []
    for (texts, phonemes), end in zip(groups, [*following, utterance.end], strict=False):
        # A stop's event is its burst: where the closure before it starts, the library's event of the word tells.
        begin = min(phonemes[0].start, starts.get(phonemes[0].character, phonemes[0].start)) if phonemes else 0.0
        words += _share(texts, _syllables(phonemes, begin, end))
    return _touching(words)


def _touching(words: list[SpokenWord]) -> tuple[SpokenWord, ...]:
    """The words, each syllable ending where the next starts, and no phone shorter than :data:`_SHORTEST`.

    The library may start two phonemes at the same moment, or a word's closure with the phoneme before it.
    """
    syllables = [syllable for word in words for syllable in word.syllables]
    bounds = [start for syllable in syllables for start in syllable.starts]
    bounds += [syllable.end for syllable in syllables[-1:]]
    for index in range(1, len(bounds)):
        bounds[index] = max(bounds[index], bounds[index - 1] + _SHORTEST)
    timed, first = [], 0
    for syllable in syllables:
        last = first + len(syllable.starts)
        timed.append(replace(syllable, starts=tuple(bounds[first:last]), end=bounds[last]))
        first = last
    remaining = iter(timed)
    return tuple(SpokenWord(word.text, tuple(islice(remaining, len(word.syllables)))) for word in words)


def _share(texts: list[str], syllables: list[SpokenSyllable]) -> list[SpokenWord]:
    if not syllables:
        return []
    if len(syllables) < len(texts):
        return [SpokenWord(" ".join(texts), tuple(syllables))]
    first = len(syllables) - len(texts) + 1
    return [
        SpokenWord(texts[0], tuple(syllables[:first])),
        *(SpokenWord(text, (syllable,)) for text, syllable in zip(texts[1:], syllables[first:], strict=True)),
    ]


def _syllables(phonemes: list[Phoneme], begin: float, end: float) -> list[SpokenSyllable]:
    """Divide a word: a consonant between vowels begins the next syllable, an obstruent before a liquid with it."""
    nuclei = [index for index, phoneme in enumerate(phonemes) if is_vowel(phoneme.ipa)]
    if not nuclei:
        return []
    edges = [0]
    for before, after in zip(nuclei[:-1], nuclei[1:], strict=True):
        edge = after if after == before + 1 else after - 1
        if edge - 1 > before and phonemes[edge].ipa[0] in _LIQUIDS and phonemes[edge - 1].ipa[0] in _OBSTRUENTS:
            edge -= 1
        edges.append(edge)
    edges.append(len(phonemes))
    starts = [begin, *(phoneme.start for phoneme in phonemes[1:])]
    bounds = [*starts, end]
    return [
        SpokenSyllable(
            tuple(phoneme.ipa for phoneme in phonemes[low:high]),
            tuple(starts[low:high]),
            bounds[high],
            nucleus - low,
            phonemes[nucleus].stress,
        )
        for low, high, nucleus in zip(edges[:-1], edges[1:], nuclei, strict=True)
    ]
