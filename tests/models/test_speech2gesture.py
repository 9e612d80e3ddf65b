"""Speech2Gesture: losses of both networks, windows, clips of any length, learning."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
from speech2gesture_for_tests import BANDS, CONFIG, ROWS, make_batch, make_data, make_params, terms_of

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models import find_model
from a2g_jax.models.base import Condition, Data
from a2g_jax.models.speech2gesture.config import PRESETS
from a2g_jax.models.speech2gesture.model import build
from a2g_jax.models.speech2gesture.networks import translator_halo

EXPECTED = {
    "6d": {"rotation", "position", "speed"},
    "exponential": {"rotation", "position", "speed"},
    "keypoints": {"value", "value_speed"},
    "directions": {"value", "value_speed"},
}


@pytest.mark.parametrize(
    ("representation", "weight"),
    [("6d", 0.0), ("6d", 0.7), ("exponential", 0.7), ("keypoints", 0.0), ("directions", 0.7)],
)
def test_terms_and_their_sum(representation, weight):
    config = replace(CONFIG, adversarial_weight=weight)
    model = build(config, make_data(representation))
    params = make_params(model)
    total, terms = jax.jit(lambda p, b: terms_of(model, p, b))(params, make_batch(representation))
    assert set(terms) == EXPECTED[representation] | ({"adversarial", "discriminator"} if weight else set())
    assert all(np.isfinite(value) and value > 0 for value in terms.values())
    expected = sum(getattr(config, f"{name}_weight", 1.0) * value for name, value in terms.items())
    np.testing.assert_allclose(total, expected, rtol=1e-5)


def test_terms_of_a_constant_discriminator():
    """The least-squares formula with the output of a constant discriminator."""
    model = build(CONFIG, make_data("keypoints"))
    params = make_params(model)
    silent = jax.tree.map(jnp.zeros_like, params["discriminator"])
    silent["StridedConv1D_3"]["bias"] = jnp.asarray([0.3])
    terms = jax.jit(lambda p: terms_of(model, p, make_batch("keypoints"))[1])(params | {"discriminator": silent})
    np.testing.assert_allclose(terms["adversarial"], 0.7**2, rtol=1e-5)
    np.testing.assert_allclose(terms["discriminator"], 0.7**2 + 0.3**2, rtol=1e-5)


def test_weight_zero_leaves_the_discriminator_out():
    def build_with(weight):
        model = build(replace(CONFIG, adversarial_weight=weight), make_data())
        params = jax.eval_shape(model.init, jax.random.key(0))
        program = jax.make_jaxpr(jax.grad(lambda p: terms_of(model, p, make_batch())[0]))(params)
        return set(params), str(program).count("dot_general")

    without, products = build_with(0.0)
    assert without == {"generator"}
    both, more = build_with(1.0)
    assert both == {"generator", "discriminator"}
    assert products < more


@pytest.mark.parametrize("frames", [1, 14])
def test_clips_of_any_length(frames):
    """A clip that is not a multiple of the stride gives the same motion as its audio followed by zeros."""
    model = build(CONFIG, make_data())
    params = make_params(model)
    audio = make_batch(frames=frames).audio
    whole = -(-frames // CONFIG.stride) * CONFIG.stride
    batch = Batch(audio, jnp.zeros((2, frames, ROWS, 6)))
    longer = Batch(jnp.pad(audio, ((0, 0), (0, whole - frames), (0, 0))), jnp.zeros((2, whole, ROWS, 6)))
    reconstruct = jax.jit(model.reconstruct)
    pose = reconstruct(params, batch)
    assert pose.shape == (2, frames, ROWS, 6)
    np.testing.assert_allclose(pose, reconstruct(params, longer)[:, :frames], atol=1e-5)


AUDIO = np.random.default_rng(8).normal(size=(384, BANDS)).astype(np.float32)


def test_samples_do_not_depend_on_windows():
    model = build(CONFIG, make_data())
    params = make_params(model)

    @jax.jit
    def sample(audio, key, start):
        return model.sample(params, {}, key, model.condition(params, {}, Condition(audio)), start)

    key = jax.random.key(0)
    whole = np.asarray(sample(AUDIO, key, jnp.int32(0)))
    assert whole.shape == (384, ROWS, 6)
    for start in (0, 128):
        window = np.asarray(sample(AUDIO[start : start + 256], key, jnp.int32(start)))
        inner = slice(model.halo if start else 0, 256 - (model.halo if start == 0 else 0))
        np.testing.assert_allclose(window[inner], whole[start : start + 256][inner], atol=1e-5)
    np.testing.assert_array_equal(sample(AUDIO, jax.random.key(1), jnp.int32(0)), whole)  # one audio, one motion
    louder = np.asarray(sample(2 * AUDIO, key, jnp.int32(0)))
    assert np.abs(louder - whole).mean() > 0.3 * whole.std(axis=0).mean()


@pytest.mark.parametrize("depth", [1, 3])
def test_halo_is_how_far_an_output_depends_on_the_audio(depth):
    """To the frame: by the gradient of every output frame with respect to the audio."""
    config = replace(CONFIG, depth=depth)
    model = build(config, make_data())
    params = make_params(model)
    frames, stride = 128, config.stride
    audio = jnp.asarray(AUDIO[:frames])
    middle = frames // 2

    def change(frame):
        return jax.grad(lambda a: jnp.sum(jnp.sin(model.condition(params, {}, Condition(a))[frame])))(audio)

    reached = np.abs(np.asarray(jax.jit(jax.vmap(change))(jnp.arange(middle, middle + stride)))).sum(axis=-1) > 0
    reach = 0
    for offset, row in enumerate(reached):
        (places,) = np.nonzero(row)
        reach = max(reach, middle + offset - places[0], places[-1] - middle - offset)
    assert translator_halo(config) == reach == model.halo


def test_the_papers_networks():
    """Eight layers of audio encoder and sixteen of U-Net, and a halo that one block of context covers."""
    config = PRESETS["paper"]
    data = Data(PoseSpace(make_data().space.body), 30.0, 64, make_data().pose_statistics)
    shapes = jax.eval_shape(build(config, data).init, jax.random.key(0))["generator"]
    layers = lambda tree: sum(1 for name in tree if "Conv" in name)  # noqa: E731
    assert layers(shapes["AudioEncoder_0"]) == 8
    assert shapes["AudioEncoder_0"]["Conv1D_0"]["kernel"].shape == (3, 8 * 256, 256)
    assert layers(shapes["UNet_0"]) == 16
    assert translator_halo(config) == 107


@pytest.mark.parametrize("representation", ["6d", "keypoints"])
def test_a_little_training_learns_the_motion_of_an_audio(representation):
    config = replace(CONFIG, channels=16, adversarial_weight=0.1)
    model = build(config, make_data(representation))
    batch = make_batch(representation)
    params = make_params(model)
    optimiser = optax.adam(1e-2)

    @jax.jit
    def step(params, state):
        (_, terms), gradient = jax.value_and_grad(lambda p: terms_of(model, p, batch), has_aux=True)(params)
        updates, state = optimiser.update(gradient, state, params)
        return optax.apply_updates(params, updates), state, terms

    state, history = optimiser.init(params), []
    for _ in range(40):
        params, state, terms = step(params, state)
        history.append({name: float(value) for name, value in terms.items()})
    regression = "position" if representation == "6d" else "value"
    assert history[-1][regression] < 0.8 * history[0][regression]
    assert history[-1]["discriminator"] < 0.9 * history[0]["discriminator"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"audio_channels": (8, 8)}, "expected 8 numbers above 0"),
        ({"discriminator_channels": ()}, "--discriminator-channels"),
        ({"channels": 0}, "--channels: expected 1 or more"),
        ({"depth": 8}, "from 1 to 7; got 8"),
        ({"decoder_layers": -1}, "--decoder-layers"),
        ({"clip_frames": 1}, "--clip-frames"),
        ({"adversarial_weight": -1.0}, "--adversarial-weight: expected 0 or more"),
    ],
)
def test_settings_are_checked(change, message):
    with pytest.raises(InputError, match=message):
        replace(CONFIG, **change)


def test_registry():
    entry = find_model("speech2gesture")
    assert entry.builder() is build
    assert entry.poses == ()
    assert set(entry.presets) == {"tiny", "paper"}
