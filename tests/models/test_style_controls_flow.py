"""Style controls of the flow: conditioning beside the audio, never masked, and followed in generation."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.generation.controls import sampled
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models import MODELS, find_model
from a2g_jax.models.base import Condition, Data
from a2g_jax.models.control_curves import from_percentiles, parse_curves
from a2g_jax.models.stylized_flow.autoregression import proceed, start
from a2g_jax.models.stylized_flow.config import PRESETS, StylizedFlowConfig
from a2g_jax.models.stylized_flow.controls import measure, requested, scaled
from a2g_jax.models.stylized_flow.extras import Extras
from a2g_jax.models.stylized_flow.model import build
from a2g_jax.models.stylized_flow.networks import FlowNetworks
from a2g_jax.models.stylized_flow.sampling import StylizedFlowSampling
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import advance, init_state
from tests.arrays_for_tests import on_device

CONFIG = StylizedFlowConfig(
    flow_steps=2,
    hidden=8,
    layers=1,
    cell="lstm",
    freedom=0.0,
    history_frames=2,
    lookahead_frames=1,
    frame_dropout=0.9,
    global_channels=0,
    reverse_share=0.0,
    clip_frames=20,
    style_controls=("height",),
)
BODY = Skeleton(
    np.array([[0, 0, 0], [0.2, 0.4, 0], [-0.2, 0.4, 0], [0.5, 0, 0], [-0.5, 0, 0]], np.float32),
    ("Pelvis", "L_Shoulder", "R_Shoulder", "L_Wrist", "R_Wrist"),
    (-1, 0, 0, 1, 2),
)
DATA = Data(
    PoseSpace(BODY, "exponential"), 20.0, 4, Statistics(np.zeros((5, 3), np.float32), np.full((5, 3), 0.5, np.float32))
)
SETTINGS = TrainConfig(steps=60, learning_rate=1e-2, clip_value=5.0, clip_norm=100.0)


def batch_of(clips=8, frames=20, seed=0):
    """Arms at an angle of each clip's own, and audio that is independent of it."""
    rng = np.random.default_rng(seed)
    pose = 0.1 * rng.normal(size=(clips, frames, 5, 3))
    level = rng.normal(scale=0.5, size=(clips, 1))
    pose[:, :, 1, 2] += level
    pose[:, :, 2, 2] -= level
    audio = rng.normal(size=(clips, frames, 4))
    return Batch(on_device(audio, jnp.float32), on_device(pose, jnp.float32))


@pytest.fixture(scope="module")
def trained():
    """Weights after sixty steps, and the summary of some clips."""
    model = build(CONFIG, DATA)
    state = init_state(model, stage_spans(model, SETTINGS), SETTINGS.seed)
    step = jax.jit(lambda state, batch, key: advance(stage_spans(model, SETTINGS)[0], state, batch, key)[0])
    for number in range(60):
        state = step(state, batch_of(seed=number), jax.random.key(number))
    return state.params, jax.jit(model.summarise)(state.params, jax.random.key(0), batch_of(clips=64, seed=99))


MODEL = build(CONFIG, DATA, StylizedFlowSampling())


@jax.jit
def heights(params, summary, given):
    """Heights of the hands at every frame of a motion; one program for all requests."""
    pose = MODEL.sample(params, summary, jax.random.key(1), MODEL.condition(params, summary, given), jnp.int32(0))
    return measure(("height",), DATA, pose[None])[0, :, 0]


def generated(trained, *curves, frames=128):
    """Heights of the hands for requested controls."""
    audio = batch_of(clips=1, frames=frames, seed=5).audio[0]
    requests = on_device(sampled(parse_curves(curves, ("height",)), 0, frames, DATA.fps))
    return np.asarray(heights(*trained, Condition(audio, controls=requests)))


def test_hands_follow_the_requested_controls(trained):
    low, high = generated(trained, "height=0.1").mean(), generated(trained, "height=0.9").mean()
    target = np.percentile(trained[1]["control_mean"], [10, 90])
    assert high - low > 0.5 * (target[1] - target[0])
    # Over time: low at first, high at last.
    risen = generated(trained, "height=0.1@2,0.9@4")
    assert risen[-1] - risen[0] > 0.5 * (high - low)


def test_controls_are_those_of_the_frame_itself_and_never_masked():
    networks = FlowNetworks(replace(CONFIG, style_controls=("height", "speed")), DATA)
    batch = batch_of(clips=2)
    mask = jnp.zeros((2, 17, 2), bool)
    conditioning = jax.jit(networks.conditioning)
    own = conditioning({}, batch.audio, networks.flat(batch.pose), mask, networks.scored(batch.pose))
    controls = jax.jit(lambda pose: scaled(("height", "speed"), measure(("height", "speed"), DATA, pose)))(batch.pose)
    assert own.context.shape == (2, 17, 4 * 4 + 2)
    np.testing.assert_allclose(own.context[..., -2:], controls[:, 2:19], atol=1e-4)
    assert not own.history.any()
    # Requested ones replace them, frame by frame; 0.1 m is scaled to 1.
    rising = jnp.broadcast_to(jnp.arange(20.0)[None, :, None], (2, 20, 2))
    given = conditioning({}, batch.audio, networks.flat(batch.pose), mask, Extras(rising))
    np.testing.assert_allclose(given.context[..., -2:], 10.0 * rising[:, 2:19], rtol=1e-6)


