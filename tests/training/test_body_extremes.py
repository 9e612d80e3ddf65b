"""Extremes of training motion: how much of it is needed, what they are relative to, and those of a tuned run."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.data.splits import Segment
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.rotation import matrix_to_6d
from a2g_jax.metrics.body.bounds import LEAST_SECONDS, extremes
from a2g_jax.training.body_extremes import corpus_extremes
from a2g_jax.training.fine_tuning import start_from, tuned_config
from a2g_jax.training.loop import train
from a2g_jax.training.run import Run, load_run, save_run


@pytest.fixture
def source(tmp_path, toy_run_config):
    """A run with extremes, of which the first value of each figure is far above what the toy corpus has."""
    config = toy_run_config()
    parts = config.body_reference.parts
    found = {name: np.where(np.arange(len(names)) == 0, 1e4, 0.0) for name, names in parts.items()}
    params = jax.device_get(jax.jit(config.build().init)(jax.random.key(0)))
    save_run(tmp_path / "source", Run(replace(config, body_extremes=found), params, {}, 0))
    return start_from(tmp_path / "source", load_run(tmp_path / "source"))


def tuned_of(source, corpus, **changes):
    settings = replace(source.run.config.train_config, steps=1, batch_size=2, **changes)
    return tuned_config(source, source.run.config.model_config, settings, corpus)


def test_the_minimum_is_a_time(toy_corpus, toy_run_config):
    """At 15 frames a second a minute has half as many frames as at 30."""
    config = toy_run_config()
    whole = replace(toy_corpus, splits={"train": [Segment(index, 0, 300) for index in range(6)]})
    assert LEAST_SECONDS == 60.0
    assert corpus_extremes(whole, config) is not None
    short = replace(whole, splits={"train": [*whole.splits["train"][1:], Segment(0, 0, 299)]})
    assert corpus_extremes(short, config) is None
    assert corpus_extremes(replace(short, fps=60.0), config) is None
    assert corpus_extremes(replace(short, fps=15.0), config) is not None


@pytest.mark.slow
def test_short_recordings_raise_the_extremes_of_the_source(tmp_path, source, toy_corpus):
    """With what is held out for early stopping: the run's bounds are not those of any person."""
    short = replace(toy_corpus, splits={"train": [Segment(0, 0, 300)]})
    config = tuned_of(source, short)
    train(config, short, tmp_path / "run", resume=False, progress=False, start=source.run.params)
    bounds = load_run(tmp_path / "run").config.body_bounds
    assert bounds.source == "the training split with margins"
    found = load_run(tmp_path / "run").config.body_extremes
    own = extremes([short.motion(segment.start, segment.stop) for segment in short.segments("train")], bounds.reference)
    for name, values in found.items():
        np.testing.assert_allclose(values, np.maximum(own[name], source.run.config.body_extremes[name]), rtol=1e-5)
        assert values[0] == 1e4
    assert (found["turn"][1:] > 0).any()


def test_a_minute_of_new_recordings_raises_those_of_the_source(source, toy_corpus):
    """The tuned run moves like both."""
    whole = replace(toy_corpus, splits={"train": [Segment(index, 0, 300) for index in range(6)]})
    config = tuned_of(source, whole)
    found, own = corpus_extremes(whole, config), corpus_extremes(whole, replace(config, body_extremes=None))
    for name, values in found.items():
        np.testing.assert_allclose(values, np.maximum(own[name], source.run.config.body_extremes[name]))
    assert (found["turn"][1:] > 0).any()


def test_angles_are_from_the_mean_pose_of_the_run(toy_corpus, toy_run_config):
    """Whose statistics may be another corpus's; bounds are applied to angles from that pose."""
    config = toy_run_config()
    whole = replace(toy_corpus, splits={"train": [Segment(index, 0, 300) for index in range(6)]})
    pose = np.array(config.statistics["pose"].mean)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], np.float32)
    pose[5] = np.asarray(matrix_to_6d(jnp.asarray(config.space.mean_rotations(pose)[5] @ turn, jnp.float32)))
    statistics = {**config.statistics, "pose": Statistics(pose, config.statistics["pose"].std)}
    found = corpus_extremes(whole, replace(config, statistics=statistics))["range"][5]
    assert found > corpus_extremes(whole, config)["range"][5] + 20.0
