"""Bits per dimension, of a flow and of the conditional Gaussian, against direct computations."""

import math
from dataclasses import replace

import jax
import numpy as np
import pytest
from scipy import stats

from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.evaluation.conditional_gaussian import ConditionalGaussian, Regression
from a2g_jax.evaluation.likelihood import bits_per_dim, conditioning_rows, fit_gaussian, gaussian_bits_per_dim
from a2g_jax.evaluation.likelihood_clips import clip_batches, clip_starts
from a2g_jax.features.mel import MelConfig
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import Run, RunConfig

MODEL = StylizedFlowConfig(
    flow_steps=2,
    hidden=8,
    layers=1,
    history_frames=2,
    lookahead_frames=1,
    clip_frames=24,
    global_channels=0,
    reverse_share=0.0,
)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """Ten recordings of seven seconds, as exponential maps."""
    features = Features(fps=20.0, pose="exponential", mel=MelConfig(bands=4))
    rows = (prepare_recording(talk(7.0, seed, name=f"take{seed}"), features) for seed in range(10))
    return write_corpus(
        tmp_path_factory.mktemp("bits") / "corpus", rows, features=features, recipe={"reader": "talker"}
    )


@pytest.fixture(scope="module")
def run(corpus):
    """A flow before training."""
    config = RunConfig.of("stylized_flow", "tiny", MODEL, TRAIN_PRESETS["tiny"], corpus)
    return Run(config, jax.jit(config.build().init)(jax.random.key(0)), {}, 0)


class TestConditionalGaussian:
    def test_its_density_is_scipys(self):
        rng = np.random.default_rng(0)
        given, values, root = rng.normal(size=(20, 5)), rng.normal(size=(20, 3)), rng.normal(size=(3, 3))
        ours = ConditionalGaussian(rng.normal(size=(5, 3)), rng.normal(size=3), root @ root.T + 0.1 * np.eye(3))
        expected = [
            stats.multivariate_normal(ours.offset + row @ ours.weights, ours.covariance).logpdf(value)
            for row, value in zip(given, values, strict=True)
        ]
        np.testing.assert_allclose(ours.log_density(given, values), expected, rtol=1e-9)

    def test_it_finds_the_distribution_that_rows_come_from(self):
        rng = np.random.default_rng(1)
        weights, root = rng.normal(size=(6, 3)), np.array([[1.0, 0, 0], [0.5, 0.3, 0], [-0.2, 0.1, 0.05]])
        regression = Regression()
        for _ in range(4):
            given = rng.normal(size=(5000, 6)) + 1.0
            regression.add(given, given @ weights + 2.0 + rng.normal(size=(5000, 3)) @ root.T)
        (fit,) = regression.fit((1e-8,))
        np.testing.assert_allclose(fit.weights, weights, atol=0.03)
        np.testing.assert_allclose(fit.offset, 2.0, atol=0.05)
        np.testing.assert_allclose(fit.covariance, root @ root.T, atol=0.02)
        given = rng.normal(size=(20000, 6)) + 1.0
        fresh = fit.log_density(given, given @ weights + 2.0 + rng.normal(size=(20000, 3)) @ root.T)
        entropy = stats.multivariate_normal(np.zeros(3), root @ root.T).entropy()
        np.testing.assert_allclose(-fresh.mean(), entropy, atol=0.03)

    def test_residuals_count_the_weights_freedom(self):
        rng = np.random.default_rng(2)
        regression = Regression()
        regression.add(rng.normal(size=(200, 80)), rng.normal(size=(200, 1)))
        least, most = regression.fit((1e-8, 1e6))
        # Uncorrected, 81 of 200 weights would make it about 0.6.
        np.testing.assert_allclose(least.covariance, 1.0, atol=0.2)
        np.testing.assert_allclose(most.weights, 0.0, atol=1e-5)

    def test_too_few_rows_are_refused(self):
        regression = Regression()
        regression.add(np.ones((3, 2)), np.ones((3, 3)))
        with pytest.raises(ValueError, match="more than 4 rows"):
            regression.fit((1.0,))


def test_clips_score_every_frame_once(run, corpus):
    starts = clip_starts(run.config, corpus, "test")
    scored = np.concatenate([np.arange(start + 2, start + 23) for start in starts])
    assert len(np.unique(scored)) == len(scored)
    inside = [set(range(s.start + 2, s.stop - 1)) for s in corpus.segments("test")]
    assert set(scored) <= set.union(*inside)
    assert len(scored) > sum(len(rows) for rows in inside) - 21 * len(inside)


def test_noise_is_the_same_for_all_and_as_large_as_in_training(run, corpus):
    starts = clip_starts(run.config, corpus, "train")
    one, other = (next(clip_batches(run.config, corpus, rows, 0.02, 3)) for rows in (starts, starts[1:]))
    np.testing.assert_array_equal(one.pose[1], other.pose[0])
    z = (one.pose - one.clean) / np.asarray(run.config.statistics["pose"].std)[None, None]
    np.testing.assert_allclose(z.std(), 0.02, rtol=0.01)


def test_bits_of_a_flow_are_those_of_its_score(run, corpus):
    found = bits_per_dim(run, corpus)
    (start, *_), model = clip_starts(run.config, corpus, "test"), run.config.build()
    audio = run.config.statistics["audio"].normalise(np.asarray(corpus.audio[start : start + 24]))
    nats = jax.jit(model.density.log_likelihood)(
        run.params, audio[None], np.asarray(corpus.pose[start : start + 24])[None]
    )
    np.testing.assert_allclose(found.clean_clips[0], -np.mean(nats) / (66 * math.log(2)), rtol=1e-5)
    # The clips are of one recording, which has no interval.
    assert len(found.recordings) == len(found.clean_clips) > 1 == len(set(found.recordings)) == found.clean.clips
    assert np.isnan(found.clean.low)
    np.testing.assert_allclose(found.noisy.mean, found.noisy_clips.mean(), rtol=1e-12)
    assert (found.dimensions, found.frames) == (66, 21)


def test_bits_of_the_gaussian_are_those_of_scipy_and_above_the_noise(run, corpus):
    found = gaussian_bits_per_dim(run.config, corpus)
    gaussian = fit_gaussian(run.config, corpus)
    starts = clip_starts(run.config, corpus, "test")
    for noise, ours in ((0.02, found.noisy_clips), (0.0, found.clean_clips)):
        given, values = conditioning_rows(run.config)(next(clip_batches(run.config, corpus, starts[:1], noise, 0)))
        # Two poses of 66 values and four frames of four bands.
        assert given.shape == (21, 2 * 66 + 4 * 4)
        residual = values - (gaussian.offset + given @ gaussian.weights)
        nats = stats.multivariate_normal(np.zeros(66), gaussian.covariance).logpdf(residual)
        np.testing.assert_allclose(ours[0], -nats.mean() / (66 * math.log(2)), rtol=1e-5)
    # The entropy of normal noise of 0.02 is its log2(0.02 sqrt(2 pi e)).
    np.testing.assert_allclose(found.floor, -3.597, atol=1e-3)
    assert found.floor < found.noisy.mean < bits_per_dim(run, corpus).noisy.mean
    assert found.clean.mean < found.noisy.mean


def test_what_cannot_be_scored_is_refused(run, corpus, toy_corpus):
    long = replace(run.config, model_config=replace(MODEL, clip_frames=500))
    with pytest.raises(InputError, match="no stretch of the 500 frames"):
        gaussian_bits_per_dim(long, corpus)
    with pytest.raises(InputError, match="prepare that"):
        bits_per_dim(run, toy_corpus)
