"""Random sentences of a language, from a grammar in ``texts/``."""

import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

_SLOT = re.compile(r"\{(\w+)\}")
_CLAUSE = re.compile(r"[^,.?!]+[,.?!]")
_ENDINGS = {",": "continuation", "?": "question"}
_PUNCTUATION = ",.?!¿¡;:"


@dataclass(frozen=True)
class Clause:
    """Words that are spoken without a pause."""

    text: str
    """With its punctuation, as the library reads it."""
    ending: str
    """One of :data:`~a2g_jax.talker.speech.ENDINGS`."""


@cache
def grammar(language: str) -> dict[str, tuple[str, ...]]:
    """Lines of each section of a language's file; ``sentence`` and ``short`` are where sentences start."""
    sections: dict[str, list[str]] = {}
    name = ""
    for line in files(__package__).joinpath("texts", f"{language}.txt").read_text(encoding="utf-8").splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        if line.startswith("["):
            name = line.strip("[] ")
        sections.setdefault(name, []).append(line.strip())
    return {name: tuple(lines[1:]) for name, lines in sections.items()}


@cache
def function_words(language: str) -> frozenset[str]:
    """Words that carry no pitch accent: articles, pronouns, prepositions, auxiliaries."""
    return frozenset(" ".join(grammar(language)["function"]).split())


def draw_sentence(language: str, rng: np.random.Generator, section: str = "sentence") -> tuple[Clause, ...]:
    """Draw a sentence, divided into clauses. No line of the grammar occurs twice in it while there are others."""
    text = _expand(grammar(language), section, rng, set())
    return divide(text[0].upper() + text[1:])


def divide(text: str) -> tuple[Clause, ...]:
    """The clauses of a text that ends with punctuation: what is between commas, stops and marks."""
    clauses = [clause.strip() for clause in _CLAUSE.findall(text)]
    return tuple(Clause(clause, _ENDINGS.get(clause[-1], "fall")) for clause in clauses)


def _expand(sections: dict[str, tuple[str, ...]], name: str, rng: np.random.Generator, used: set[str]) -> str:
    """A random line of a section, its slots filled; ``used`` gains the lines."""
    lines = [line for line in sections[name] if line not in used] or sections[name]
    line = lines[rng.integers(len(lines))]
    used.add(line)
    return _SLOT.sub(lambda slot: _expand(sections, slot[1], rng, used), line)


def plain(token: str) -> str:
    """A word as the plan has it: in small letters, without punctuation."""
    return token.strip(_PUNCTUATION).lower()
