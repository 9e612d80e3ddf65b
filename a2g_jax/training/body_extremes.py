"""Extremes of a corpus's training motion, against which generated motion is checked."""

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.metrics.body.bounds import LEAST_FRAMES, MOST_FRAMES, extremes
from a2g_jax.metrics.body.figures import Reference


def corpus_extremes(corpus: Corpus) -> dict[str, Float[np.ndarray, " _"]] | None:
    """Extremes of the training split (:func:`~a2g_jax.metrics.body.bounds.extremes`).

    Of a long corpus every n-th stretch counts. None without rotations, and for less than a minute of motion, which has
    too few gestures to tell what its people do not do.
    """
    if not corpus.space.has_rotations or not corpus.splits.get("train"):
        return None
    segments = corpus.segments("train")
    frames = sum(segment.stop - segment.start for segment in segments)
    if frames < LEAST_FRAMES:
        return None
    chosen = segments[:: -(-frames // MOST_FRAMES)]
    pose, root = corpus.statistics["pose"].mean, corpus.statistics["root"].mean
    reference = Reference(corpus.skeleton, np.asarray(corpus.space.mean_rotations(pose), np.float64), float(root[1]))
    return extremes((corpus.motion(segment.start, segment.stop) for segment in chosen), reference)
