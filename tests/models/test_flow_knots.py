"""The flow on knots of a spline: windows, latents, constant channels, removal of noise, hidden conditioning."""

from dataclasses import replace
from functools import cache, partial

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
from a2g_jax.models.stylized_flow.autoregression import Sampling, proceed, start
from a2g_jax.models.stylized_flow.config import PRESETS, StylizedFlowConfig
from a2g_jax.models.stylized_flow.extras import Extras
from a2g_jax.models.stylized_flow.likelihood import log_likelihood
from a2g_jax.models.stylized_flow.model import build, draw_latents
from a2g_jax.models.stylized_flow.networks import FlowNetworks
from a2g_jax.models.stylized_flow.sampling import StylizedFlowSampling
from a2g_jax.training.state import joint_loss
from tests.arrays_for_tests import on_device

CONFIG = StylizedFlowConfig(
    flow_steps=2,
    hidden=8,
    layers=1,
    stride=3,
    history_frames=8,
    history_input="poses",
    lookahead_frames=36,
    frame_dropout=0.25,
    history_dropout=0.2,
    least_std=0.02,
    clip_frames=120,
    predictor=True,
    global_channels=4,
    encoder_channels=8,
    encoder_blocks=1,
    embedding_channels=4,
    strided_norm=True,
    audio_channels=4,
    style_channels=3,
    mirror_flag=True,
)
#: The last channel is constant.
STD = np.array([[2.0, 2.0, 2.0], [2.0, 2.0, 0.01]], np.float32)
DATA = Data(
    PoseSpace(PoseLayout(("a", "b", "c"), ((0, 1), (1, 2))), "directions"),
    30.0,
    4,
    Statistics(np.full((2, 3), 0.5, np.float32), STD),
)
AS_DRAWN = StylizedFlowSampling(denoise=False)


def batch_of(clips=4, frames=120, seed=0):
    rng = np.random.default_rng(seed)
    audio = rng.normal(size=(clips, frames, 4)).astype(np.float32)
    pose = np.cumsum(0.3 * rng.normal(size=(clips, frames, 2, 3)), axis=1).astype(np.float32)
    pose[..., 1, 2] = 0.5
    return Batch(on_device(audio), on_device(pose), other_pose=on_device(pose[::-1]))


@cache
def fitted_params(config):
    """Parameters on the host, whose couplings are not the identity; fitted once for each configuration."""
    model = build(config, DATA, AS_DRAWN)
    params = jax.jit(model.stages[0].warm_start)(jax.jit(model.init)(jax.random.key(0)), batch_of())
    kernel = params["glow"]["coupling"]["out_kernel"]
    params["glow"]["coupling"]["out_kernel"] = 0.2 * jax.random.normal(jax.random.key(1), kernel.shape)
    return jax.device_get(params)


def fitted(config=CONFIG, sampling=AS_DRAWN):
    """A model, and parameters whose couplings are not the identity; how it is sampled is no part of them."""
    return build(config, DATA, sampling), jax.tree.map(on_device, fitted_params(config))


def test_any_windows_give_the_same_motion():
    model, params = fitted(sampling=StylizedFlowSampling())
    key, audio = jax.random.key(3), batch_of(clips=1, frames=640).audio[0]
    style = np.array([0.3, -0.2, 0.5], np.float32)
    given = jax.device_get(jax.jit(model.condition)(params, {}, Condition(audio, style=style)))
    begin, proceed = jax.jit(model.begin), jax.jit(model.proceed)

    def in_windows(frames):
        state, parts = begin(params, {}, key), []
        for first in range(0, 512, frames):
            part = jax.tree.map(lambda a, first=first: a[first : first + frames + model.overlap], given)
            pose, state = proceed(params, {}, key, part, jnp.int32(first), state)
            parts.append(pose)
        return np.concatenate(parts)

    # 128 frames are 42 or 43 knots.
    whole = in_windows(512)
    assert np.abs(np.diff(whole, axis=0)).max() > 0.01
    np.testing.assert_allclose(in_windows(128), whole, atol=2e-5)
    np.testing.assert_allclose(in_windows(256), whole, atol=2e-5)


