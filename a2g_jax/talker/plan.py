"""Speech plan of a recording: words, syllables, pauses and pitch accents, with their times."""

import math
from dataclasses import dataclass, replace

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.talker.emotions import VOICE_EMOTIONS, VoiceEmotion, scaled
from a2g_jax.talker.language import HESITATION, Topic, Word
from a2g_jax.talker.phones import PHONES
from a2g_jax.talker.speakers import SPEAKERS, VoiceStyle
from a2g_jax.talker.speech import Phrase, PlannedWord, SpeechPlan, Syllable

SHORTEST_RECORDING = 2.0
"""Shortest recording, seconds: a phrase between two silences."""

_MEAN_SYLLABLE = 0.187  # seconds at stretch 1 (stress, accents and final lengthening included): anchors the rates
SHORTEST_PAUSE = 0.2
_ROOM_FOR_ANOTHER = 2.2  # seconds: a pause and the shortest phrase
_SHORTEST_PHRASE, _LONGEST_PHRASE = 0.8, 5.5
_SHORTEST_ACCENT_GAP = 0.38
_ACCENT_GAP = 0.42  # seconds between strong accents before they wait for the next stressed syllable
_HESITATES_FIRST, _HESITATES_LATER = 0.08, 0.012  # chances of a filled pause before a group of words
EMOTION_STRENGTH = (0.75, 1.2)  # how strongly an emotion shows: differs from recording to recording
TEMPO_SPREAD = 0.05


@dataclass(frozen=True)
class _Drafted:
    """A word with its accent, before it has a place in time."""

    word: Word
    accent: float
    stretches: tuple[float, ...]
    """Further factor on the duration of each of its syllables."""


@dataclass(frozen=True)
class _Draft:
    """A phrase before it has a place in time."""

    words: list[_Drafted]
    stretch: float
    ending: str


def phone_spans(syllable: Syllable) -> tuple[tuple[str, float, float], ...]:
    """Symbol, start and end (seconds) of each phone of a syllable.

    In the invented language, vowels stretch most and plosives least.
    """
    if syllable.phone_ends:
        starts = (syllable.onset, *syllable.phone_ends[:-1])
        return tuple(zip(syllable.phones, starts, syllable.phone_ends, strict=True))
    phones = [PHONES[symbol] for symbol in syllable.phones]
    rigid = sum(phone.seconds * (1.0 - phone.elasticity) for phone in phones)
    elastic = sum(phone.seconds * phone.elasticity for phone in phones)
    stretch = (syllable.end - syllable.onset - rigid) / elastic
    spans, start = [], syllable.onset
    for phone in phones:
        end = start + phone.seconds * (1.0 + phone.elasticity * (stretch - 1.0))
        spans.append((phone.symbol, start, end))
        start = end
    return tuple(spans)


def _syllable_seconds(symbols: tuple[str, ...], stretch: float) -> float:
    return sum(PHONES[s].seconds * (1.0 + PHONES[s].elasticity * (stretch - 1.0)) for s in symbols)


def _place_peak(syllable: Syllable) -> Syllable:
    """The syllable with its energy peak in the vowel: a little before its middle, earlier in lengthened vowels."""
    start, end = next((a, b) for symbol, a, b in phone_spans(syllable) if PHONES[symbol].is_vowel)
    return replace(syllable, peak=start + min(0.45 * (end - start), 0.085))


def _time_words(words: list[_Drafted], stretch: float, first_word: int) -> tuple[list[Syllable], list[float]]:
    """Syllables of a phrase from time zero, and where each word ends. Stress, accents and the phrase's end lengthen."""
    syllables: list[Syllable] = []
    ends: list[float] = []
    time = 0.0
    for index, drafted in enumerate(words):
        word = drafted.word
        for position, symbols in enumerate(word.syllables):
            stressed = position == word.stress
            accent = drafted.accent if stressed else 0.0
            factor = (1.12 if stressed else 0.82) * (1.0 + 0.3 * accent) * drafted.stretches[position]
            if index == len(words) - 1:
                from_end = len(word.syllables) - 1 - position
                factor *= {0: 1.55, 1: 1.15}.get(from_end, 1.0)
            seconds = _syllable_seconds(symbols, stretch * factor)
            raw = Syllable(time, time, time + seconds, symbols, int(stressed), accent, first_word + index)
            syllables.append(_place_peak(raw))
            time += seconds
        ends.append(time)
    return syllables, ends


