"""The model as a whole: loss, gradients, schedules, and sampling that does not depend on windows."""

from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models import find_model
from a2g_jax.models.audio2gestures.config import PRESETS
from a2g_jax.models.audio2gestures.model import build
from a2g_jax.models.audio2gestures.objective import code_noise
from a2g_jax.models.audio2gestures.objective import weights as loss_weights
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.base import Condition, Data
from a2g_jax.training.state import joint_loss

CONFIG = replace(
    PRESETS["tiny"],
    audio_channels=(8,),
    motion_channels=(8,),
    decoder_channels=(8,),
    head_channels=8,
    code_channels=4,
    clip_frames=6,
    kl_ramp_steps=10,
    alignment_ramp_steps=10,
    diversity_decay_steps=20,
    kl_shared_weight=0.01,
    kl_specific_weight=0.02,
    sampled_rotation_weight=0.5,
    sampled_speed_weight=2.0,
)
BANDS, JOINTS = 5, 5
SKELETON = Skeleton(
    np.random.default_rng(0).normal(scale=0.3, size=(JOINTS, 3)).astype(np.float32), tuple("abcde"), (-1, 0, 1, 1, 3)
)
DATA = Data(
    PoseSpace(SKELETON),
    30.0,
    BANDS,
    Statistics(
        np.random.default_rng(1).normal(size=(JOINTS, 6)).astype(np.float32), np.full((JOINTS, 6), 0.5, np.float32)
    ),
)
MODEL = build(CONFIG, DATA)
TERMS = ("rotation", "position", "speed", "alignment", "kl_shared", "kl_specific", "relaxed")
TERMS += ("sampled_rotation", "sampled_speed", "bicycle", "diversity")


def make_batch(dtype=np.float32, clips=2, frames=6):
    random = np.random.default_rng(2)
    turns = Rotation.random(clips * frames * JOINTS, rng=random).as_matrix()
    pose = np.concatenate([turns[:, :, 0], turns[:, :, 1]], axis=1).reshape(clips, frames, JOINTS, 6)
    return Batch(jnp.asarray(random.normal(size=(clips, frames, BANDS)), dtype), jnp.asarray(pose, dtype))


def make_params(dtype=np.float32, model=MODEL):
    """Like ``init``, without the seconds that compiling its random numbers takes."""
    random = np.random.default_rng(3)

    def fill(leaf):
        width = np.sqrt(1.5 / np.prod(leaf.shape[:-1])) if len(leaf.shape) > 1 else 0.3
        return jnp.asarray(random.normal(scale=width, size=leaf.shape), dtype)

    return jax.tree.map(fill, jax.eval_shape(model.init, jax.random.key(0)))


@pytest.fixture(scope="module")
def loss():
    """The loss compiled once; a second trace fails the test that causes it."""
    return jax.jit(chex.assert_max_traces(joint_loss(MODEL.stages[0]), n=1))


@pytest.fixture(scope="module")
def batch():
    return make_batch()


@pytest.fixture(scope="module")
def params():
    return make_params()


class TestLoss:
    def test_terms(self, loss, params, batch):
        total, terms = loss(params, jax.random.key(0), batch, jnp.int32(5))
        assert set(terms) == {*TERMS, "reconstruction", "shared_spread", "specific_spread"}
        assert np.isfinite(total)
        for name, value in terms.items():
            assert value.shape == ()
            assert np.isfinite(value), name
            assert value < 0 if name == "diversity" else value > 0, name

    @pytest.mark.parametrize(("step", "ramp", "decay"), [(0, 0, 1), (5, 0.5, 0.75), (10, 1, 0.5), (500, 1, 0)])
    def test_total_is_the_weighted_sum(self, loss, params, batch, step, ramp, decay):
        total, terms = loss(params, jax.random.key(0), batch, jnp.int32(step))
        schedule = {"alignment": ramp, "kl_shared": ramp, "kl_specific": ramp, "diversity": decay}
        expected = sum(getattr(CONFIG, f"{name}_weight") * schedule.get(name, 1) * terms[name] for name in TERMS)
        np.testing.assert_allclose(total, expected, rtol=1e-5)

    def test_the_key_decides(self, loss, params, batch):
        first, again, other = (loss(params, jax.random.key(n), batch, jnp.int32(5))[0] for n in (0, 0, 1))
        assert first == again
        assert first != other

    def test_traces_once(self, loss, params, batch):
        """Other values of every argument, the same compiled function (the fixture counts)."""
        other = jax.tree.map(lambda x: x + 1, params)
        values = {float(loss(p, jax.random.key(4), batch, jnp.int32(s))[0]) for p in (params, other) for s in (1, 9)}
        assert len(values) == 4


