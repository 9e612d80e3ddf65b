"""Bits per dimension on held-out motion, of a model and of the conditional Gaussian that it has to beat.

Every stretch of a split is cut into clips as long as those of training, each begun with a zero hidden state as in
training. Clips overlap by the frames that only condition others, so that each frame with history and lookahead counts
once. Bits are of z-scores by the run's statistics: comparable between two runs only where their corpora, history,
lookahead, clip length and noise are the same.

*Noisy*: poses with noise as in training, the same noise for every model. This is a cross-entropy, bounded below by the
entropy of the noise; models are compared by it. *Clean*: the density at the poses themselves of the distribution with
noise (see :mod:`a2g_jax.models.stylized_flow.likelihood`); not a cross-entropy.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.conditional_gaussian import ConditionalGaussian, Regression
from a2g_jax.evaluation.evaluate import check_runs
from a2g_jax.evaluation.likelihood_clips import Clips, clip_batches, clip_starts, recordings_of, scored_frames
from a2g_jax.metrics.intervals import Interval, mean_interval
from a2g_jax.models.base import Density
from a2g_jax.training.run import Run, RunConfig

#: Ridge strengths; one is chosen on the validation split.
_STRENGTHS = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
#: Most validation clips used to choose it.
_VALIDATION_CLIPS = 500
#: Log-likelihoods (B, N) of a batch, nats.
_LogLikelihood = Callable[[Clips], np.ndarray]


class Likelihood(NamedTuple):
    """Bits per dimension of the clips of a split; lower is better."""

    noisy: Interval
    """Mean for poses with the noise of training."""
    clean: Interval
    """Mean for the poses themselves."""
    noisy_clips: Float[np.ndarray, " clips"]
    """Values of the clips, for paired differences of models on the same clips."""
    clean_clips: Float[np.ndarray, " clips"]
    dimensions: int
    """Values of a frame that have a density."""
    frames: int
    """Scored frames of each clip."""
    floor: float
    """Entropy of the noise, bits per dimension: the least that noisy poses allow; minus infinity without noise."""
    recordings: Int[np.ndarray, " clips"]
    """The recording of each clip, over which intervals are."""


def bits_per_dim(run: Run, corpus: Corpus, split: str = "test", seed: int = 0) -> Likelihood:
    """Bits per dimension of a run's model.

    Args:
        seed: seed of the noise.

    Raises:
        InputError: a model without a likelihood, a corpus that does not fit the run, or a split without a whole clip.
    """
    check_runs({run.config.model: run}, corpus)
    log_likelihood = compiled_log_likelihood(run)
    return _likelihood(
        run.config, corpus, split, seed, lambda clips: np.asarray(log_likelihood(clips.audio, clips.pose, clips.clean))
    )


def compiled_log_likelihood(run: Run) -> Callable[..., Any]:
    """The run's compiled ``log_likelihood(audio (B, T, bands), pose (B, T, R, D), clean=None) -> nats (B, N)``.

    Raises:
        InputError: the run's model has no likelihood.
    """
    log_likelihood, params = jax.jit(density_of(run.config).log_likelihood), jax.device_put(run.params)
    return lambda *clips: log_likelihood(params, *clips)


def gaussian_bits_per_dim(
    config: RunConfig, corpus: Corpus, split: str = "test", seed: int = 0, most_clips: int = 4000
) -> Likelihood:
    """Bits per dimension of a Gaussian of each pose, linear in the flow's conditioning: pose history and audio window.

    It is fitted to the training split with the same noise, with a ridge chosen on the validation split, and evaluated
    like :func:`bits_per_dim`.

    Args:
        config: settings of the run that it is compared with.
        seed: seed of the noise and of the choice of training clips.
        most_clips: limit of training clips; a random subset where there are more.

    Raises:
        InputError: see :func:`bits_per_dim`, for all splits.
    """
    gaussian, rows = fit_gaussian(config, corpus, seed, most_clips), conditioning_rows(config)
    # As the model's own, spread over the frames up to the next pose.
    stride = density_of(config).stride
    return _likelihood(
        config, corpus, split, seed, lambda clips: gaussian.log_density(*rows(clips)).reshape(clips.kept, -1) / stride
    )


def fit_gaussian(config: RunConfig, corpus: Corpus, seed: int = 0, most_clips: int = 4000) -> ConditionalGaussian:
    """The distribution of :func:`gaussian_bits_per_dim`, fitted."""
    starts, noise = clip_starts(config, corpus, "train"), density_of(config).noise
    if len(starts) > most_clips:
        starts = np.sort(np.random.default_rng(seed).choice(starts, most_clips, replace=False))
    regression, rows = Regression(), conditioning_rows(config)
    for clips in clip_batches(config, corpus, starts, noise, seed):
        regression.add(*rows(clips))
    try:
        fits = regression.fit(_STRENGTHS)
    except ValueError as error:
        raise InputError(f"{corpus.path}: is too short to fit a conditional Gaussian ({error})") from None
    validation = clip_starts(config, corpus, "validation")
    validation = validation[:: -(-len(validation) // _VALIDATION_CLIPS)]
    held_out = [rows(clips) for clips in clip_batches(config, corpus, validation, noise, seed)]
    return min(fits, key=lambda fit: -sum(float(fit.log_density(*one).sum()) for one in held_out))


def density_of(config: RunConfig) -> Density:
    """The density of a run's model.

    Raises:
        InputError: the model has none.
    """
    density = config.build().density
    if density is None:
        raise InputError(f"{config.model}: has no likelihood of a motion; name a run of stylized_flow.")
    return density


def conditioning_rows(config: RunConfig) -> Callable[[Clips], tuple[np.ndarray, np.ndarray]]:
    """A function from a batch to the conditioning (n N, D) and the z-scores (n N, C) of its evaluated frames."""
    conditioning = jax.jit(density_of(config).conditioning)

    def rows(clips: Clips) -> tuple[np.ndarray, np.ndarray]:
        given, values = (np.asarray(a)[: clips.kept] for a in conditioning(clips.audio, clips.pose, clips.clean))
        return given.reshape(-1, given.shape[-1]), values.reshape(-1, values.shape[-1])

    return rows


def _likelihood(config: RunConfig, corpus: Corpus, split: str, seed: int, log_likelihood: _LogLikelihood) -> Likelihood:
    starts, noise = clip_starts(config, corpus, split), density_of(config).noise
    dimensions = density_of(config).dimensions

    def bits(noise: float) -> Float[np.ndarray, " clips"]:
        batches = clip_batches(config, corpus, starts, noise, seed)
        nats = np.concatenate([log_likelihood(clips)[: clips.kept] for clips in batches])
        return -nats.astype(np.float64).mean(axis=1) / (dimensions * math.log(2.0))

    noisy, clean = bits(noise), bits(0.0)
    recordings = recordings_of(corpus, starts)
    noisy_mean, clean_mean = (mean_interval(values, recordings) for values in (noisy, clean))
    entropy = math.log2(noise * math.sqrt(2 * math.pi * math.e)) if noise > 0 else -math.inf
    floor = entropy / density_of(config).stride
    return Likelihood(noisy_mean, clean_mean, noisy, clean, dimensions, scored_frames(config), floor, recordings)
