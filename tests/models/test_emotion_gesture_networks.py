"""Parts of EmotionGesture's networks: audio headers, prompts, queries, the held pose, beat features and time."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emotion_gesture_for_tests import CONFIG, JOINTS, make_batch, make_data, make_params

from a2g_jax.models.emotion_gesture.mining import AudioEncoder, standardised
from a2g_jax.models.emotion_gesture.model import build
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.models.emotion_gesture.objective import generate
from a2g_jax.models.emotion_gesture.prompter import interpolate, reinforce
from a2g_jax.nn.rates import resized
from a2g_jax.nn.transformer import sinusoids


@pytest.mark.parametrize("header", ["aligned", "channels"])
@pytest.mark.parametrize("frames", [12, 15])
def test_both_headers_give_a_row_a_frame(header, frames):
    encoder = AudioEncoder((1, 1), (4, 6), 1, 8, header, 2, 0.0)
    audio = jnp.zeros((2, frames, 12))
    rows, _ = jax.eval_shape(lambda key: encoder.init_with_output(key, audio, True), jax.random.key(0))
    assert rows.shape == (2, frames, 8)


def test_the_aligned_header_keeps_time():
    """A click moves the features near it most; with the authors' header it does not matter where it is."""
    frames, width = 32, 12
    audio = np.zeros((2, frames, width), np.float32)
    audio[1, 24] = 5.0
    changes = {}
    for header in ("aligned", "channels"):
        encoder = AudioEncoder((1, 1), (4, 6), 1, 8, header, 2, 0.0)
        encode = jax.jit(lambda key, one=encoder: one.init_with_output(key, jnp.asarray(audio), True)[0])
        silent, click = np.asarray(encode(jax.random.key(1)))
        changes[header] = np.linalg.norm(click - silent, axis=-1)
    near = changes["aligned"][22:27].mean() / changes["aligned"][:12].mean()
    assert near > 1.5
    assert near > 1.2 * changes["channels"][22:27].mean() / changes["channels"][:12].mean()


class TestPrompts:
    @pytest.fixture
    def arrays(self):
        random = np.random.default_rng(6)
        return random.normal(size=(2, 3, 5)), random.normal(size=(2, 5)), random.normal(size=(2, 3))

    def test_interpolation_is_the_loop(self, arrays, x64):
        near, spatial, _ = arrays
        ours = interpolate(jnp.asarray(near), jnp.asarray(spatial)[:, None], 2.0)
        for clip in range(2):
            for frame in range(3):
                share = 1 / (1 + np.exp(-spatial[clip] @ near[clip, frame] / 2.0))
                expected = share * near[clip, frame] + (1 - share) * spatial[clip]
                np.testing.assert_allclose(ours[clip, frame], expected)

    def test_reinforcement_is_the_product_of_matrices_of_one_sample(self, arrays, x64):
        near, spatial, temporal = arrays
        ours = reinforce(jnp.asarray(near), jnp.asarray(spatial), jnp.asarray(temporal), 3.0)
        for clip in range(2):
            row, column = spatial[clip][None], temporal[clip][:, None]
            product = (column @ row) @ row.T / 3.0
            weights = np.exp(product) / np.exp(product).sum()
            np.testing.assert_allclose(ours[clip], near[clip] + near[clip] * weights)

    def test_initial_poses_stay_in_the_prompt_and_the_end_does_not_change(self):
        """The prompts change only the first L poses after the initial ones."""
        made = {}
        seed = jnp.asarray(np.random.default_rng(7).normal(size=(1, CONFIG.seed_frames, JOINTS * 6)), jnp.float32)
        params = make_params(build(CONFIG, make_data()))
        own = {"params": params["generator"]["prompter"]}
        for kind in ("spatial-temporal", "spatial", "predictor"):
            networks = Networks(replace(CONFIG, prompter=kind), make_data())
            prompter = networks._generator["prompter"]
            made[kind] = np.asarray(jax.jit(lambda one, apply=prompter.apply: apply(one, seed, True))(own))[0]
        m, length = CONFIG.seed_frames, CONFIG.transition_frames
        for kind in ("spatial", "predictor"):
            changed = np.abs(made["spatial-temporal"] - made[kind]).max(axis=-1) > 1e-6
            assert not changed[:m].any()
            assert changed[m : m + length].all()
            assert not changed[m + length :].any()


