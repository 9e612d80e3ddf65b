"""The speech of ``a2g demo``: a short English one that comes with the package.

It was made with the extra ``voices`` by

    python -m a2g_jax.talker.demo_speech

which writes ``demo/speech.flac`` and ``demo/speech.json`` beside this file anew.
"""

from dataclasses import asdict
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from a2g_jax.io.audio import read_audio, write_audio
from a2g_jax.io.files import read_json, write_json
from a2g_jax.recording import Recording, Word
from a2g_jax.talker.gestures import gesticulate
from a2g_jax.talker.speech import plan_from_json, plan_to_json
from a2g_jax.talker.truth import GestureTruth

DEMO_TEXT = (
    "Hello, and welcome. When people talk, their hands talk too. I can tell you the same story twice, and my hands will"
    " never move in the same way. Sometimes a small gesture is enough, sometimes it has to be enormous. But the strong"
    " words and the strong movements arrive together. Would you like to try it with your own voice?"
)
SAMPLE_RATE = 16000
_SECONDS, _SPEAKER, _EMOTION, _SEED = 20.0, "chiara", "neutral", 3
_AUDIO, _PLAN = "speech.flac", "speech.json"


def demo_speech() -> Recording:
    """The recording that ``a2g demo`` makes motions for, with a motion of the talker."""
    return demo_recording()[0]


def demo_recording(sample_rate: int = SAMPLE_RATE) -> tuple[Recording, GestureTruth]:
    """The recording of :func:`demo_speech` at a sample rate, and the hidden choices of its motion."""
    folder = files(__package__).joinpath("demo")
    with as_file(folder.joinpath(_AUDIO)) as audio, as_file(folder.joinpath(_PLAN)) as plan:
        sound, speech = read_audio(audio, sample_rate), plan_from_json(read_json(plan))
    motion, truth = gesticulate(speech, np.random.default_rng(_SEED))
    recording = Recording(
        name="demo",
        audio=sound,
        sample_rate=sample_rate,
        motion=motion,
        words=tuple(Word(word.text, word.start, word.end) for word in speech.words),
        speaker=speech.speaker,
        emotion=speech.emotion,
        annotations={"speech": plan_to_json(speech), "gestures": asdict(truth)},
    )
    return recording, truth


def _make(folder: Path) -> None:
    from a2g_jax.talker.voices.speak import speak

    rng = np.random.default_rng(_SEED)
    plan, audio = speak(_SECONDS, _SPEAKER, _EMOTION, "en", rng, SAMPLE_RATE, DEMO_TEXT)
    write_audio(folder / _AUDIO, audio, SAMPLE_RATE)
    write_json(folder / _PLAN, plan_to_json(plan))


if __name__ == "__main__":
    _make(Path(__file__).parent / "demo")
