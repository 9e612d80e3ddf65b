"""Conditioning from a corpus: labels, words and waveforms of a stretch, for the models that use them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.training.run_config import RunConfig


def corpus_condition(config: RunConfig, fields: Sequence[str], corpus: Corpus, start: int, stop: int) -> dict[str, Any]:
    """Fields of :class:`~a2g_jax.models.base.Condition` for rows ``start`` to ``stop`` of one recording.

    An emotion or speaker that the run was not trained on is left out, and so are words where no recording of the corpus
    has any. Audio features, seed poses, controls and latents are never among them.

    Args:
        config: of the run that is conditioned.
        fields: the model's ``condition_fields``.

    Raises:
        InputError: the model needs the waveform, and the corpus stores none.
    """
    emotions, speakers = (tuple(config.corpus.get(name, ())) for name in ("emotions", "speakers"))
    given: dict[str, Any] = {}
    emotion, speaker = (int(index) for index in corpus.labels[start])
    if "emotion" in fields and corpus.emotions[emotion] in emotions:
        weights = np.eye(len(emotions), dtype=np.float32)[emotions.index(corpus.emotions[emotion])]
        given["emotion"] = np.tile(weights, (stop - start, 1))
    if "speaker" in fields and corpus.speakers[speaker] in speakers:
        given["speaker"] = np.int32(speakers.index(corpus.speakers[speaker]))
    if "words" in fields and corpus.has_words:
        given["words"] = corpus.array("words")[start:stop]
    if "waveform" in fields:
        first = int(corpus.array("waveform_start")[start])
        samples = round((stop - start) * corpus.mel.sample_rate / corpus.fps)
        given["waveform"] = np.asarray(corpus.waveform[first : first + samples], np.float32) / 32768.0
    return given
