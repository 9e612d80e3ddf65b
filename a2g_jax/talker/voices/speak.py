"""Speech plan and audio of a recording in a real language.

The library speaks each clause on one pitch. What speaker, emotion and accents do to it is ours, and the same as for the
invented voice (:mod:`a2g_jax.talker.prosody`): melody, level, lengthening, irregular periods, spectral slope, breath.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import soxr
from jaxtyping import Float
from scipy.ndimage import uniform_filter1d

from a2g_jax.errors import InputError
from a2g_jax.talker.articulation import TRACK_RATE
from a2g_jax.talker.emotions import scaled
from a2g_jax.talker.languages import LANGUAGES, Language
from a2g_jax.talker.plan import EMOTION_STRENGTH, SHORTEST_RECORDING, TEMPO_SPREAD, AccentClock, look_up
from a2g_jax.talker.prosody import accent_gain, creak_contour, pitch_contour
from a2g_jax.talker.speakers import SPEAKERS, session_voice
from a2g_jax.talker.speech import Phrase, PlannedWord, SpeechPlan, Syllable
from a2g_jax.talker.voice import CREAK_F0, SPEECH_DBFS, active_rms, breath_amplitude, limit_peaks, room_noise
from a2g_jax.talker.voices.drafts import Delivery, SpokenClause, fill, recite, stressed_syllable
from a2g_jax.talker.voices.library import espeak
from a2g_jax.talker.voices.psola import find_marks, revoice
from a2g_jax.talker.voices.timbre import breath, breathing, tilted


@dataclass(frozen=True)
class _Variant:
    """A voice of the library for a speaker."""

    name: str
    middle_hz: float
    """Its pitch at the parameter's middle, 50."""


_VARIANTS = {
    "ada": _Variant("steph", 174.0),
    "bruno": _Variant("m8", 74.0),
    "chiara": _Variant("Andrea", 223.0),
    "david": _Variant("m3", 91.0),
    "elif": _Variant("f1", 160.0),
    "felix": _Variant("ed", 107.0),
}
_OCTAVES = 0.9  # of the library's pitch between the middle and either end of the parameter
_WORDS_PER_SYLLABLE_RATE = 34.0  # words a minute, as the library counts, for one English syllable a second
_USUAL_TILT = -6.8  # dB per octave of a speaker whose slope is that of the library
_PEAK_SECONDS = 0.025


def speak(
    seconds: float,
    speaker: str,
    emotion: str,
    language: str,
    rng: np.random.Generator,
    sample_rate: int = 16000,
    text: str | None = None,
) -> tuple[SpeechPlan, Float[np.ndarray, " N"]]:
    """Draw what is said and how, and say it; the same arguments give the same speech.

    Args:
        seconds: length, at least :data:`~a2g_jax.talker.plan.SHORTEST_RECORDING`.
        speaker: a name in :data:`~a2g_jax.talker.speakers.SPEAKERS`.
        emotion: a name in :data:`~a2g_jax.talker.emotions.VOICE_EMOTIONS`.
        language: a name in :data:`~a2g_jax.talker.languages.LANGUAGES`.
        rng: of everything random.
        sample_rate: of the audio, Hz; the plan does not depend on it.
        text: sentences to say, with punctuation; None for random ones.

    Returns:
        The plan, whose syllables' peaks are where the audio has most energy, and the audio (float32,
        ``round(seconds * sample_rate)`` samples, peak below 1).

    Raises:
        InputError: unknown names, too short (also for the text), or the extra ``voices`` is missing.
    """
    nominal, mood = look_up(speaker, emotion)
    if language not in LANGUAGES:
        raise InputError(f"unknown language {language!r}: use one of {', '.join(LANGUAGES)}")
    if not (math.isfinite(seconds) and seconds >= SHORTEST_RECORDING):
        raise InputError(f"seconds is {seconds}: speech needs at least {SHORTEST_RECORDING:g}")
    choices, texts, accents, session, level_rng, creak_rng, melody, renderer, noises = rng.spawn(9)
    strength = float(choices.uniform(*EMOTION_STRENGTH))
    mood = scaled(mood, strength)
    style = session_voice(nominal, session)
    median = style.median_f0_hz * 2.0 ** (mood.f0_shift_semitones / 12.0)
    delivery = _delivery(LANGUAGES[language], speaker, median, mood.rate_factor, mood.pause_factor, choices)
    slack = min(1.0, (seconds - SHORTEST_RECORDING) / 2.0)
    before, after = (0.3 + 0.5 * slack * choices.random(2)).tolist()
    with espeak() as library:
        clock, room = AccentClock(accents, mood.accent_density), seconds - before - after
        if text is None:
            clauses = fill(library, delivery, room, clock, texts)
        else:
            clauses = recite(library, delivery, text, room, clock, texts)
        synthesizer = f"{library.version}, {delivery.voice}"
        rate = library.sample_rate
    placed = [(before + start, clause) for start, clause in clauses]
    plan = _plan(SpeechPlan(seconds, speaker, emotion, (), (), (), strength, language, synthesizer), placed)

    times = np.arange(int(seconds * TRACK_RATE) + 1) / TRACK_RATE
    f0 = pitch_contour(plan, style, mood, times, melody, consonants=False)
    f0 *= CREAK_F0 ** creak_contour(plan, times, creak_rng)
    audio = np.zeros(round(seconds * rate), np.float32)
    for start, clause in placed:
        sound = revoice(
            find_marks(clause.utterance.audio, rate),
            np.array(clause.source),
            np.array(clause.target),
            times,
            np.interp(times + start, times, f0),
            # The variant has the speaker's usual size.
            style.tract_length / nominal.tract_length,
            style.jitter * mood.jitter_factor,
            style.shimmer_db * mood.jitter_factor,
            renderer,
        )
        first = round(start * rate)
        sound = sound[: len(audio) - first]
        audio[first : first + len(sound)] += sound
    audio = tilted(audio, rate, style.tilt_db_per_octave - _USUAL_TILT + mood.tilt_db_per_octave)
    audio += breath(audio, rate, style.breathiness_db + mood.breathiness_db, noises)
    gain = 10.0 ** (accent_gain(plan, times, level_rng) / 20.0)
    moments = np.arange(len(audio)) / rate
    audio *= np.interp(moments, times, gain).astype(np.float32)
    plan = _with_peaks(plan, audio, rate)
    audio *= np.float32(_amplitude(style.loudness_db + mood.loudness_db) / max(active_rms(audio, plan, rate), 1e-9))
    audio += breathing(np.interp(moments, times, breath_amplitude(plan, times, noises)), rate, noises)
    return plan, _finished(audio, rate, round(seconds * sample_rate), sample_rate, noises)


