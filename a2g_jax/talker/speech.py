"""The speech plan, which both the voice and the gestures of the generated corpus follow.

It is everything that the audio determines. Gestures take their timing and size from it; everything else (see
:mod:`a2g_jax.talker.truth`) is drawn from a stream of its own.
"""

from dataclasses import asdict, dataclass
from typing import Any

from a2g_jax.talker.languages import INVENTED

ENDINGS = ("fall", "continuation", "question")
"""How the melody of a phrase ends: a final fall, a small rise before more of the sentence, or a high rise."""


@dataclass(frozen=True)
class Syllable:
    """One syllable of the plan; times in seconds from the start of the recording."""

    onset: float
    """Where its first consonant starts (or its vowel, if it has none)."""
    peak: float
    """Where its energy is largest: the reference for the times of gestures."""
    end: float
    phones: tuple[str, ...]
    stress: int
    """0 unstressed, 1 lexically stressed."""
    accent: float
    """Prominence of its pitch accent, 0 (none) to 1 (emphatic): determines whether there is a stroke, and its size."""
    word: int
    """Index into :attr:`SpeechPlan.words`."""
    phone_ends: tuple[float, ...] = ()
    """Where each phone ends, in a real language; the invented voice divides the syllable by a rule."""


@dataclass(frozen=True)
class PlannedWord:
    """One word, in small letters and without punctuation; times in seconds."""

    text: str
    start: float
    end: float
    phrase: int
    """Index into :attr:`SpeechPlan.phrases`."""


@dataclass(frozen=True)
class Phrase:
    """One breath group: speech without a pause in it; times in seconds."""

    start: float
    end: float
    ending: str = "fall"
    """One of :data:`ENDINGS`; the next phrase belongs to the same sentence only after a continuation."""


@dataclass(frozen=True)
class SpeechPlan:
    """A whole recording's speech."""

    seconds: float
    """Length of the audio, silence at both ends included."""
    speaker: str
    """Name of a speaker in :mod:`a2g_jax.talker.speakers`."""
    emotion: str
    """Name of an emotion in :mod:`a2g_jax.talker.emotions`."""
    phrases: tuple[Phrase, ...]
    words: tuple[PlannedWord, ...]
    syllables: tuple[Syllable, ...]
    strength: float = 1.0
    """Strength of the emotion in the voice: multiplies the deviation from neutral."""
    language: str = INVENTED
    """Name of a language in :mod:`a2g_jax.talker.languages`."""
    synthesizer: str = ""
    """Library and voice of a real language, such as ``"eSpeak NG 1.52.0, en-us+m3"``."""


def plan_to_json(plan: SpeechPlan) -> dict[str, Any]:
    """A plan as a dictionary for annotations and files; what only real languages have is left out of others."""
    value = asdict(plan)
    if plan.language == INVENTED:
        del value["language"], value["synthesizer"]
        for syllable in value["syllables"]:
            del syllable["phone_ends"]
    return value


def plan_from_json(value: dict[str, Any]) -> SpeechPlan:
    """A speech plan from the dictionary in a recording's annotations."""
    return SpeechPlan(
        **{
            **value,
            "phrases": tuple(Phrase(**phrase) for phrase in value["phrases"]),
            "words": tuple(PlannedWord(**word) for word in value["words"]),
            "syllables": tuple(_syllable(item) for item in value["syllables"]),
        }
    )


def _syllable(value: dict[str, Any]) -> Syllable:
    return Syllable(**{**value, "phones": tuple(value["phones"]), "phone_ends": tuple(value.get("phone_ends", ()))})
