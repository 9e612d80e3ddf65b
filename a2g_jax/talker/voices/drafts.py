"""What is said, and how long: clauses in the library's flat voice, with accents and lengthening."""

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.talker.languages import Language
from a2g_jax.talker.plan import AccentClock, draw_pause
from a2g_jax.talker.voices.library import Espeak, Utterance
from a2g_jax.talker.voices.sentences import Clause, divide, draw_sentence, function_words
from a2g_jax.talker.voices.syllables import SpokenWord, spoken_words

_ACCENT_STRETCH = 0.25  # a full accent makes its syllable longer by this share
_NUCLEUS_GAP = 0.6  # seconds since the last strong accent before the last content word of a sentence has one for sure
_TRIES = 6  # sentences tried for the remaining time
_LONGEST_EXTRA = 0.5  # seconds that time left over may add to a pause
_CLAUSE_TEMPO = 0.06
_HURRY = 1.12  # if not even a short sentence fits into a recording, it is said faster


@dataclass(frozen=True)
class SpokenClause:
    """A clause before it has a place in time."""

    utterance: Utterance
    words: tuple[SpokenWord, ...]
    accents: tuple[float, ...]
    """Prominence of each word's stressed syllable; 0 for none."""
    ending: str
    source: tuple[float, ...]
    """Borders of its syllables in the utterance, seconds."""
    target: tuple[float, ...]
    """The same borders after lengthening, from 0."""

    @property
    def seconds(self) -> float:
        """Length after lengthening."""
        return self.target[-1]


@dataclass(frozen=True)
class Delivery:
    """How a recording is spoken."""

    language: Language
    voice: str
    """The library's name of the voice."""
    rate: float
    """Words a minute."""
    pitch: int
    """0 to 100."""
    pausing: float
    """Factor on the length of pauses."""


def stressed_syllable(word: SpokenWord) -> int:
    """Which of a word's syllables is stressed: the first of those with the strongest mark."""
    marks = [syllable.stress for syllable in word.syllables]
    return marks.index(max(marks))


def speak_clause(library: Espeak, clause: Clause, delivery: Delivery, clock: AccentClock) -> SpokenClause:
    """One clause with accents on content words; the clock advances by its length."""
    utterance = library.speak(clause.text, delivery.voice, delivery.rate, delivery.pitch)
    words = spoken_words(clause.text, utterance)
    if not words:
        raise InputError(f"{library.version} gives no speech for {clause.text!r}.")
    unaccented = function_words(delivery.language.name)
    content = [index for index, word in enumerate(words) if word.text not in unaccented]
    accents, target = [0.0] * len(words), [0.0]
    for index, word in enumerate(words):
        stressed = stressed_syllable(word)
        if index in content:
            # The last content word of a sentence has the nuclear accent, unless an accent came just before.
            if index == content[-1] and clause.ending != "continuation" and clock.elapsed > _NUCLEUS_GAP:
                clock.gap = 0.0
            accents[index] = clock.accent()
        before = target[-1]
        for position, syllable in enumerate(word.syllables):
            stretch = 1.0 + _ACCENT_STRETCH * accents[index] * (position == stressed)
            target.append(target[-1] + stretch * (syllable.end - syllable.starts[0]))
        clock.advance(target[-1] - before)
    syllables = [syllable for word in words for syllable in word.syllables]
    source = (syllables[0].starts[0], *(syllable.end for syllable in syllables))
    return SpokenClause(utterance, words, tuple(accents), clause.ending, source, tuple(target))


def fill(
    library: Espeak, delivery: Delivery, seconds: float, clock: AccentClock, rng: np.random.Generator
) -> list[tuple[float, SpokenClause]]:
    """Clauses with their starts, from 0 and no later than ``seconds`` in all; time left over lengthens the pauses.

    Args:
        library: a fresh one.
        delivery: voice, rate and pauses.
        seconds: time to fill.
        clock: of the accents; advanced.
        rng: of texts and pauses.
    """
    placed: list[SpokenClause] = []
    pauses: list[float] = []
    time = 0.0
    for section, rate in _attempts(delivery.rate):
        if placed and rate > delivery.rate:
            break
        hurried = replace(delivery, rate=rate)
        while (sentence := _next_sentence(library, hurried, section, seconds - time, clock, rng)) is not None:
            clauses, gaps, clock = sentence
            placed += clauses
            pauses += gaps
            time += sum(clause.seconds for clause in clauses) + sum(gaps)
            clock.advance(gaps[-1])
    if not placed:
        raise InputError(f"{seconds:.2f} seconds are too short for a sentence.")
    return _spread(placed, pauses, seconds)


def recite(
    library: Espeak, delivery: Delivery, text: str, seconds: float, clock: AccentClock, rng: np.random.Generator
) -> list[tuple[float, SpokenClause]]:
    """Clauses of a given text with their starts, as :func:`fill`.

    Raises:
        InputError: the text is too long, or has no sentence.
    """
    placed, pauses = _say(library, delivery, divide(text), clock, rng)
    needed = sum(clause.seconds for clause in placed) + sum(pauses[:-1])
    if not placed or needed > seconds:
        raise InputError(f"the text needs {needed:.1f} seconds of speech; there are {seconds:.1f}.")
    return _spread(placed, pauses, seconds)


def _spread(placed: list[SpokenClause], pauses: list[float], seconds: float) -> list[tuple[float, SpokenClause]]:
    """Clauses with their starts; time left over lengthens the pauses."""
    spare = seconds - sum(clause.seconds for clause in placed) - sum(pauses[:-1])
    extra = min(_LONGEST_EXTRA, spare / max(1, len(pauses) - 1))
    steps = [clause.seconds + pause + extra for clause, pause in zip(placed[:-1], pauses[:-1], strict=True)]
    return list(zip(accumulate(steps, initial=0.0), placed, strict=True))


def _attempts(rate: float) -> Iterator[tuple[str, float]]:
    """Section of the grammar and rate: sentences, then short ones, then short ones said ever faster."""
    yield "sentence", rate
    for hurry in range(12):
        yield "short", rate * _HURRY**hurry


def _next_sentence(
    library: Espeak, delivery: Delivery, section: str, room: float, clock: AccentClock, rng: np.random.Generator
) -> tuple[list[SpokenClause], list[float], AccentClock] | None:
    """A sentence that fits into ``room`` seconds, the pauses after its clauses, and the clock after it; or None."""
    for _ in range(_TRIES):
        later = copy.copy(clock)
        clauses, pauses = _say(library, delivery, draw_sentence(delivery.language.name, rng, section), later, rng)
        if sum(clause.seconds for clause in clauses) + sum(pauses[:-1]) <= room:
            return clauses, pauses, later
    return None


def _say(
    library: Espeak, delivery: Delivery, text: tuple[Clause, ...], clock: AccentClock, rng: np.random.Generator
) -> tuple[list[SpokenClause], list[float]]:
    """Spoken clauses and the pause after each; the clock advances, but for the last pause."""
    clauses: list[SpokenClause] = []
    pauses: list[float] = []
    for clause in text:
        if pauses:
            clock.advance(pauses[-1])
        tempo = math.exp(_CLAUSE_TEMPO * float(np.clip(rng.standard_normal(), -2.0, 2.0)))
        clauses.append(speak_clause(library, clause, replace(delivery, rate=tempo * delivery.rate), clock))
        pauses.append(draw_pause(rng, clause.ending != "continuation", delivery.pausing))
    return clauses, pauses
