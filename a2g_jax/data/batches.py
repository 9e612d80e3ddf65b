"""Random clips of a corpus, as a function of a key alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError
from a2g_jax.features.augment import augment_log_mel
from a2g_jax.features.statistics import Statistics


class Crops(NamedTuple):
    """Every place where a clip may start; a pytree."""

    first: Int[np.ndarray, " segments"]
    """First row of each stretch."""
    cumulative: Int[np.ndarray, " segments"]
    """Number of starts in the stretches up to and including each."""


def find_crops(corpus: Corpus, split: str, frames: int) -> Crops:
    """Starts of all clips of a length within one stretch of a split.

    Raises:
        InputError: no stretch is that long.
    """
    return crops_in(corpus.segments(split), frames, f"{corpus.path}: its longest {split} recording")


def crops_in(segments: list[Segment], frames: int, longest: str) -> Crops:
    """Starts of all clips of a length within one of the stretches.

    Args:
        segments: stretches as rows of the arrays.
        longest: name of the longest stretch, for the error.

    Raises:
        InputError: no stretch is that long.
    """
    most = max(segment.frames for segment in segments)
    if most < frames:
        raise InputError(
            f"{longest} has {most} frames, a clip has {frames}; prepare longer recordings or lower --clip-frames."
        )
    segments = [segment for segment in segments if segment.frames >= frames]
    counts = np.cumsum([segment.frames - frames + 1 for segment in segments])
    return Crops(np.array([segment.start for segment in segments], np.int32), counts.astype(np.int32))


def draw_starts(key: Key[Array, ""], crops: Crops, batch_size: int) -> Int[Array, " B"]:
    """First rows of B random clips, every start equally likely."""
    drawn = jax.random.randint(key, (batch_size,), 0, crops.cumulative[-1])
    segment = jnp.searchsorted(jnp.asarray(crops.cumulative), drawn, side="right")
    before = jnp.concatenate([jnp.zeros(1, jnp.int32), jnp.asarray(crops.cumulative)])[segment]
    return jnp.asarray(crops.first)[segment] + drawn - before


@dataclass(frozen=True)
class BatchMaker:
    """Makes the batch that a model is trained on of raw clips."""

    audio_statistics: Statistics
    augmentation: float
    """Strength of :func:`~a2g_jax.features.augment.augment_log_mel`; 0 for none."""

    def __call__(self, key: Key[Array, ""] | None, clips: Mapping[str, Any]) -> Batch:
        """Audio features normalised, and augmented when a key is given; waveforms from -1 to 1.

        Args:
            clips: raw fields, of :func:`a2g_jax.data.batch.gather_clips`.
        """
        audio = clips["audio"]
        if key is not None and self.augmentation > 0:
            keys = jax.random.split(key, audio.shape[0])
            audio = jax.vmap(lambda k, clip: augment_log_mel(k, clip, self.augmentation))(keys, audio)
        fields = {**clips, "audio": self.audio_statistics.normalise(audio)}
        if "waveform" in fields:
            fields["waveform"] = jnp.asarray(fields["waveform"], jnp.float32) / 32768.0
        return Batch(**fields)


def tiled_starts(corpus: Corpus, split: str, frames: int) -> Int[np.ndarray, " clips"]:
    """First rows of the clips that tile a split without overlap; a stretch's remainder is left out.

    A split whose stretches are all shorter than a clip gives none.
    """
    starts = [
        start for segment in corpus.segments(split) for start in range(segment.start, segment.stop - frames + 1, frames)
    ]
    return np.array(starts, np.int32)
