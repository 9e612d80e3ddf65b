"""Mean latents of clips, in which the flow paper looks for styles (Sec. 4.4)."""

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.data.batch import Batch
from a2g_jax.data.corpus import Corpus
from a2g_jax.evaluation.likelihood_clips import clip_batches, clip_starts
from a2g_jax.training.run import Run


def mean_latents(run: Run, corpus: Corpus, split: str) -> tuple[Float[np.ndarray, "N C"], list[str]]:
    """Mean over time of the latents of each clip of a split, and the clip's speaker."""
    model, config = run.config.build(), run.config
    summarise = jax.jit(lambda params, batch: model.summarise(params, jax.random.key(0), batch)["latent_mean"])
    starts = clip_starts(config, corpus, split)
    means = [
        np.asarray(summarise(run.params, Batch(clips.audio, clips.pose)))[: clips.kept]
        for clips in clip_batches(config, corpus, starts, 0.0, 0)
    ]
    bounds = np.array([segment.start for segment in corpus.segments(split)])
    places = np.searchsorted(bounds, starts, side="right") - 1
    speakers = [corpus.recordings[corpus.segments(split)[place].recording].speaker for place in places]
    return np.concatenate(means), speakers