def _amplitude(db: float) -> float:
    return 10.0 ** ((SPEECH_DBFS + db) / 20.0)


def _delivery(
    language: Language, speaker: str, median_hz: float, rate: float, pause: float, rng: np.random.Generator
) -> Delivery:
    style, variant = SPEAKERS[speaker], _VARIANTS[speaker]
    dialect = language.dialects[rng.integers(len(language.dialects))]
    tempo = math.exp(TEMPO_SPREAD * float(np.clip(rng.standard_normal(), -2.0, 2.0)))
    return Delivery(
        language=language,
        voice=f"{dialect}+{variant.name}",
        rate=_WORDS_PER_SYLLABLE_RATE * style.syllable_rate * rate * tempo,
        # Near the wanted pitch, so that the periods change little.
        pitch=int(np.clip(round(50.0 + 50.0 / _OCTAVES * math.log2(median_hz / variant.middle_hz)), 0, 99)),
        pausing=style.pause_factor * pause * math.exp(0.12 * rng.standard_normal()),
    )


def _plan(empty: SpeechPlan, placed: list[tuple[float, SpokenClause]]) -> SpeechPlan:
    """An empty plan filled with the clauses; the energy peaks are guesses, in the first half of the vowels."""
    phrases: list[Phrase] = []
    words: list[PlannedWord] = []
    syllables: list[Syllable] = []
    for start, clause in placed:
        number = 0
        for word, accent in zip(clause.words, clause.accents, strict=True):
            stressed = stressed_syllable(word)
            first = len(syllables)
            for position, syllable in enumerate(word.syllables):
                onset, end = (start + clause.target[number + k] for k in (0, 1))
                bounds = [start + float(t) for t in np.interp(syllable.starts, clause.source, clause.target)] + [end]
                vowel = bounds[syllable.vowel], bounds[syllable.vowel + 1]
                marked = position == stressed and (accent > 0.0 or syllable.stress == 2)
                syllables.append(
                    Syllable(
                        onset=onset,
                        peak=vowel[0] + 0.4 * (vowel[1] - vowel[0]),
                        end=end,
                        phones=syllable.phones,
                        stress=int(marked),
                        accent=accent if position == stressed else 0.0,
                        word=len(words),
                        phone_ends=tuple(bounds[1:]),
                    )
                )
                number += 1
            words.append(PlannedWord(word.text, syllables[first].onset, syllables[-1].end, len(phrases)))
        phrases.append(Phrase(start, start + clause.seconds, clause.ending))
    return replace(empty, phrases=tuple(phrases), words=tuple(words), syllables=tuple(syllables))


def _with_peaks(plan: SpeechPlan, audio: Float[np.ndarray, " N"], rate: int) -> SpeechPlan:
    """The plan with each syllable's peak where the audio's energy, in windows of 25 ms, is largest."""
    energy = uniform_filter1d(np.square(audio, dtype=np.float64), int(_PEAK_SECONDS * rate), mode="constant")
    syllables = []
    for syllable in plan.syllables:
        low, high = (
            math.ceil(syllable.onset * rate),
            max(int(syllable.end * rate), math.ceil(syllable.onset * rate) + 1),
        )
        peak = (low + int(np.argmax(energy[low:high]))) / rate
        syllables.append(replace(syllable, peak=min(max(peak, syllable.onset), syllable.end)))
    return replace(plan, syllables=tuple(syllables))


def _finished(
    audio: Float[np.ndarray, " N"], rate: int, count: int, sample_rate: int, rng: np.random.Generator
) -> Float[np.ndarray, " M"]:
    """The audio at another rate, with the noise of the room and limited peaks."""
    changed = soxr.resample(audio, rate, sample_rate).astype(np.float32)
    changed = np.pad(changed, (0, max(0, count - len(changed))))[:count]
    return limit_peaks(changed + room_noise(count, sample_rate, rng))
