"""Extremes of a run's training motion, against which generated motion is checked."""

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.metrics.body.bounds import LEAST_SECONDS, MOST_FRAMES, extremes
from a2g_jax.training.run_config import RunConfig


def corpus_extremes(corpus: Corpus, config: RunConfig) -> dict[str, Float[np.ndarray, " _"]] | None:
    """Extremes of the training split (:func:`~a2g_jax.metrics.body.bounds.extremes`), relative to the run's mean pose.

    Of a long corpus every n-th stretch counts. A run that started from another one moves like both: its corpus raises
    the extremes of that run. Less than a minute has too few gestures to tell what its people do not do.

    Args:
        corpus: with the whole training split, also what is held out of it for validation.
        config: its ``body_extremes`` are None, unless the run started from another one.

    Returns:
        The extremes; None without rotations, and for less than a minute where the run has none.
    """
    if not corpus.space.has_rotations or not corpus.splits.get("train"):
        return None
    segments = corpus.segments("train")
    frames = sum(segment.stop - segment.start for segment in segments)
    earlier = config.body_extremes
    if earlier is None and frames < LEAST_SECONDS * corpus.fps:
        return None
    chosen = segments[:: -(-frames // MOST_FRAMES)]
    found = extremes((corpus.motion(segment.start, segment.stop) for segment in chosen), config.body_reference)
    return found if earlier is None else {name: np.maximum(found[name], earlier[name]) for name in found}
