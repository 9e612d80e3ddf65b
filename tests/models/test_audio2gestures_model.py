"""The model as a whole: loss, schedules, and sampling that does not depend on windows."""

from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from audio2gestures_for_tests import BANDS, CONFIG, DATA, JOINTS, MODEL, TERMS, make_batch, make_params

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.models import find_model
from a2g_jax.models.audio2gestures.config import PRESETS
from a2g_jax.models.audio2gestures.model import build
from a2g_jax.models.audio2gestures.objective import code_noise
from a2g_jax.models.audio2gestures.objective import weights as loss_weights
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.base import Condition
from a2g_jax.training.state import joint_loss


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
    # Clips do not affect one another, and the audio is not used.
    turned = Batch(2 * batch.audio, batch.pose[::-1])
    np.testing.assert_allclose(both(params, turned)[0], pose[::-1], atol=1e-6)


def test_init_gives_different_networks_for_different_keys():
    init = jax.jit(MODEL.init)
    first, again, other = (init(jax.random.key(n, impl="unsafe_rbg")) for n in (0, 0, 1))
    assert set(first) == {"audio_encoder", "motion_encoder", "decoder", "mapping_net"}
    chex.assert_trees_all_equal(first, again)
    for path, leaf in jax.tree_util.tree_leaves_with_path(first):
        assert np.isfinite(leaf).all()
        if path[-1].key == "bias":
            # Log-variances begin low; a constant has no spread.
            assert np.ptp(leaf) == 0
            assert leaf.max() in (0.0, CONFIG.initial_log_variance)
        else:
            assert np.ptp(leaf) > 0
    kernels = jax.tree.map(lambda a, b: float(np.abs(a - b).max()), first, other)
    assert max(jax.tree.leaves(kernels)) > 0.1


def test_dropout_is_on_in_training_only(params, batch):
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