def test_latents_of_a_motion_are_those_that_were_drawn():
    model, params = fitted()
    key, audio = jax.random.key(7), batch_of(clips=1, frames=384).audio[0]
    given = jax.jit(model.condition)(params, {}, Condition(audio))
    pose = jax.jit(model.sample)(params, {}, key, given, jnp.int32(0))
    assert pose.shape == (384, 2, 3)
    before, after = model.seed_frames, model.lookahead
    around = np.pad(audio, ((before, after), (0, 0)))
    still = np.full((before, 2, 3), 0.5, np.float32)
    clip = np.concatenate([still, pose, np.repeat(np.asarray(pose)[-1:], after, axis=0)])
    controls = np.zeros((len(clip), 0), np.float32)
    z = jax.jit(lambda *given: model.encode(params, *given, None))(around, clip, controls)
    drawn = draw_latents(1.0, CONFIG.freedom, key, jnp.int32(0), 384, 5)
    assert z.shape == drawn.shape
    # Every third row is that of a knot; the fit at the ends is no spline's.
    z, drawn = np.asarray(z), np.asarray(drawn)
    np.testing.assert_allclose(z[60:-60:3], drawn[60:-60:3], atol=0.1)
    np.testing.assert_array_equal(z[0], z[2])


def test_constant_channels_have_no_density_and_stay_at_their_mean():
    model, params = fitted()
    given = jax.jit(model.condition)(params, {}, Condition(batch_of(1, 128).audio[0]))
    pose = jax.jit(model.sample)(params, {}, jax.random.key(0), given, jnp.int32(0))
    assert model.density.dimensions == 5
    np.testing.assert_array_equal(np.asarray(pose)[:, 1, 2], np.float32(0.5))
    batch = batch_of()
    density = jax.jit(model.density.log_likelihood)
    moved = np.array(batch.pose)
    moved[..., 1, 2] += 1.0
    np.testing.assert_array_equal(density(params, batch.audio, batch.pose), density(params, batch.audio, moved))
    with pytest.raises(InputError, match="--least-std 9: leaves 0 channels"):
        build(replace(CONFIG, least_std=9.0), DATA)


@pytest.mark.parametrize(
    "changes",
    [pytest.param({}, marks=pytest.mark.slow), {"predictor": False, "freedom": 0.0}],
    ids=["linear layer", "normal"],
)
def test_removed_noise_is_the_gradient_of_the_log_density(x64, changes):
    config = replace(CONFIG, stride=1, history_frames=24, lookahead_frames=36, **changes)
    networks = FlowNetworks(config, DATA)
    with jax.enable_x64(False):
        params = jax.device_get(fitted(config)[1])
    params = jax.tree.map(lambda a: on_device(a, jnp.float64), params)
    random = np.random.default_rng(2)
    history, audio, z = (on_device(random.normal(size=size)) for size in ((1, 24, 5), (1, 4), (1, 1, 5)))

    @jax.jit
    def one(z):
        state, given = start(networks, params, 1, history[0]), networks.audio_context(params, audio)
        drawn, shown = (
            proceed(networks, params, z, given, state, jnp.int32(0), Sampling(noise=noise))[0][0, 0]
            for noise in (0.0, 0.1)
        )
        return drawn, shown - drawn

    drawn, change = map(np.asarray, one(z))

    @jax.jit
    def log_density(x):
        flat = jnp.concatenate([history, x[None, None], jnp.zeros((1, 36, 5))], axis=1)
        clip = networks.conditioning(params, jnp.pad(audio, ((24, 36), (0, 0)))[None], flat)
        return log_likelihood(networks, params, flat, clip)[0][0, 0]

    step = 1e-5
    numeric = [(log_density(drawn + step * unit) - log_density(drawn - step * unit)) / (2 * step) for unit in np.eye(5)]
    np.testing.assert_allclose(change, np.clip(0.01 * np.array(numeric), -0.3, 0.3), rtol=1e-5, atol=1e-9)
    assert np.abs(change).max() > 1e-3


def test_what_is_hidden_has_no_effect_and_what_is_shown_has():
    networks = FlowNetworks(replace(CONFIG, control_dropout=0.5), DATA)
    _, params = fitted()
    batch = batch_of()
    context = jax.jit(
        lambda extras: networks.conditioning(params, batch.audio, networks.flat(batch.pose), None, extras)
    )
    code = np.ones((4, 3), np.float32)
    styled = np.array([True, True, False, False])
    found = Extras(style=code, styled=styled), Extras(), Extras(mirrored=styled)
    shown, plain, mirrored = (np.asarray(context(extras).context) for extras in found)
    np.testing.assert_array_equal(shown[2:], plain[2:])
    assert np.abs(shown[:2] - plain[:2]).max() == 1.0
    np.testing.assert_array_equal((mirrored != plain).any(axis=(1, 2)), styled)


