"""Speech2Gesture: losses and gradients of both networks, windows, clips of any length, learning."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import WIDTHS, PoseSpace
from a2g_jax.geometry.rotation import axis_angle_from_matrix, matrix_from_6d
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models import find_model
from a2g_jax.models.base import Condition, Data
from a2g_jax.models.speech2gesture.config import PRESETS
from a2g_jax.models.speech2gesture.model import build
from a2g_jax.models.speech2gesture.networks import translator_halo
from a2g_jax.training.state import joint_loss

CONFIG = replace(
    PRESETS["tiny"],
    audio_channels=(2, 2, 3, 3, 4, 4, 6, 6),
    channels=6,
    depth=2,
    decoder_layers=1,
    discriminator_channels=(4, 5, 6),
    clip_frames=16,
    value_speed_weight=0.5,
    adversarial_weight=0.7,
)
BANDS, ROWS = 10, 4


def make_data(representation="6d"):
    random = np.random.default_rng(0)
    shape = ROWS, WIDTHS[representation]
    mean = np.zeros(shape) if representation == "exponential" else random.normal(size=shape)
    statistics = Statistics(mean.astype(np.float32), random.uniform(0.3, 0.6, shape).astype(np.float32))
    body = Skeleton(random.normal(scale=0.3, size=(ROWS, 3)).astype(np.float32), tuple("abcd"), (-1, 0, 1, 1))
    if representation in ("keypoints", "directions"):
        bones = tuple((0, end) for end in range(1, ROWS + (representation == "directions")))
        body = PoseLayout(tuple("abcde"[: len(bones) + 1]), bones)
    return Data(PoseSpace(body, representation), 30.0, BANDS, statistics)


def make_batch(representation="6d", clips=2, frames=16, dtype=np.float32):
    random = np.random.default_rng(2)
    pose = random.normal(size=(clips, frames, ROWS, WIDTHS[representation]))
    if representation == "exponential":
        pose = np.asarray(axis_angle_from_matrix(matrix_from_6d(random.normal(size=(clips, frames, ROWS, 6)))))
    return Batch(jnp.asarray(random.normal(size=(clips, frames, BANDS)), dtype), jnp.asarray(pose, dtype))


def make_params(model, dtype=np.float32):
    """Like ``init``, without the seconds that compiling its random numbers takes; every bias and scale is drawn too."""
    random = np.random.default_rng(3)

    def fill(path, leaf):
        if path[-1].key == "scale":
            return jnp.asarray(random.uniform(0.5, 1.5, leaf.shape), dtype)
        width = np.sqrt(1.5 / np.prod(leaf.shape[:-1])) if len(leaf.shape) > 1 else 0.3
        return jnp.asarray(random.normal(scale=width, size=leaf.shape), dtype)

    return jax.tree_util.tree_map_with_path(fill, jax.eval_shape(model.init, jax.random.key(0)))


def terms_of(model, params, batch):
    return joint_loss(model.stages[0])(params, jax.random.key(0), batch, jnp.int32(0))


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


@pytest.fixture(scope="module")
def sides():
    """Gradients of the total, and of any one term, in double precision."""
    with jax.enable_x64(True):
        model = build(CONFIG, make_data())
        params, batch = make_params(model, np.float64), make_batch(dtype=np.float64)
    names = ("rotation", "position", "speed", "adversarial", "discriminator")

    def mixed(params, weights):
        total, terms = terms_of(model, params, batch)
        return weights["total"] * total + sum(weights[name] * terms[name] for name in names)

    function = jax.jit(jax.value_and_grad(mixed))
    choose = lambda *chosen: {n: jnp.asarray(1.0 if n in chosen else 0.0) for n in (*names, "total")}  # noqa: E731
    return function, params, choose


class TestBothNetworks:
    def test_the_discriminators_loss_does_not_move_the_translation_network(self, sides, x64):
        function, params, choose = sides
        gradient = function(params, choose("discriminator"))[1]
        assert max(np.abs(leaf).max() for leaf in jax.tree.leaves(gradient["generator"])) == 0
        for path, leaf in jax.tree_util.tree_leaves_with_path(gradient["discriminator"]):
            assert np.abs(leaf).max() > 0, path

    def test_the_translation_networks_losses_do_not_move_the_discriminator(self, sides, x64):
        function, params, choose = sides
        gradient = function(params, choose("rotation", "position", "speed", "adversarial"))[1]
        assert max(np.abs(leaf).max() for leaf in jax.tree.leaves(gradient["discriminator"])) == 0
        for path, leaf in jax.tree_util.tree_leaves_with_path(function(params, choose("adversarial"))[1]["generator"]):
            assert np.abs(leaf).max() > 0, path

    def test_one_gradient_of_the_total_is_both(self, sides, x64):
        function, params, choose = sides
        total = function(params, choose("total"))[1]
        judge = function(params, choose("discriminator"))[1]["discriminator"]
        jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-12), total["discriminator"], judge)
        parts = {n: function(params, choose(n))[1]["generator"] for n in ("rotation", "position", "speed")}
        fooled = function(params, choose("adversarial"))[1]["generator"]

        def check(whole, rotation, position, speed, fool):
            expected = rotation + position + CONFIG.speed_weight * speed + CONFIG.adversarial_weight * fool
            np.testing.assert_allclose(whole, expected, atol=1e-12)

        jax.tree.map(check, total["generator"], *parts.values(), fooled)

    @pytest.mark.parametrize(
        ("network", "terms"),
        [
            ("generator", ("rotation", "position", "speed", "adversarial")),
            ("discriminator", ("discriminator",)),
        ],
    )
    def test_is_the_numerical_one(self, sides, x64, network, terms):
        function, params, choose = sides
        gradient = function(params, choose(*terms))[1][network]
        random = np.random.default_rng(5)
        way = jax.tree.map(lambda leaf: random.normal(size=leaf.shape), params[network])
        step = 1e-7
        ahead, behind = (
            function(
                params | {network: jax.tree.map(lambda p, w, s=sign: p + s * step * w, params[network], way)},
                choose(*terms),
            )[0]
            for sign in (1, -1)
        )
        expected = (ahead - behind) / (2 * step)
        inner = sum(jax.tree.leaves(jax.tree.map(lambda g, w: np.sum(np.asarray(g) * w), gradient, way)))
        assert abs(expected) > 1e-3
        np.testing.assert_allclose(inner, expected, rtol=1e-4)


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
    data = Data(PoseSpace(make_data().body), 30.0, 64, make_data().pose_statistics)
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
    assert entry.build is build
    assert set(entry.poses) == set(WIDTHS)
    assert set(entry.presets) == {"tiny", "paper"}