class AccentClock:
    """Choice of the content words with a strong accent: irregular, about one a second at density 1."""

    def __init__(self, rng: np.random.Generator, density: float) -> None:
        self.rng = rng
        self.density = density
        self.elapsed = math.inf  # the first content word of a recording is prominent
        self.gap = 0.0

    def advance(self, seconds: float) -> None:
        self.elapsed += seconds

    def accent(self) -> float:
        """Draw the accent of the next content word: 0, weak (below 0.4) or strong (0.5 and more)."""
        rng = self.rng
        if self.elapsed >= self.gap:
            self.elapsed = 0.0
            gap = _ACCENT_GAP / self.density * math.exp(0.45 * rng.standard_normal())
            if rng.random() < 0.12:  # a stretch of given information, which carries no strong accent
                gap *= 3.0
            self.gap = max(_SHORTEST_ACCENT_GAP, gap)
            return float(0.5 + 0.5 * rng.beta(1.5, 1.6))
        return float(0.4 * rng.beta(1.2, 2.0)) if rng.random() < 0.6 else 0.0


def _drafted(rng: np.random.Generator, word: Word, accent: float) -> _Drafted:
    usual = 2.6 if word is HESITATION else 1.0
    return _Drafted(word, accent, tuple((usual * np.exp(0.13 * rng.standard_normal(len(word.syllables)))).tolist()))


def _draft_phrase(
    rng: np.random.Generator, topic: Topic, clock: AccentClock, seconds: float, stretch: float
) -> list[_Drafted]:
    """Draw words until they last about ``seconds``, with occasional hesitations before a group of words."""
    words: list[_Drafted] = []
    time = 0.0
    while time < seconds:
        group = topic.group()
        if rng.random() < (_HESITATES_FIRST if not words else _HESITATES_LATER):
            group = (HESITATION, *group)
        for word in group:
            accent = clock.accent() if word.is_content else 0.0
            length = sum(_syllable_seconds(symbols, stretch) for symbols in word.syllables) * (1.0 + 0.25 * accent)
            words.append(_drafted(rng, word, accent))
            clock.advance(length)
            time += length
    return words


def _fit(words: list[_Drafted], stretch: float, room: float) -> list[_Drafted]:
    """Drop words from the end until the phrase, with its final lengthening, fits into ``room`` seconds."""
    while words and _time_words(words, stretch, 0)[1][-1] > room:
        words = words[:-1]
    while words and words[-1].word is HESITATION:
        words = words[:-1]
    return words


def draw_pause(rng: np.random.Generator, ends_sentence: bool, factor: float) -> float:
    """Draw a pause's length in seconds: 0.2 to 1.3, rarely up to 2.2; longer at the end of a sentence."""
    if rng.random() < 0.05:
        return float(rng.uniform(1.2, 2.2))
    median = 0.68 if ends_sentence else 0.36
    return float(np.clip(median * factor * math.exp(0.45 * rng.standard_normal()), SHORTEST_PAUSE, 1.3))


def _ending(rng: np.random.Generator) -> str:
    """Draw how a phrase ends; about half of the phrases continue their sentence in the next one."""
    draw = rng.random()
    return "continuation" if draw < 0.5 else "fall" if draw < 0.9 else "question"


def look_up(speaker: str, emotion: str) -> tuple[VoiceStyle, VoiceEmotion]:
    if speaker not in SPEAKERS:
        raise InputError(f"unknown speaker {speaker!r}: use one of {', '.join(SPEAKERS)}")
    if emotion not in VOICE_EMOTIONS:
        raise InputError(f"unknown emotion {emotion!r}: use one of {', '.join(VOICE_EMOTIONS)}")
    return SPEAKERS[speaker], VOICE_EMOTIONS[emotion]


