"""Clips of a split on which likelihoods are evaluated: as long as in training, with and without its noise."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.training.run import RunConfig

#: Clips of a batch.
BATCH = 32


class Clips(NamedTuple):
    """A batch; all batches have one size, to compile once."""

    audio: Float[np.ndarray, "B T bands"]
    """Normalised."""
    pose: Float[np.ndarray, "B T R D"]
    """Poses to evaluate, with noise if there is any."""
    clean: Float[np.ndarray, "B T R D"]
    """Poses of the corpus."""
    kept: int
    """Number of clips that count; the rest repeat the last one."""


def scored_frames(config: RunConfig) -> int:
    """Number of frames of a clip that have history and lookahead."""
    model = config.build()
    return model.clip_frames - model.seed_frames - model.lookahead


def clip_starts(config: RunConfig, corpus: Corpus, split: str) -> Int[np.ndarray, " clips"]:
    """First rows of clips that overlap by history and lookahead, so that each frame of a stretch is evaluated once.

    The remainder of a stretch is left out.

    Raises:
        InputError: no such split, or one without a whole clip.
    """
    frames, step = config.model_config.clip_frames, scored_frames(config)
    starts = [
        start for segment in corpus.segments(split) for start in range(segment.start, segment.stop - frames + 1, step)
    ]
    if not starts:
        raise InputError(
            f"{corpus.path}: its {split} split has no stretch of the {frames} frames of a clip; prepare longer"
            " recordings."
        )
    return np.array(starts)


def recordings_of(corpus: Corpus, rows: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
    """Numbers of the recordings that rows of the arrays belong to."""
    return np.searchsorted([entry.first for entry in corpus.recordings], rows, side="right") - 1


def clip_batches(
    config: RunConfig, corpus: Corpus, starts: Int[np.ndarray, " clips"], noise: float, seed: int
) -> Iterator[Clips]:
    """Batches of the clips that begin at the rows.

    Args:
        noise: standard deviation of the noise added to poses, in z-scores.
        seed: determines, with the row of a clip, its noise: the same for every model.
    """
    frames = config.model_config.clip_frames
    std = np.asarray(config.statistics["pose"].std, np.float64)[None]

    def noisy(start: int, pose: Float[np.ndarray, "T R D"]) -> Float[np.ndarray, "T R D"]:
        drawn = np.random.default_rng([seed, start]).normal(size=pose.shape)
        return (pose + noise * std * drawn).astype(np.float32)

    for first in range(0, len(starts), BATCH):
        rows = starts[np.minimum(np.arange(first, first + BATCH), len(starts) - 1)]
        audio = np.stack([np.asarray(corpus.audio[row : row + frames]) for row in rows])
        clean = np.stack([np.asarray(corpus.pose[row : row + frames]) for row in rows])
        pose = clean if noise == 0 else np.stack([noisy(int(row), one) for row, one in zip(rows, clean, strict=True)])
        normalised = np.asarray(config.statistics["audio"].normalise(audio), np.float32)
        yield Clips(normalised, pose, clean, min(BATCH, len(starts) - first))
