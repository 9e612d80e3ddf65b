"""A piece of a recording."""

from dataclasses import replace
from typing import Any, TypeVar

from a2g_jax.errors import InputError
from a2g_jax.recording import PoseRecording, Recording, Word

AnyRecording = TypeVar("AnyRecording", bound=Recording | PoseRecording)


def cut(recording: AnyRecording, start: float, end: float | None = None) -> AnyRecording:
    """The recording from ``start`` to ``end`` (None: to its end), seconds, with times relative to ``start``.

    Words and timed labels (annotations that are lists of entries with ``start`` and ``end``) are cut at both ends. The
    piece ends with the recording if ``end`` is later.

    Raises:
        InputError: no motion or no audio in the piece.
    """
    motion, rate = recording.motion, recording.sample_rate
    stop = max(motion.seconds, len(recording.audio) / rate) if end is None else end
    moved = motion.clip(round(start * motion.fps), round(stop * motion.fps))
    audio = recording.audio[round(start * rate) : round(stop * rate)]
    if moved.frames == 0 or len(audio) == 0:
        raise InputError(
            f"{', '.join(recording.sources) or recording.name}: {motion.seconds:.2f} s of motion and "
            f"{len(recording.audio) / rate:.2f} s of audio; expected more than {start} s, where the piece "
            f"{recording.name} starts; download cut files again."
        )
    words = tuple(
        Word(word.text, max(word.start - start, 0.0), min(word.end, stop) - start)
        for word in recording.words
        if word.end > start and word.start < stop
    )
    annotations = {name: _shifted(value, start, stop) for name, value in recording.annotations.items()}
    changes: dict[str, Any] = {"motion": moved, "audio": audio, "words": words, "annotations": annotations}
    return replace(recording, **changes)


def _shifted(value: Any, start: float, stop: float) -> Any:
    timed = isinstance(value, list) and all(isinstance(each, dict) and {"start", "end"} <= set(each) for each in value)
    if not timed:
        return value
    return [
        {**each, "start": max(each["start"] - start, 0.0), "end": min(each["end"], stop) - start}
        for each in value
        if each["end"] > start and each["start"] < stop
    ]
