"""Random clips of a corpus, as a function of a key alone."""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Key

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
    """Starts of all clips of ``frames`` frames that lie within one stretch of a split.

    Raises:
        InputError: no stretch is that long.
    """
    return crops_in(corpus.segments(split), frames, f"{corpus.path}: its longest {split} recording")


def crops_in(segments: list[Segment], frames: int, longest: str) -> Crops:
    """Starts of all clips of ``frames`` frames that lie within one of the stretches.

    Args:
        segments: stretches as rows of the arrays.
        longest: what the longest stretch is, for the error.

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


def gather(array: Float[Array, "N *rest"], starts: Int[Array, " B"], frames: int) -> Float[Array, "B T *rest"]:
    """Clips of an array that lies on the device."""
    return jax.vmap(lambda start: jax.lax.dynamic_slice_in_dim(array, start, frames))(starts)


def gather_from_disk(
    array: Float[np.ndarray, "N *rest"], starts: Int[np.ndarray, " B"], frames: int
) -> Float[np.ndarray, "B T *rest"]:
    """Clips of an array that is too large for the device."""
    return np.stack([array[start : start + frames] for start in starts])


@dataclass(frozen=True)
class Dressing:
    """What happens to a raw clip before a model sees it."""

    audio_statistics: Statistics
    augmentation: float
    """Strength of :func:`~a2g_jax.features.augment.augment_log_mel`; 0 for none."""

    def __call__(
        self,
        key: Key[Array, ""] | None,
        audio: Float[Array, "B T width"],
        pose: Float[Array, "B T R D"],
        labels: Int[Array, "B 2"],
    ) -> Batch:
        """Normalised, and augmented when a key is given."""
        if key is not None and self.augmentation > 0:
            keys = jax.random.split(key, audio.shape[0])
            audio = jax.vmap(lambda k, clip: augment_log_mel(k, clip, self.augmentation))(keys, audio)
        return Batch(self.audio_statistics.normalise(audio), pose, labels[:, 0], labels[:, 1])


def tiled_starts(corpus: Corpus, split: str, frames: int) -> Int[np.ndarray, " clips"]:
    """First rows of the clips that tile a split without overlap; a stretch's remainder is left out.

    A split whose stretches are all shorter than a clip gives none.
    """
    starts = [
        start for segment in corpus.segments(split) for start in range(segment.start, segment.stop - frames + 1, frames)
    ]
    return np.array(starts, np.int32)