@pytest.mark.parametrize("history_input", ["poses", "steps"])
def test_the_expectation_of_the_last_pose_is_the_same_in_training_and_generation(history_input):
    networks = FlowNetworks(replace(CONFIG, history_input=history_input), DATA)
    _, params = fitted()
    random = np.random.default_rng(0)
    before = random.normal(size=(1, 1, 8, 5)).astype(np.float32)
    masks = random.uniform(size=(1, 4000, 8)) < 0.75
    visible = jax.jit(networks.visible)
    whole = np.asarray(visible(params, before))
    seen = np.asarray(visible(params, np.broadcast_to(before, (1, 4000, 8, 5)), masks))
    np.testing.assert_allclose(seen.mean(axis=1)[0, -1], whole[0, 0, -1], atol=0.08)


def test_guidance_of_one_and_of_the_same_condition_change_nothing():
    _, params = fitted()
    networks = FlowNetworks(CONFIG, DATA)
    audio, code = batch_of(1, 30).audio[0], np.array([[0.5, -0.5, 0.9]], np.float32)
    z = on_device(np.random.default_rng(0).normal(size=(36, 1, 5)), jnp.float32)

    @jax.jit
    def context(params):
        return networks.audio_context(params, jnp.pad(audio, ((0, 6), (0, 0))), Extras(style=code), guided=True)

    @partial(jax.jit, static_argnums=2)
    def motion(params, given, guidance):
        how = Sampling(guidance=guidance)
        before = start(networks, params, 1, how=how)
        poses, after = proceed(networks, params, z, given, before, jnp.int32(0), how)
        return poses, before, after

    guided = context(params)
    given = guided._replace(unguided=())
    plain, stronger = np.asarray(motion(params, given, 1.0)[0]), np.asarray(motion(params, guided, 3.0)[0])
    np.testing.assert_allclose(motion(params, given._replace(unguided=given.projected), 3.0)[0], plain, atol=1e-5)
    assert np.abs(stronger - plain).max() > 1e-3
    # Without a style there is nothing to guide, and motion is plain to the bit.
    free, before, after = motion(params, given, 3.0)
    np.testing.assert_array_equal(free, plain)
    assert jax.tree.map(np.shape, after) == jax.tree.map(np.shape, before)


@pytest.mark.slow
def test_gradients_of_the_loss_with_everything_hidden_and_shown(x64):
    config = replace(CONFIG, reverse_share=1.0, style_dropout=0.3)
    with jax.enable_x64(False):
        model, params = fitted(config)
        params = jax.device_get(params)
        batch = jax.device_get(batch_of(clips=2))
    wide = lambda tree: jax.tree.map(lambda a: on_device(a, jnp.float64) if a.dtype.kind == "f" else a, tree)  # noqa: E731
    params, batch = wide(params), wide(batch)
    loss = joint_loss(model.stages[0])
    value = jax.jit(lambda params: loss(params, jax.random.key(5), batch, jnp.int32(0))[0])
    gradient = jax.jit(jax.grad(value))(params)
    for name in ("style_encoder", "audio_encoder", "glow", "predictor"):
        leaves, tree = jax.tree.flatten(params[name])
        keys = jax.random.split(jax.random.key(9), len(leaves))
        way = tree.unflatten([jax.random.normal(k, a.shape, jnp.float64) for k, a in zip(keys, leaves, strict=True)])
        if name == "predictor":
            way["spread"] = jnp.zeros_like(way["spread"])
        if name == "glow":
            way["invertible"] = {
                key: jnp.zeros_like(value) if key in ("permutation", "sign") else value
                for key, value in way["invertible"].items()
            }
        moved = lambda step: {**params, name: jax.tree.map(lambda a, w: a + step * w, params[name], way)}  # noqa: B023, E731
        numeric = (value(moved(1e-6)) - value(moved(-1e-6))) / 2e-6
        exact = sum(jnp.vdot(a, b) for a, b in zip(jax.tree.leaves(gradient[name]), jax.tree.leaves(way), strict=True))
        np.testing.assert_allclose(numeric, exact, rtol=2e-4, atol=1e-5, err_msg=name)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"stride": 0}, "--stride"),
        ({"history_input": "none"}, "--history-input"),
        ({"history_frames": 2}, "--audio-channels"),
        ({"lookahead_frames": 20}, "--audio-channels"),
        ({"clip_frames": 60}, "--clip-frames"),
        ({"control_dropout": 2.0}, "--control-dropout"),
    ],
)
def test_wrong_settings_are_named(changes, named):
    with pytest.raises(InputError, match=named):
        replace(CONFIG, **changes)


def test_presets_of_the_papers_have_none_of_it():
    for name in ("paper", "ted", "moglow", "moglow_styled", "tiny_published"):
        preset = PRESETS[name]
        assert preset.stride == 1, name
        assert not preset.predictor, name
        assert preset.least_std == preset.audio_channels == preset.style_channels == preset.history_dropout == 0, name
