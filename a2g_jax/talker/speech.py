"""What is said: the plan that both the voice and the gestures of the generated corpus follow.

The plan is everything that audio determines. The voice renders it; gestures take their timing and strength from it,
and draw everything else (see :mod:`a2g_jax.talker.truth`) from their own key.
"""

from dataclasses import dataclass

ENDINGS = ("fall", "continuation", "question")
"""How the melody of a phrase ends: a final fall, a small rise that says there is more to come, or a high rise."""


@dataclass(frozen=True)
class Syllable:
    """One syllable of the plan; times in seconds from the start of the recording."""

    onset: float
    """Where its first consonant starts (or its vowel, if it has none)."""
    peak: float
    """Where its energy is largest: the moment gestures are timed against."""
    end: float
    phones: tuple[str, ...]
    stress: int
    """0 unstressed, 1 lexically stressed."""
    accent: float
    """Prominence of its pitch accent, 0 (none) to 1 (emphatic): decides whether a stroke falls here, and how large."""
    word: int
    """Index into :attr:`SpeechPlan.words`."""


@dataclass(frozen=True)
class PlannedWord:
    """One word of the invented language; times in seconds."""

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
    """One of :data:`ENDINGS`; only a continuation goes on with the same sentence."""


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
    """How strongly the emotion shows in the voice: multiplies its deviation from neutral."""
