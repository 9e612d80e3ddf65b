"""Bits per dimension on held-out motion, of a model and of the conditional Gaussian that it has to beat.

Of every stretch of a split, clips as long as those of training are scored, with recurrent layers at rest before each as
in training; they overlap by what is only told, so that each frame with history and lookahead counts once. Bits are of
z-scores by the run's statistics: those of two runs can be compared only where their corpora, history, lookahead, clip
length and noise are the same.

*Noisy*: poses seen through noise as in training, the same noise for every model. It is a cross-entropy, so no density
whatever gets below the noise's own entropy, and models are compared by it. *Clean*: the smeared density at the poses
themselves (see :mod:`a2g_jax.models.stylized_flow.likelihood`); it is no cross-entropy, and shown for what it is.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.conditional_gaussian import ConditionalGaussian, Regression
from a2g_jax.evaluation.evaluate import check_runs
from a2g_jax.evaluation.likelihood_clips import Clips, clip_batches, clip_starts, scored_frames
from a2g_jax.metrics.intervals import Interval, bootstrap_mean
from a2g_jax.models.base import Density
from a2g_jax.training.run import Run, RunConfig

#: Strengths of the ridge, of which the validation split chooses.
_STRENGTHS = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
#: Validation clips that choose.
_CHOOSING = 500
#: Nats (B, N) of a batch.
_Scores = Callable[[Clips], np.ndarray]


class Likelihood(NamedTuple):
    """Bits per dimension of the clips of a split; less is better."""

    noisy: Interval
    """Of poses seen through the training's noise."""
    clean: Interval
    """At the poses themselves."""
    noisy_clips: Float[np.ndarray, " clips"]
    """Of each clip, for paired differences of models on the same clips."""
    clean_clips: Float[np.ndarray, " clips"]
    dimensions: int
    """Values of a frame."""
    frames: int
    """Scored frames of each clip."""
    floor: float
    """Bits per dimension of the noise alone, which no model gets below on noisy poses; minus infinity without noise."""


def bits_per_dim(run: Run, corpus: Corpus, split: str = "test", seed: int = 0) -> Likelihood:
    """Of a run's density.

    Args:
        seed: of the noise and of the bootstrap.

    Raises:
        InputError: a model without densities, a corpus that does not fit the run, or a split without a whole clip.
    """
    check_runs({run.config.model: run}, corpus)
    score = compiled_score(run)
    return _likelihood(
        run.config, corpus, split, seed, lambda clips: np.asarray(score(clips.audio, clips.pose, clips.clean))
    )


def compiled_score(run: Run) -> Callable[..., Any]:
    """The run's ``score(audio (B, T, bands), pose (B, T, R, D), clean=None) -> nats (B, N)``, compiled.

    Raises:
        InputError: the run's model tells no densities.
    """
    score, params = jax.jit(density_of(run.config).log_likelihood), jax.device_put(run.params)
    return lambda *clips: score(params, *clips)


def gaussian_bits_per_dim(
    config: RunConfig, corpus: Corpus, split: str = "test", seed: int = 0, most_clips: int = 4000
) -> Likelihood:
    """Of a normal distribution of each pose, linear in exactly what the flow is told: pose history and audio window.

    It is fitted to the training split through the same noise, with a ridge as strong as the validation split likes
    best, and scored as :func:`bits_per_dim` does.

    Args:
        config: of the run that it is held against.
        seed: of the noise, of the bootstrap, and of the clips that are fitted to.
        most_clips: of the training split, drawn at random where there are more.

    Raises:
        InputError: as :func:`bits_per_dim`, for all splits.
    """
    gaussian, told = fit_gaussian(config, corpus, seed, most_clips), told_rows(config)
    return _likelihood(
        config, corpus, split, seed, lambda clips: gaussian.log_density(*told(clips)).reshape(clips.kept, -1)
    )


def fit_gaussian(config: RunConfig, corpus: Corpus, seed: int = 0, most_clips: int = 4000) -> ConditionalGaussian:
    """The distribution of :func:`gaussian_bits_per_dim`."""
    starts, noise = clip_starts(config, corpus, "train"), density_of(config).noise
    if len(starts) > most_clips:
        starts = np.sort(np.random.default_rng(seed).choice(starts, most_clips, replace=False))
    regression, told = Regression(), told_rows(config)
    for clips in clip_batches(config, corpus, starts, noise, seed):
        regression.add(*told(clips))
    try:
        fits = regression.fit(_STRENGTHS)
    except ValueError as error:
        raise InputError(f"{corpus.path}: is too short to fit a conditional Gaussian ({error})") from None
    checked = clip_starts(config, corpus, "validation")
    checked = checked[:: -(-len(checked) // _CHOOSING)]
    rows = [told(clips) for clips in clip_batches(config, corpus, checked, noise, seed)]
    return min(fits, key=lambda fit: -sum(float(fit.log_density(*one).sum()) for one in rows))


def density_of(config: RunConfig) -> Density:
    """The density of a run's model.

    Raises:
        InputError: the model has none.
    """
    density = config.build().density
    if density is None:
        raise InputError(f"{config.model}: gives no likelihood of a motion; name a run of stylized_flow.")
    return density


def told_rows(config: RunConfig) -> Callable[[Clips], tuple[np.ndarray, np.ndarray]]:
    """A function that gives what the scored frames of a batch are told, (n N, D), and their z-scores, (n N, C)."""
    told = jax.jit(density_of(config).conditioning)

    def rows(clips: Clips) -> tuple[np.ndarray, np.ndarray]:
        given, values = (np.asarray(a)[: clips.kept] for a in told(clips.audio, clips.pose, clips.clean))
        return given.reshape(-1, given.shape[-1]), values.reshape(-1, values.shape[-1])

    return rows


def _likelihood(config: RunConfig, corpus: Corpus, split: str, seed: int, scores: _Scores) -> Likelihood:
    starts, noise = clip_starts(config, corpus, split), density_of(config).noise
    dimensions = config.statistics["pose"].mean.size

    def bits(noise: float) -> Float[np.ndarray, " clips"]:
        batches = clip_batches(config, corpus, starts, noise, seed)
        nats = np.concatenate([scores(clips)[: clips.kept] for clips in batches])
        return -nats.astype(np.float64).mean(axis=1) / (dimensions * math.log(2.0))

    noisy, clean = bits(noise), bits(0.0)
    noisy_mean, clean_mean = (bootstrap_mean(values, np.random.default_rng(seed)) for values in (noisy, clean))
    floor = math.log2(noise * math.sqrt(2 * math.pi * math.e)) if noise > 0 else -math.inf
    return Likelihood(noisy_mean, clean_mean, noisy, clean, dimensions, scored_frames(config), floor)
