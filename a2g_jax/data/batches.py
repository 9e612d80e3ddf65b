"""Random clips of a corpus, as a function of a key alone."""

from collections.abc import Callable, Mapping
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


def draw_others(key: Key[Array, ""], crops: Crops, starts: Int[Array, " B"]) -> Int[Array, " B"]:
    """First rows of a second random clip of each clip's stretch, every start of it equally likely."""
    order = np.argsort(crops.first)
    first, counts = crops.first[order], np.diff(crops.cumulative, prepend=0)[order].astype(np.int32)
    segment = jnp.searchsorted(jnp.asarray(first), starts, side="right") - 1
    share = jax.random.uniform(key, starts.shape)
    count = jnp.asarray(counts)[segment]
    return jnp.asarray(first)[segment] + jnp.minimum((share * count).astype(jnp.int32), count - 1)


@dataclass(frozen=True)
class BatchMaker:
    """Makes the batch that a model is trained on of raw clips."""

    audio_statistics: Statistics
    augmentation: float
    """Strength of :func:`~a2g_jax.features.augment.augment_log_mel`; 0 for none."""
    mirror: float = 0.0
    """Share of the clips whose left and right are exchanged."""
    mirror_pose: Callable[[Any], Any] | None = None
    """:func:`a2g_jax.geometry.mirror_poses.pose_mirror`; needed where clips are mirrored."""

    def __call__(self, key: Key[Array, ""] | None, clips: Mapping[str, Any]) -> Batch:
        """Audio features normalised, and clips augmented when a key is given; waveforms from -1 to 1.

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
        if self.mirror > 0 and self.mirror_pose is not None:
            fields |= self._mirrored(key, fields)
        return Batch(**fields)

    def _mirrored(self, key: Key[Array, ""] | None, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Poses of clips, a share of them mirrored when a key is given, and which ones."""
        count = len(fields["pose"])
        if key is None or self.mirror_pose is None:
            return {"mirrored": jnp.zeros(count, bool)}
        # Beside the keys of the clips' audio.
        chosen = jax.random.bernoulli(jax.random.fold_in(key, 2**31), self.mirror, (count,))
        poses = {
            name: jnp.where(chosen[:, None, None, None], self.mirror_pose(fields[name]), fields[name])
            for name in ("pose", "other_pose")
            if name in fields
        }
        return {"mirrored": chosen, **poses}


def tiled_starts(
    corpus: Corpus, split: str, frames: int, stride: int | None = None, offset: int = 0
) -> Int[np.ndarray, " clips"]:
    """First rows of the clips that tile a split; a stretch's remainder is left out.

    A split whose stretches are all shorter than a clip gives none.

    Args:
        frames: of a clip.
        stride: frames from one clip to the next; a whole clip, so that none overlap, if None.
        offset: of the first clip from the beginning of its stretch.
    """
    starts = [
        start
        for segment in corpus.segments(split)
        for start in range(segment.start + offset, segment.stop - frames + 1, stride or frames)
    ]
    return np.array(starts, np.int32)


def opposite_starts(
    corpus: Corpus, split: str, frames: int, starts: Int[np.ndarray, " clips"]
) -> Int[np.ndarray, " clips"]:
    """First rows of other clips of the same stretches, half a stretch away; nothing is drawn."""
    segments = sorted(corpus.segments(split), key=lambda segment: segment.start)
    index = np.searchsorted([segment.start for segment in segments], starts, side="right") - 1
    first = np.array([segments[number].start for number in index])
    count = np.array([segments[number].frames - frames + 1 for number in index])
    return (first + (starts - first + count // 2) % count).astype(np.int32)
