"""Beat and emotion features of speech, and those that the VAE samples."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.generation.emotion_gesture.emotion_space import EmotionSpace
from a2g_jax.generation.generator import speech_features
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import open_run


@pytest.fixture(scope="module")
def run():
    return open_run("demo-emotion")


@pytest.fixture(scope="module")
def space(run):
    return EmotionSpace(run)


def test_features_are_those_of_the_chunks(run, space):
    audio = talk(9.0, 5, emotion="anger").audio
    found = space.of_audio(audio)
    assert found.beat.shape == found.emotion.shape == (135, run.config.model_config.channels)
    np.testing.assert_allclose(found.probabilities.sum(axis=1), 1.0, atol=1e-5)
    # The second chunk: a clip of 60 frames whose first 10 are the last of the first.
    rows = run.config.statistics["audio"].normalise(speech_features(run, audio)[40:100])
    networks = Networks(run.config.model_config, run.config.data())
    clip = jax.jit(networks.encode_audio)(jax.device_put(run.params), jnp.asarray(rows, jnp.float32)[None])
    np.testing.assert_allclose(found.beat[50:100], clip.beat[0, 10:], atol=1e-4)
    np.testing.assert_allclose(found.emotion[50:100], clip.emotion[0, 10:], atol=1e-4)
    with pytest.raises(InputError, match="less than a frame"):
        space.of_audio(np.zeros(100, np.float32))


def test_sampled_features_are_of_their_emotion_and_share_latents(run, space):
    networks = Networks(run.config.model_config, run.config.data())
    drawn = {emotion: space.sample(emotion, 12, seed=1) for emotion in space.emotions}
    classify, params = jax.jit(networks.classify), jax.device_put(run.params)
    found = np.stack([np.asarray(classify(params, jnp.asarray(each))).argmax(axis=1) for each in drawn.values()])
    assert np.mean(found == np.arange(len(drawn))[:, None]) > 0.7
    half = space.sample("anger:0.5,sadness:0.5", 12, seed=1)
    np.testing.assert_allclose(half, (drawn["anger"] + drawn["sadness"]) / 2, atol=1e-4)
    assert np.abs(drawn["anger"][0] - drawn["anger"][1]).max() > 1e-3
    np.testing.assert_allclose(space.sample("anger", 3, seed=1), drawn["anger"][:3], atol=1e-5)
    still = space.sample("anger", 2, temperature=0.0)
    np.testing.assert_allclose(still[0], still[1], atol=1e-6)


def test_weights_and_what_is_refused(space):
    weights = space.weights("neutral@0,anger@1", 30)
    assert weights.shape == (30, len(space.emotions))
    assert space.emotions[int(weights[0].argmax())] == "neutral"
    assert space.emotions[int(weights[-1].argmax())] == "anger"
    with pytest.raises(InputError, match="no emotion 'envy'"):
        space.sample("envy", 1)
    with pytest.raises(InputError, match="past the end"):
        space.weights("neutral@0,anger@2", 30)
    with pytest.raises(InputError, match="a run of stylized_flow has no VAE of emotion features"):
        EmotionSpace(open_run("demo-flow"))