def test_schedules_of_zero_steps_are_constant():
    weights = loss_weights(replace(CONFIG, kl_ramp_steps=0, diversity_decay_steps=0))
    for step in (0, 10**9):
        assert weights(jnp.int32(step))["kl_shared"] == CONFIG.kl_shared_weight
        assert weights(jnp.int32(step))["kl_specific"] == CONFIG.kl_specific_weight
        assert weights(jnp.int32(step))["diversity"] == CONFIG.diversity_weight


def test_long_schedules_keep_their_precision():
    config = replace(CONFIG, kl_ramp_steps=100_000, diversity_decay_steps=500_000)
    weights = loss_weights(config)(jnp.int32(25_000))
    np.testing.assert_allclose(weights["kl_shared"], 0.25 * config.kl_shared_weight, rtol=1e-6)
    np.testing.assert_allclose(weights["diversity"], 0.95 * config.diversity_weight, rtol=1e-6)


def test_terms_of_weight_zero_cost_no_gradient(params, batch):
    """The re-encoding behind the bicycle loss is traced, but the gradient does not pass through it."""

    def convolutions(config):
        loss = joint_loss(build(config, DATA).stages[0])
        program = jax.make_jaxpr(jax.grad(lambda p: loss(p, jax.random.key(0), batch, jnp.int32(0))[0]))(params)
        return str(program).count("conv_general_dilated")

    assert convolutions(replace(CONFIG, bicycle_weight=0.0)) < convolutions(CONFIG)


@pytest.fixture(scope="module")
def double():
    """A function in double precision: params to the gradient of any weighting of the terms, and the terms."""
    with jax.enable_x64(True):
        batch, params = make_batch(np.float64), make_params(np.float64)

    def mixed(params, weights):
        total, terms = joint_loss(MODEL.stages[0])(params, jax.random.key(0), batch, jnp.int32(7))
        return sum(weights[name] * terms[name] for name in TERMS) + weights["total"] * total

    return jax.jit(jax.value_and_grad(mixed)), params


def unit(*names):
    return {name: jnp.asarray(1.0 if name in names else 0.0) for name in (*TERMS, "total")}


class TestGradient:
    def test_every_parameter_gets_one(self, double, x64):
        function, params = double
        gradient = function(params, unit("total"))[1]
        for path, leaf in jax.tree_util.tree_leaves_with_path(gradient):
            assert np.isfinite(leaf).all(), path
            assert np.abs(leaf).max() > 0, path

    # Codes under stop_gradient (the noise's statistics, the bicycle's target) make differences and gradient disagree on
    # purpose, so each network is checked on the terms that reach it by honest paths alone.
    @pytest.mark.parametrize(
        ("network", "terms"),
        [
            ("decoder", ("total",)),
            ("audio_encoder", ("total",)),
            ("mapping_net", tuple(name for name in TERMS if name != "bicycle")),
            ("motion_encoder", ("rotation", "position", "speed", "alignment", "kl_shared")),
        ],
    )
    def test_is_the_numerical_one(self, double, x64, network, terms):
        function, params = double
        weights = unit(*terms)
        gradient = function(params, weights)[1][network]
        random = np.random.default_rng(5)
        way = jax.tree.map(lambda leaf: random.normal(size=leaf.shape), params[network])
        step = 1e-6
        ahead, behind = (
            function(
                params | {network: jax.tree.map(lambda p, w, s=sign: p + s * step * w, params[network], way)}, weights
            )[0]
            for sign in (1, -1)
        )
        expected = (ahead - behind) / (2 * step)
        inner = sum(jax.tree.leaves(jax.tree.map(lambda g, w: np.sum(np.asarray(g) * w), gradient, way)))
        assert abs(expected) > 1e-3
        np.testing.assert_allclose(inner, expected, rtol=1e-5)

    def test_bicycle_does_not_move_its_own_target(self, double, x64):
        """Its gradient is that of the re-encoded motion: a bias at the mapping net's end also shifts the target."""
        function, params = double
        name = "GaussianHead_0"
        gradient = function(params, unit("bicycle"))[1]["mapping_net"][name]["Dense_1"]["bias"]
        step = 1e-6
        differences = []
        for channel in range(4):
            ends = []
            for sign in (1, -1):
                moved = jax.tree.map(lambda x: x, params)
                bias = moved["mapping_net"][name]["Dense_1"]["bias"]
                moved["mapping_net"][name]["Dense_1"]["bias"] = bias.at[channel].add(sign * step)
                ends.append(function(moved, unit("bicycle"))[0])
            differences.append((ends[0] - ends[1]) / (2 * step))
        assert np.abs(np.asarray(gradient) - np.asarray(differences)).max() > 1e-2