def test_the_share_of_controls_is_that_of_training(trained):
    """Controls added to the audio's share give the same motion of latents as in training."""
    networks, params = FlowNetworks(CONFIG, DATA), trained[0]
    batch = batch_of(clips=1, frames=64, seed=3)
    z = jax.random.normal(jax.random.key(2), (64, 15))
    controls = jnp.linspace(-0.2, 0.6, 64)[:, None]

    @jax.jit
    def one_by_one(params):
        given = networks.audio_context(params, batch.audio[0], Extras(controls[None]))
        return proceed(networks, params, z[:, None], given, start(networks, params, 1), jnp.int32(0))[0][0]

    @jax.jit
    def at_once(params, before):
        ends = ((0, 0), (CONFIG.history_frames, CONFIG.lookahead_frames), (0, 0))
        clip = [jnp.pad(values, ends) for values in (batch.audio, before[None], controls[None])]
        return networks.motion(params, z[None], networks.conditioning(params, *clip[:2], None, Extras(clip[2])))[0]

    made = one_by_one(params)
    np.testing.assert_allclose(at_once(params, made), made, atol=1e-4)


def test_requested_values_are_the_same_in_any_window():
    curves = parse_curves(("speed=0@1 1@3", "height=0.25"), ("height", "speed"))
    training = jnp.stack([jnp.linspace(0.0, 0.4, 5), jnp.linspace(1.0, 2.0, 5)], axis=-1)
    values = lambda start, frames: requested(on_device(sampled(curves, start, frames, 32.0)), training)  # noqa: E731
    whole = values(0, 256)
    parts = [values(start, 128) for start in (0, 128)]
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-6)
    np.testing.assert_allclose(whole[:, 0], np.full(256, 0.1), atol=1e-6)
    np.testing.assert_allclose(whole[[0, 32, 64, 96, 255], 1], [1.0, 1.0, 1.5, 2.0, 2.0], atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"style_controls": ("width",)}, "--style-controls.*'width'"),
        ({"style_controls": ("height", "height")}, "each once"),
        ({"controls": ("energy=0.5",)}, "controls are: height"),
        ({"controls": ("height=101",)}, "from 0 to 1"),
        ({"controls": ("height=-1",)}, "from 0 to 1"),
        ({"controls": ("height=90",)}, "for the percentile 90 give 0.9"),
        ({"controls": ("height=0.1@0,90@4",)}, "for the percentile 90 give 0.9"),
        ({"controls": ("height=high",)}, "'high' is not a number"),
        ({"controls": ("height=nan",)}, "'nan' is not a number"),
        ({"controls": ("height",)}, "NAME=VALUE"),
        ({"controls": ("height=",)}, "NAME=VALUE"),
        ({"controls": ("height=0.1@0 0.9",)}, "NAME=VALUE"),
        ({"controls": ("height=0.1@2 0.9@1",)}, "seconds in ascending order"),
        ({"controls": ("height=0.9@-3",)}, "seconds from 0 on; got -3"),
        ({"controls": ("height=0.1@-1,0.9@2",)}, "seconds from 0 on; got -1"),
        ({"controls": ("height=0.1", "height=0.2")}, "twice"),
        ({"control_gains": ("height",)}, "--control-gain 'height': expected NAME=FACTOR"),
        ({"control_gains": ("height=0",)}, "a number above 0"),
        ({"control_gains": ("energy=2",)}, "controls are: height"),
        ({"control_gains": ("height=2", "height=3")}, "each once"),
    ],
)
def test_wrong_controls_are_named(changes, named):
    def make():
        if {"controls", "control_gains"} & set(changes):
            return build(CONFIG, DATA, StylizedFlowSampling(**changes))
        return replace(CONFIG, **changes)

    with pytest.raises(InputError, match=named):
        make()


def test_every_preset_of_every_model_can_be_trained_and_moglow_as_published(capsys):
    for name in MODELS:
        entry = find_model(name)
        for preset in entry.presets:
            assert entry.training_preset(preset).steps > 0
    flow = find_model("stylized_flow")
    for preset in ("moglow", "moglow_styled"):
        training = flow.training_preset(preset)
        assert (training.batch_size, training.steps, training.learning_rate) == (80, 80_000, 1.5e-3)
        assert (training.schedule, training.warmup_steps) == ("noam", 3_000)
        assert (training.clip_value, training.clip_norm) == (5.0, 100.0)
    assert flow.training_preset("ted").batch_size == 200
    assert flow.training_preset("paper").steps == 30_000
    assert PRESETS["moglow_styled"] == replace(PRESETS["moglow"], style_controls=("height", "speed", "radius"))
    assert main(["train", "stylized_flow", "--preset", "moglow", "--settings"]) == 0
    shown = capsys.readouterr().out
    assert "--hidden 512" in shown
    assert "--batch-size 80" in shown


def test_a_gain_stretches_requests_about_the_median_of_the_training_clips():
    training = on_device(np.random.default_rng(0).normal(size=(99, 1)), jnp.float32)
    quantiles = on_device([[0.5], [0.6], [1.0], [jnp.nan]])
    plain, stretched = requested(quantiles, training), requested(quantiles, training, (2.0,))
    median = np.median(training)
    np.testing.assert_allclose(stretched[:2] - median, 2.0 * (plain[:2] - median), atol=1e-6)
    np.testing.assert_allclose(stretched[2:], [[np.max(training)], [median]], atol=1e-6)


def test_speed_is_the_name_that_older_runs_have_for_energy():
    assert parse_curves(("speed=0.2",), ("height", "speed")) == parse_curves(("energy=0.2",), ("height", "energy"))
    assert build(replace(CONFIG, style_controls=("speed",)), DATA).controls.names == ("energy",)


def test_percentiles_of_runs_of_version_0_1_become_quantiles():
    assert from_percentiles("height=10@0 90@2.5") == "height=0.1@0 0.9@2.5"
    assert from_percentiles("height=7") == "height=0.07"
    assert from_percentiles("height") == "height"
