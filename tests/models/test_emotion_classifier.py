"""Classifiers of emotions: they learn from their input only."""

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.base import Data
from a2g_jax.models.emotion_classifier.config import EmotionClassifierConfig
from a2g_jax.models.emotion_classifier.model import build, classify
from a2g_jax.models.emotion_classifier.networks import positions
from a2g_jax.training.state import joint_loss
from tests.arrays_for_tests import on_device

LAYOUT = PoseLayout(("a", "b"), ((0, 1),))
STATISTICS = Statistics(np.zeros((2, 2), np.float32), np.ones((2, 2), np.float32))
DATA = Data(PoseSpace(LAYOUT, "keypoints"), 15.0, 3, STATISTICS, ("anger", "neutral", "sadness"))


def batch(seed, clips=24):
    """Emotion k makes both audio and motion swing k + 1 times as fast."""
    random = np.random.default_rng(seed)
    emotion = random.integers(0, 3, clips)
    phase = random.uniform(0, 6, clips)[:, None] + np.arange(20) * 0.4 * (emotion[:, None] + 1)
    audio = np.repeat(np.sin(phase)[..., None], 3, axis=-1)
    pose = np.tile(np.cos(phase)[..., None, None], (1, 1, 2, 2))
    return Batch(on_device(audio, jnp.float32), on_device(pose, jnp.float32), on_device(emotion, jnp.int32))


SMALL = {"channels": (16, 16), "hidden": 16, "width": 16, "layers": 2, "heads": 2, "clip_frames": 20}


@pytest.mark.parametrize(
    ("source", "encoder", "rate", "steps"),
    [
        ("motion", "convolutions", 5e-3, 120),
        ("audio", "attention", 2e-3, 200),
    ],
)
def test_it_learns_emotions_from_its_input_only(source, encoder, rate, steps):
    config = EmotionClassifierConfig(source, encoder, dropout=0.1, **SMALL)
    model = build(config, DATA)
    params = jax.jit(model.init)(jax.random.key(0))
    optimiser = optax.adam(rate)

    @jax.jit
    def step(params, state, clips, key):
        gradient = jax.grad(lambda p: joint_loss(model.stages[0])(p, key, clips, jnp.int32(0))[0])(params)
        updates, state = optimiser.update(gradient, state)
        return optax.apply_updates(params, updates), state

    state = jax.jit(optimiser.init)(params)
    for number in range(steps):
        params, state = step(params, state, batch(number), jax.random.key(number))
    held = batch(10_000, clips=60)

    validate = jax.jit(model.stages[0].validation_loss)

    def right(clips):
        return float(validate(params, jax.random.key(0), clips, jnp.int32(0))[1]["accuracy"])

    assert right(held) > 0.9
    other = "audio" if source == "motion" else "pose"
    assert right(held._replace(**{other: jnp.zeros_like(getattr(held, other))})) == right(held)


def test_dropout_acts_in_training_only():
    config = EmotionClassifierConfig(channels=(8,), hidden=8, dropout=0.5, clip_frames=20)
    model = build(config, DATA)
    params, clips = jax.jit(model.init)(jax.random.key(0)), batch(0)
    training, validation = jax.jit(joint_loss(model.stages[0])), jax.jit(model.stages[0].validation_loss)
    losses, held = (
        {float(loss(params, jax.random.key(seed), clips, jnp.int32(0))[0]) for seed in range(3)}
        for loss in (training, validation)
    )
    assert (len(losses), len(held)) == (3, 1)
    assert jax.eval_shape(lambda p: classify(config, DATA, p, clips), params).shape == (24, 3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"encoder": "recurrent"}, "--encoder: expected 'attention' or 'convolutions'; got 'recurrent'"),
        ({"width": 20, "heads": 8}, "--width: expected an even multiple of --heads; got 20 with 8 heads"),
        ({"layers": 0}, "0 layers, of which one or more"),
        ({"input": "words"}, "--input: expected 'motion' or 'audio'"),
    ],
)
def test_wrong_settings(changes, message):
    with pytest.raises(InputError, match=message):
        EmotionClassifierConfig(**changes)


def test_positions_differ_and_are_bounded():
    values = positions(60, 16)
    assert values.shape == (60, 16)
    assert float(jnp.abs(values).max()) <= 1.0
    distance = jnp.linalg.norm(values[:, None] - values[None], axis=-1) + 10.0 * jnp.eye(60)
    assert float(distance.min()) > 0.1


def test_one_emotion_is_refused():
    with pytest.raises(InputError, match=r"the corpus has 1 emotion \(neutral\); prepare one with two or more"):
        build(EmotionClassifierConfig(), DATA._replace(emotions=("neutral",)))
