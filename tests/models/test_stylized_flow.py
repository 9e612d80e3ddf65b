"""The flow: likelihood, initialisation from data, sampling frame by frame, windows, settings."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.base import Condition, Data
from a2g_jax.models.optimiser import learning_rate
from a2g_jax.models.stylized_flow.config import PRESETS, StylizedFlowConfig
from a2g_jax.models.stylized_flow.model import build, draw_latents
from a2g_jax.models.stylized_flow.networks import FlowNetworks
from a2g_jax.models.stylized_flow.sampling import StylizedFlowSampling
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import advance, init_state, joint_loss

SMALL = StylizedFlowConfig(
    flow_steps=3,
    hidden=8,
    layers=1,
    history_frames=3,
    lookahead_frames=2,
    clip_frames=24,
    global_channels=4,
    encoder_channels=8,
    encoder_blocks=1,
    embedding_channels=4,
    reverse_share=1.0,
)
LINEAR = replace(SMALL, predictor=True, global_channels=0, reverse_share=0.0)
MOGLOW = replace(SMALL, cell="lstm", freedom=0.0, global_channels=0, reverse_share=0.0)
SHAPE = (2, 3)
DATA = Data(
    PoseSpace(PoseLayout(("a", "b", "c"), ((0, 1), (1, 2))), "directions"),
    15.0,
    4,
    Statistics(np.full(SHAPE, 0.5, np.float32), np.full(SHAPE, 2.0, np.float32)),
)
#: With the noise of training, so that a motion's latents are those that were drawn.
AS_DRAWN = StylizedFlowSampling(denoise=False)
SETTINGS = TrainConfig(steps=200, learning_rate=3e-3, clip_value=5.0, clip_norm=100.0)


def batch_of(clips=4, frames=24, seed=0):
    """Slow poses that depend on the audio."""
    rng = np.random.default_rng(seed)
    audio = rng.normal(size=(clips, frames, 4)).astype(np.float32)
    pose = np.cumsum(0.3 * rng.normal(size=(clips, frames, *SHAPE)), axis=1) + audio[..., :1, None]
    return Batch(jnp.asarray(audio), jnp.asarray(pose, jnp.float32))


def trained(config, steps=60):
    model = build(config, DATA, AS_DRAWN)
    state = init_state(model, stage_spans(model, SETTINGS), SETTINGS.seed)
    step = jax.jit(lambda state, batch, key: advance(stage_spans(model, SETTINGS)[0], state, batch, key))
    history = []
    for number in range(steps):
        state, metrics = step(state, batch_of(seed=number % 5), jax.random.key(number))
        history.append(float(metrics["bits_per_dim"]))
    return model, state, history


@pytest.mark.parametrize("config", [SMALL, MOGLOW, LINEAR], ids=["stylized flow", "moglow", "linear"])
def test_trained_a_little_its_latents_are_those_that_were_drawn(config):
    model, state, history = trained(config)
    assert bool(state.good)
    assert np.mean(history[-5:]) < np.mean(history[:5]) - 0.1
    networks = FlowNetworks(config, DATA)
    audio = batch_of(clips=1, frames=128).audio[0]
    key = jax.random.key(7)
    given = jax.jit(model.condition)(state.params, {}, Condition(audio))
    pose = jax.jit(model.sample)(state.params, {}, key, given, jnp.int32(0))
    assert pose.shape == (128, *SHAPE)
    # Sampled frame by frame; encoded all at once, with the same poses before and the same silence around.
    before, after = config.history_frames, config.lookahead_frames
    flat = jnp.pad(networks.flat(pose[None]), ((0, 0), (before, after), (0, 0)))
    around = jnp.pad(audio, ((before, after), (0, 0)))[None]
    given = jax.jit(networks.conditioning)(state.params, around, flat)
    z, _ = jax.jit(networks.latents)(state.params, networks.inner(flat), given)
    drawn = draw_latents(1.0, config.freedom, key, jnp.int32(0), 128, networks.channels)
    np.testing.assert_allclose(z[0], drawn, atol=5e-3)


def test_a_motion_in_two_parts_is_the_motion_in_one():
    model = build(SMALL, DATA)
    params = jax.jit(model.stages[0].warm_start)(jax.jit(model.init)(jax.random.key(0)), batch_of())
    key, audio = jax.random.key(3), batch_of(clips=1, frames=256).audio[0]
    given = jax.jit(model.condition)(params, {}, Condition(audio))
    whole = jax.jit(model.sample)(params, {}, key, given, jnp.int32(0))
    state, parts = jax.jit(model.begin)(params, {}, key), []
    proceed = jax.jit(model.proceed)
    for start in (0, 128):
        part = jax.tree.map(lambda array, first=start: array[first : first + 128], given)
        pose, state = proceed(params, {}, key, part, jnp.int32(start), state)
        parts.append(pose)
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-5)


def test_only_poses_beyond_those_of_training_are_pulled_back():
    model = build(MOGLOW, DATA, AS_DRAWN)
    params = jax.jit(model.stages[0].warm_start)(jax.jit(model.init)(jax.random.key(0)), batch_of())
    key, audio = jax.random.key(3), batch_of(clips=1, frames=128).audio[0]
    given, sample = jax.jit(model.condition)(params, {}, Condition(audio)), jax.jit(model.sample)
    free = sample(params, {}, key, given, jnp.int32(0))

    def within(low, high):
        bounds = {"pose_low": jnp.full((2, 6), low), "pose_high": jnp.full((2, 6), high)}
        return FlowNetworks(MOGLOW, DATA).flat(sample(params, bounds, key, given, jnp.int32(0))[None])[0]

    flat = FlowNetworks(MOGLOW, DATA).flat(free[None])[0]
    np.testing.assert_array_equal(within(-1e3, 1e3), flat)
    # The latents of an untrained flow are nearly its poses: values beyond 0.5 keep half of the excess.
    kept, beyond = within(-0.5, 0.5), np.abs(np.asarray(flat)) > 0.5
    np.testing.assert_allclose(np.abs(kept)[beyond], 0.5 + 0.5 * (np.abs(flat)[beyond] - 0.5), rtol=1e-4)
    np.testing.assert_allclose(kept[~beyond], flat[~beyond], atol=1e-6)


def test_the_summary_has_the_range_of_every_clip():
    model, batch = build(MOGLOW, DATA), batch_of()
    params = jax.jit(model.init)(jax.random.key(0))
    summary = jax.jit(model.summarise)(params, jax.random.key(0), batch)
    flat = FlowNetworks(MOGLOW, DATA).flat(batch.pose)
    np.testing.assert_allclose(summary["pose_low"], flat.min(axis=1), rtol=1e-6)
    np.testing.assert_allclose(summary["pose_high"], flat.max(axis=1), rtol=1e-6)


def test_the_first_step_fits_the_actnorms_and_no_other_does():
    model = build(SMALL, DATA)
    frozen = TrainConfig(steps=5, learning_rate=1e-12)
    state = init_state(model, stage_spans(model, frozen), frozen.seed)
    fitted = jax.jit(model.stages[0].warm_start)(state.params, batch_of(seed=1))
    step = jax.jit(lambda state, batch: advance(stage_spans(model, frozen)[0], state, batch, jax.random.key(0))[0])
    state = step(state, batch_of(seed=1))
    state = step(state, batch_of(seed=2))
    for ours, theirs in zip(jax.tree.leaves(state.params), jax.tree.leaves(fitted), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-5)


def test_conditioning_poses_are_those_before_and_audio_those_around():
    config = replace(SMALL, global_channels=0)
    networks = FlowNetworks(config, DATA)
    audio, flat = jnp.arange(24.0)[None, :, None] * jnp.ones((1, 1, 4)), jnp.arange(24.0)[None, :, None]
    given = networks.conditioning({}, audio, jnp.broadcast_to(flat, (1, 24, 6)))
    assert given.history.shape == (1, 19, 18)
    np.testing.assert_array_equal(given.history[0, 0].reshape(3, 6)[:, 0], [0, 1, 2])
    np.testing.assert_array_equal(given.context[0, 0].reshape(6, 4)[:, 0], [0, 1, 2, 3, 4, 5])
    np.testing.assert_array_equal(networks.inner(flat)[0, :, 0], np.arange(3, 22))
    np.testing.assert_array_equal(given.history[0, -1].reshape(3, 6)[:, 0], [18, 19, 20])


def test_loss_has_the_terms_of_the_reverse_pass_only_where_it_is_taken():
    params = jax.jit(build(SMALL, DATA).init)(jax.random.key(0))
    terms = jax.jit(joint_loss(build(SMALL, DATA).stages[0]))(params, jax.random.key(0), batch_of(), jnp.int32(1))[1]
    assert terms["reconstruction"] > 0
    never = build(replace(SMALL, reverse_share=0.0), DATA)
    assert (
        "reconstruction"
        not in jax.jit(joint_loss(never.stages[0]))(params, jax.random.key(0), batch_of(), jnp.int32(1))[1]
    )


def test_noam_rises_falls_and_ends_at_a_tenth():
    schedule = learning_rate(TrainConfig(steps=10, schedule="noam", warmup_steps=100, learning_rate=1.0))
    np.testing.assert_allclose([schedule(n) for n in (0, 49, 99, 399, 10**6)], [0.01, 0.5, 1.0, 0.5, 0.1], rtol=1e-5)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"cell": "rnn"}, "--cell"),
        ({"history_frames": 0}, "--history-frames"),
        ({"history_frames": 1, "predictor": True}, "--history-frames"),
        ({"frame_dropout": 1.5}, "--frame-dropout"),
        ({"clip_frames": 5}, "--clip-frames"),
        ({"perceptual_weight": float("inf")}, "--perceptual-weight"),
    ],
)
def test_wrong_settings_are_named(changes, named):
    with pytest.raises(InputError, match=named):
        replace(SMALL, **changes)


def test_the_perceptual_loss_needs_its_network():
    assert build(PRESETS["paper"], DATA).needs_perceptual
    assert not build(PRESETS["moglow"], DATA).needs_perceptual