def test_code_noise_has_the_statistics_of_each_clip_and_no_gradient():
    code = jnp.asarray(np.random.default_rng(0).normal([[[3.0, -5.0]], [[0.0, 1.0]]], [[[0.1, 2.0]]], (2, 4000, 2)))
    noise = np.asarray(code_noise(jax.random.key(0), code))
    np.testing.assert_allclose(noise.mean(axis=1), np.mean(code, axis=1), atol=0.15)
    np.testing.assert_allclose(noise.std(axis=1), np.std(code, axis=1), rtol=0.05)
    gradient = jax.grad(lambda c: code_noise(jax.random.key(0), c).sum())(code[:, :5])
    np.testing.assert_array_equal(gradient, np.zeros((2, 5, 2)))


SUMMARY = {
    "specific_mean": jnp.asarray(np.random.default_rng(6).normal(size=(7, 4)), jnp.float32),
    "specific_std": jnp.asarray(np.random.default_rng(7).uniform(0.5, 1, size=(7, 4)), jnp.float32),
}
AUDIO = np.random.default_rng(8).normal(size=(384, BANDS)).astype(np.float32)


@pytest.mark.parametrize(("redraw_frames", "sample_codes"), [(48, True), (0, False)])
def test_samples_do_not_depend_on_windows(params, redraw_frames, sample_codes):
    model = build(CONFIG, DATA, Audio2GesturesSampling(redraw_frames=redraw_frames, sample_codes=sample_codes))
    assert model.halo == 5  # two frames of the decoder, three of the mapping net

    @jax.jit
    def sample(audio, key, start):
        return model.sample(params, SUMMARY, key, model.condition(params, {}, Condition(audio)), start)

    key = jax.random.key(0)
    whole = np.asarray(sample(AUDIO, key, jnp.int32(0)))
    assert whole.shape == (384, JOINTS, 6)
    for start in (0, 128):
        window = np.asarray(sample(AUDIO[start : start + 256], key, jnp.int32(start)))
        inner = slice(model.halo if start else 0, 256 - (model.halo if start == 0 else 0))
        np.testing.assert_allclose(window[inner], whole[start : start + 256][inner], atol=1e-5)
        edge = model.halo - 1 if start else 256 - model.halo
        assert np.abs(window[edge] - whole[start + edge]).max() > 1e-4  # no smaller halo would do
    other = np.asarray(sample(AUDIO, jax.random.key(1), jnp.int32(0)))
    assert np.abs(other - whole).mean() > 0.01
    louder = np.asarray(sample(2 * AUDIO, key, jnp.int32(0)))
    assert np.abs(louder - whole).mean() > 0.01


def test_reconstruct_and_summarise(params, batch):
    both = jax.jit(lambda p, b: (MODEL.reconstruct(p, b), MODEL.summarise(p, jax.random.key(0), b)))
    pose, summary = both(params, batch)
    assert pose.shape == batch.pose.shape
    assert {name: array.shape for name, array in summary.items()} == {"specific_mean": (2, 4), "specific_std": (2, 4)}
    assert (summary["specific_std"] > 0).all()
    # Clips do not see one another, and the audio plays no part.
    turned = Batch(2 * batch.audio, batch.pose[::-1])
    np.testing.assert_allclose(both(params, turned)[0], pose[::-1], atol=1e-6)


def test_init_gives_different_networks_for_different_keys():
    init = jax.jit(MODEL.init)
    first, again, other = (init(jax.random.key(n, impl="unsafe_rbg")) for n in (0, 0, 1))
    assert set(first) == {"audio_encoder", "motion_encoder", "decoder", "mapping_net"}
    chex.assert_trees_all_equal(first, again)
    for path, leaf in jax.tree_util.tree_leaves_with_path(first):
        assert np.isfinite(leaf).all()
        kernel = path[-1].key == "kernel"
        assert (np.abs(leaf).max() > 0) == kernel
    kernels = jax.tree.map(lambda a, b: float(np.abs(a - b).max()), first, other)
    assert max(jax.tree.leaves(kernels)) > 0.1


def test_dropout_is_on_in_training_alone(params, batch):
    """Counted in the traced program: compiling one with dropout takes long."""
    model = build(replace(CONFIG, dropout=0.5), DATA)

    def draws(model, part, *arguments):
        return str(jax.make_jaxpr(part(model))(*arguments)).count("random_bits")

    training = (lambda m: joint_loss(m.stages[0])), params, jax.random.key(0), batch, jnp.int32(5)
    assert draws(model, *training) > draws(MODEL, *training)
    assert draws(model, lambda m: m.reconstruct, params, batch) == 0


def test_registry():
    assert find_model("audio2gestures").config is type(PRESETS["paper"])
    assert find_model("audio2gestures").builder() is build
    with pytest.raises(InputError, match="no model 'gestures'; there are: audio2gestures"):
        find_model("gestures")
    assert build(PRESETS["paper"], DATA).halo == 124