class TestQueries:
    def test_audio_joins_the_queries_of_its_frames(self):
        moved = {}
        for joined in (False, True):
            config = replace(CONFIG, query_audio=joined)
            networks, batch = Networks(config, make_data()), make_batch()
            params = make_params(build(config, make_data()))

            @jax.jit
            def change(params, networks=networks, batch=batch):
                audio = networks.encode_audio(params, batch.audio)
                seed = networks.flat(batch.pose)[:, : CONFIG.seed_frames]
                bumped = audio._replace(beat=audio.beat.at[:, 9].add(1.0))
                return networks.decode(params, bumped, seed) - networks.decode(params, audio, seed)

            moved[joined] = np.abs(change(params))
        assert moved[True][:, 9].mean() > 2.0 * moved[True][:, :6].mean()


def test_interpolated_time():
    steps = jnp.arange(4.0)[None, :, None]
    np.testing.assert_allclose(resized(steps, 4)[0, :, 0], [0, 1, 2, 3])
    np.testing.assert_allclose(resized(steps, 8)[0, :, 0], [0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3], atol=1e-6)
    np.testing.assert_allclose(resized(jnp.ones((1, 31, 2)), 60), 1.0, atol=1e-6)


@pytest.mark.parametrize("normalise", [True, False])
def test_the_held_pose_fades_to_the_mean_pose(normalise):
    """With a decoder of zeros the motion is the seed poses, then a pose that comes to rest and leaves for the mean."""
    config, data = replace(CONFIG, normalise_pose=normalise), make_data()
    networks = Networks(config, data)
    params = make_params(build(config, data))
    generator = dict(params["generator"])
    generator["decoder"] = jax.tree.map(np.zeros_like, generator["decoder"])
    generator["hold"] = jax.tree.map(np.zeros_like, generator["hold"])
    batch = make_batch()
    made = jax.jit(lambda params: networks.pose(generate(networks, params, batch)[1]))
    pose = np.asarray(made({**params, "generator": generator}))[0]
    seed = np.asarray(batch.pose[0, : config.seed_frames])
    np.testing.assert_allclose(pose[: config.seed_frames], seed, atol=1e-5)
    place = seed[-1]
    for frame in range(config.stride):
        place = place + 0.6 ** (frame + 1) * (seed[-1] - seed[-2])
        share = 1 / (1 + np.exp(-5 * np.exp(-frame / 4)))
        between = share * place + (1 - share) * data.pose_statistics.mean
        np.testing.assert_allclose(pose[config.seed_frames + frame], between, atol=1e-5)


def test_beat_features_hold_nothing_that_is_constant_in_a_clip():
    features = jax.random.normal(jax.random.key(0), (2, 30, 4))
    moved = standardised(3.0 * features + jnp.arange(4.0)[None, None])
    np.testing.assert_allclose(moved, standardised(features), atol=1e-4)
    np.testing.assert_allclose(jnp.mean(moved, axis=1), 0.0, atol=1e-5)
    np.testing.assert_allclose(standardised(jnp.ones((1, 5, 2))), 0.0)


def test_positions_are_those_of_the_formula():
    table = sinusoids(7, 6)
    for frame in range(7):
        for pair in range(3):
            angle = frame / 10000 ** (2 * pair / 6)
            np.testing.assert_allclose(table[frame, 2 * pair : 2 * pair + 2], [np.sin(angle), np.cos(angle)], atol=1e-6)
