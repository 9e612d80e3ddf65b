"""A corpus of generated talk, a feature network trained on it for a moment, and tables of its baselines."""

import dataclasses

import pytest

from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.evaluation.evaluate import evaluate
from a2g_jax.evaluation.feature_network import load_feature_network
from a2g_jax.models import find_model
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.talker.recordings import cast, talk
from a2g_jax.training.loop import train
from a2g_jax.training.run import RunConfig


@pytest.fixture(scope="session")
def corpus(tmp_path_factory):
    """Ten generated recordings of twelve seconds, as of 'a2g prepare talker'."""
    roles = [{**role, "seconds": 12.0} for role in cast(10.0, 5, (), ("neutral", "anger"))[:10]]
    rows = (prepare_recording(talk(**role), Features()) for role in roles)
    recipe = {"reader": "talker", "roles": roles, "fingers": False, "jitter": 0.0, "view": "body"}
    return write_corpus(tmp_path_factory.mktemp("scored") / "corpus", rows, features=Features(), recipe=recipe)


@pytest.fixture(scope="session")
def network(corpus, tmp_path_factory):
    """A feature network trained on the corpus for a moment."""
    small = dataclasses.replace(
        find_model("motion_autoencoder").presets["tiny"],
        encoder_channels=(16, 16, 16, 24, 8),
        decoder_channels=(8, 16),
        clip_frames=50,
    )
    settings = dataclasses.replace(TRAIN_PRESETS["tiny"], steps=30, batch_size=4)
    out = tmp_path_factory.mktemp("network") / "run"
    config = RunConfig.of("motion_autoencoder", "tiny", small, settings, corpus)
    train(config, corpus, out, resume=False, progress=False)
    return load_feature_network(out, corpus)


@pytest.fixture(scope="session")
def result(corpus, network):
    """The baselines' table."""
    return evaluate({}, corpus, split="train", samples=3, network=network)


@pytest.fixture(scope="session")
def plain(corpus):
    """The baselines' table of the test split, without a feature network."""
    return evaluate({}, corpus, samples=2)