def plan_speech(seconds: float, speaker: str, emotion: str, rng: np.random.Generator) -> SpeechPlan:
    """Draw the speech plan of a recording.

    Phrases last 0.8 to 5.5 s, pauses 0.2 to 1.3 s (one in twenty up to 2.2 s). The recording starts and ends with
    0.3 to 0.8 s of silence. The last phrase is cut at a word's end, and the remaining time lengthens the pauses, or
    the final silence where there is no pause. Recordings of a few seconds may hold one shorter phrase.

    Args:
        seconds: length of the recording, at least :data:`SHORTEST_RECORDING`.
        speaker: a name in :data:`SPEAKERS`.
        emotion: a name in :data:`VOICE_EMOTIONS`.
        rng: the only source of randomness.

    Raises:
        InputError: unknown speaker or emotion, or too short for a phrase.
    """
    style, mood = look_up(speaker, emotion)
    if not (math.isfinite(seconds) and seconds >= SHORTEST_RECORDING):
        raise InputError(f"seconds is {seconds}: speech needs at least {SHORTEST_RECORDING:g}")
    strength = float(rng.uniform(*EMOTION_STRENGTH))
    mood = scaled(mood, strength)
    # A speaker's tempo differs from recording to recording.
    tempo = math.exp(TEMPO_SPREAD * float(np.clip(rng.standard_normal(), -2.0, 2.0)))
    pausing = style.pause_factor * mood.pause_factor * math.exp(0.12 * rng.standard_normal())
    base_stretch = 1.0 / (_MEAN_SYLLABLE * style.syllable_rate * mood.rate_factor * tempo)
    topic = Topic(rng)
    clock = AccentClock(rng, mood.accent_density)
    slack = min(1.0, (seconds - SHORTEST_RECORDING) / 2.0)  # short recordings get short silences
    starts = [0.3 + 0.5 * slack * float(rng.random())]
    limit = seconds - 0.3 - 0.5 * slack * float(rng.random())

    drafts: list[_Draft] = []
    time = starts[0]
    while True:
        stretch = base_stretch * math.exp(0.08 * rng.standard_normal())
        target = float(np.clip(style.phrase_seconds * math.exp(0.5 * rng.standard_normal()), 0.9, 4.8))
        room = limit - time
        if room < target + _ROOM_FOR_ANOTHER:
            # No room for a pause and another phrase: fill it up, or leave just enough for both.
            target = room if room <= _LONGEST_PHRASE else room - _ROOM_FOR_ANOTHER
        words = _draft_phrase(rng, topic, clock, target, stretch)
        words = _fit(words, stretch, min(_LONGEST_PHRASE, room))
        length = _time_words(words, stretch, 0)[1][-1] if words else 0.0
        if words and target == room:
            stretch *= min(1.15, room / length)
            length = _time_words(words, stretch, 0)[1][-1]
        if length < _SHORTEST_PHRASE and room > _ROOM_FOR_ANOTHER:
            continue
        if drafts and length < _SHORTEST_PHRASE:
            starts.pop()
            break
        if not words:
            continue
        drafts.append(_Draft(words, stretch, _ending(rng)))
        time += length
        pause = draw_pause(rng, drafts[-1].ending != "continuation", pausing)
        pause = max(SHORTEST_PAUSE, min(pause, limit - time - _SHORTEST_PHRASE))
        clock.advance(pause)
        time += pause
        starts.append(time)
        if limit - time < _SHORTEST_PHRASE:
            starts.pop()
            break
    drafts[-1] = replace(drafts[-1], ending="fall")
    return _assemble(SpeechPlan(seconds, style.name, mood.name, (), (), (), strength), limit, starts, drafts)


def _assemble(empty: SpeechPlan, limit: float, starts: list[float], drafts: list[_Draft]) -> SpeechPlan:
    """An empty plan filled with the drafted phrases; time left before ``limit`` lengthens the pauses."""
    phrases: list[Phrase] = []
    words: list[PlannedWord] = []
    syllables: list[Syllable] = []
    last = _time_words(drafts[-1].words, drafts[-1].stretch, 0)[1][-1]
    extra = (limit - starts[-1] - last) / max(1, len(drafts) - 1)
    for index, draft in enumerate(drafts):
        start = starts[index] + index * extra
        timed, ends = _time_words(draft.words, draft.stretch, len(words))
        syllables += [replace(s, onset=s.onset + start, peak=s.peak + start, end=s.end + start) for s in timed]
        for word, begin, end in zip(draft.words, [0.0, *ends[:-1]], ends, strict=True):
            words.append(PlannedWord(word.word.text, start + begin, start + end, index))
        phrases.append(Phrase(start, start + ends[-1], draft.ending))
    return replace(empty, phrases=tuple(phrases), words=tuple(words), syllables=tuple(syllables))
