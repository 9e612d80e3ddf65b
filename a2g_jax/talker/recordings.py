"""Whole recordings of the generated corpus: a speech plan, its audio, and one of its many valid motions."""

import zlib
from dataclasses import asdict
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.recording import Recording, Word
from a2g_jax.talker.augment import augment
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.gestures import gesticulate
from a2g_jax.talker.languages import INVENTED, LANGUAGE_NAMES
from a2g_jax.talker.plan import plan_speech
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.talker.speech import SpeechPlan, plan_from_json, plan_to_json
from a2g_jax.talker.truth import GestureTruth
from a2g_jax.talker.voice import synthesise

#: Length of one recording of a corpus, seconds.
RECORDING_SECONDS = 60.0
# Streams of a recording's seed; new uses get new numbers, so that old seeds keep their meaning.
_SPEECH, _VOICE, _MOTION, _CAST, _ROOM, _LANGUAGE, _EMOTION = range(7)
#: Fields of recordings that take turns.
_TURNS = {"emotion": _EMOTION, "language": _LANGUAGE}


def talk(
    seconds: float,
    seed: int,
    *,
    speaker: str = "ada",
    emotion: str = "neutral",
    fps: float = 30.0,
    sample_rate: int = 16000,
    name: str = "",
    room: bool = False,
    fingers: bool = False,
    language: str = INVENTED,
) -> Recording:
    """Generate one recording: speech in an invented or a real language, with gestures.

    The same arguments always give the same recording. ``annotations`` holds the speech plan under ``"speech"`` and the
    ground truth of the motion under ``"gestures"``.

    Args:
        seconds: length, 2 or more.
        seed: of everything random.
        speaker: one of :data:`~a2g_jax.talker.speakers.SPEAKERS`.
        emotion: one of :data:`~a2g_jax.talker.emotions.VOICE_EMOTIONS`.
        room: as recorded by a random microphone in a random room with noise, instead of clean.
        fingers: use the skeleton with finger joints; the other joints move the same without.
        language: one of :data:`~a2g_jax.talker.languages.LANGUAGE_NAMES`; real ones need the extra ``voices``.

    Raises:
        InputError: unknown speaker, emotion or language, too short, or the extra ``voices`` is missing.
    """
    for kind, value, known in (
        ("speaker", speaker, SPEAKERS),
        ("emotion", emotion, VOICE_EMOTIONS),
        ("language", language, LANGUAGE_NAMES),
    ):
        if value not in known:
            raise InputError(f"no {kind} {value!r}; there are: {', '.join(known)}.")
    plan, audio = _speech(seconds, seed, speaker, emotion, language, sample_rate)
    motion, truth = gesticulate(plan, np.random.default_rng([seed, _MOTION]), fps, fingers)
    if room:
        audio = augment(audio, sample_rate, np.random.default_rng([seed, _ROOM]))
    return Recording(
        name=name or "_".join(["talker", str(seed), speaker, emotion, *([] if language == INVENTED else [language])]),
        audio=audio,
        sample_rate=sample_rate,
        motion=motion,
        words=tuple(Word(word.text, word.start, word.end) for word in plan.words),
        speaker=speaker,
        emotion=emotion,
        annotations={"speech": plan_to_json(plan), "gestures": asdict(truth)},
    )


def _speech(
    seconds: float, seed: int, speaker: str, emotion: str, language: str, sample_rate: int
) -> tuple[SpeechPlan, Float[np.ndarray, " N"]]:
    # With one seed, different speakers say different things, and so do different emotions and languages.
    role = zlib.crc32(f"{speaker}/{emotion}".encode())
    if language != INVENTED:
        from a2g_jax.talker.voices.speak import speak

        role = zlib.crc32(f"{speaker}/{emotion}/{language}".encode())
        return speak(seconds, speaker, emotion, language, np.random.default_rng([seed, _LANGUAGE, role]), sample_rate)
    plan = plan_speech(seconds, speaker, emotion, np.random.default_rng([seed, _SPEECH, role]))
    return plan, synthesise(plan, np.random.default_rng([seed, _VOICE, role]), sample_rate)


def resample_motion(recording: Recording, key: Any) -> tuple[Motion, GestureTruth]:
    """Another valid motion for the same audio: everything that the audio does not determine is drawn again.

    A sample of the true conditional distribution that a model of the corpus should learn. It has fingers if the
    recording's motion has them.

    Args:
        recording: made by :func:`talk`, or read back with its annotations.
        key: an integer or a typed JAX key.

    Raises:
        InputError: the recording is not a generated one.
    """
    if "speech" not in recording.annotations:
        raise InputError(f"{recording.name}: is not a generated recording, so its true distribution is unknown.")
    plan = plan_from_json(recording.annotations["speech"])
    words = (
        [int(key)] if isinstance(key, int | np.integer) else [int(word) for word in jax.random.key_data(key).ravel()]
    )
    fingers = recording.motion.skeleton.same_tree(TALKER_HANDS_SKELETON)
    return gesticulate(plan, np.random.default_rng([_MOTION, 1, *words]), recording.motion.fps, fingers)


def cast(
    minutes: float,
    seed: int,
    speakers: tuple[str, ...] = (),
    emotions: tuple[str, ...] = (),
    languages: tuple[str, ...] = (),
    equal_emotions: bool = False,
) -> list[dict[str, Any]]:
    """Speakers, emotions and seeds of a corpus: arguments of :func:`talk` for each recording, about a minute each.

    Speakers take turns in a shuffled order; emotions are drawn, neutral half of the time. Every other recording has
    the sound of a room, so that models trained on the corpus are not limited to studio recordings. Languages, if any
    are named, take turns in an order shuffled anew each round; speakers, emotions and seeds do not depend on them.
    With ``equal_emotions`` emotions take turns in the same way, and speakers and seeds are those without it.
    """
    speakers, emotions = speakers or tuple(SPEAKERS), emotions or tuple(VOICE_EMOTIONS)
    total = minutes * 60.0
    if total < 10.0:
        raise InputError(f"{minutes} minutes of talk are too few; use 0.2 or more.")
    count = max(1, round(total / RECORDING_SECONDS))
    rng = np.random.default_rng([seed, _CAST])
    roles = []
    for index in range(count):
        if index % len(speakers) == 0:
            order = rng.permutation(len(speakers))
        neutral = "neutral" in emotions and rng.random() < 0.5
        roles.append(
            {
                "seconds": total / count,
                "seed": int(rng.integers(2**31)),
                "speaker": speakers[order[index % len(speakers)]],
                "emotion": "neutral" if neutral else str(rng.choice(emotions)),
                "name": f"{index:04d}",
                "room": index % 2 == 1,
            }
        )
    turns = {"emotion": emotions if equal_emotions else (), "language": languages}
    for field, names in turns.items():
        if names:
            rng = np.random.default_rng([seed, _CAST, _TURNS[field]])
            rounds = [rng.permutation(len(names)) for _ in range(0, count, len(names))]
            for role, index in zip(roles, np.concatenate(rounds), strict=False):
                role[field] = names[index]
    return roles
