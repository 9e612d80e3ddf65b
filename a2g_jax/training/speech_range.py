"""The range of the speech of a corpus, and its file in the run folder."""

from pathlib import Path

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.speech_range import SpeechRange, range_from_json, range_of_speech
from a2g_jax.io.sealed import read_sealed, write_sealed
from a2g_jax.training.run_config import RunConfig
from a2g_jax.training.run_file import run_folder

#: Its name in the run folder.
SPEECH_FILE = "speech.json"
#: Entries of the file that have a checksum.
_SEALED_WITH = ("ranges",)
#: Most seconds of a corpus that are measured, and of its waveforms, whose pitch takes longer.
_MOST, _MOST_PITCH = 7200.0, 1800.0


def corpus_speech_range(corpus: Corpus, config: RunConfig) -> SpeechRange | None:
    """The range of the speech in the training split (:class:`~a2g_jax.features.speech_range.SpeechRange`).

    Of a long corpus every n-th stretch counts. The range of a run that started from another one includes that of the
    other.

    Returns:
        The range; None for less than about half a minute, where there is no other run.
    """
    own = _own_range(corpus)
    if config.source is None:
        return own
    before = read_speech_range(run_folder(config.source.run), config.mel)
    if before is None or own is None:
        return own or before
    return before.united(own)


def _own_range(corpus: Corpus) -> SpeechRange | None:
    if not corpus.splits.get("train"):
        return None
    segments, fps, mel = corpus.segments("train"), corpus.fps, corpus.mel
    seconds = sum(one.frames for one in segments) / fps
    chosen = segments[:: max(1, -int(-seconds // _MOST))]
    spoken = segments[:: max(1, -int(-seconds // _MOST_PITCH))] if _has_waveforms(corpus) else []
    rate = mel.sample_rate / fps
    waveforms = []
    for one in spoken:
        entry = corpus.recordings[one.recording]
        first = entry.first_sample + round((one.start - entry.first) * rate)
        waveforms.append(np.asarray(corpus.waveform[first : first + round(one.frames * rate)], np.float32) / 32767)
    return range_of_speech((corpus.audio[one.start : one.stop] for one in chosen), waveforms, mel, fps)


def _has_waveforms(corpus: Corpus) -> bool:
    return any(entry.samples for entry in corpus.recordings)


def write_speech_range(folder: Path, found: SpeechRange | None) -> None:
    """Write the file of a range, or delete that of an earlier training."""
    if found is None:
        (folder / SPEECH_FILE).unlink(missing_ok=True)
    else:
        write_sealed(folder / SPEECH_FILE, found.to_json())


def read_speech_range(folder: Path, mel: MelConfig) -> SpeechRange | None:
    """The range in a run folder; None where it has none.

    Raises:
        InputError: a damaged file.
    """
    path = folder / SPEECH_FILE
    if not path.is_file():
        return None
    return range_from_json(read_sealed(path, _SEALED_WITH), mel.bands, str(path))
