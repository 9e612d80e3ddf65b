"""Labels and words of recordings as one row a frame."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool, Int32

from a2g_jax.io.transcripts import FRAME_SLACK, words_at_frames
from a2g_jax.io.words import Word, word_id


def label_rows(
    emotions: Sequence[str], speakers: Sequence[str], recordings: Sequence[tuple[str, str, int]]
) -> Int32[np.ndarray, "N 2"]:
    """Indices of emotion and speaker for the rows of recordings.

    Args:
        emotions: in the order of their indices; so are the speakers.
        recordings: each ``(emotion, speaker, frames)``.
    """
    each = [(emotions.index(emotion), speakers.index(speaker)) for emotion, speaker, _ in recordings]
    table = np.array(each, np.int32).reshape(-1, 2)
    return np.repeat(table, [frames for *_, frames in recordings], axis=0)


def word_rows(
    words: Sequence[dict[str, Any]], fps: float, frames: int
) -> tuple[Int32[np.ndarray, " T"], Bool[np.ndarray, " T"]]:
    """Ids of the words that are spoken at each frame, and whether a word starts within it.

    Frame k lasts from time ``k / fps`` to the next frame's. A word has the frame within which it starts and those at
    whose times it is spoken. So the words at their start frames (EmotionGesture's transcript) are the ids where a word
    starts, and 0 elsewhere. Of several words that start within one frame, the last one has it.

    Args:
        words: annotations, each with ``text``, ``start`` and ``end`` in seconds.
    """
    spoken = [Word(word["text"], float(word["start"]), float(word["end"])) for word in words]
    index = words_at_frames(spoken, fps, frames)
    ids = np.array([*(word_id(word.text) for word in spoken), 0], np.int32)
    rows, starts = ids[index], np.zeros(frames, bool)
    for number in sorted(range(len(spoken)), key=lambda number: spoken[number].start):
        first = math.floor(spoken[number].start * fps + FRAME_SLACK)
        if 0 <= first < frames:
            rows[first], starts[first] = ids[number], True
    return rows, starts
