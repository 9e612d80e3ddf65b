"""Backbones, the DCT latent space, ablations, structured losses, and poses without a skeleton."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from audio2gestures_for_tests import MAPPING
from jax.test_util import check_grads
from scipy.spatial.transform import Rotation

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.dct import block_dct
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.rotation import matrix_to_6d
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.config import PRESETS
from a2g_jax.models.audio2gestures.model import build
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.base import Condition, Data
from a2g_jax.training.state import joint_loss
from tests.arrays_for_tests import on_device

BANDS, JOINTS, FRAMES = 5, 4, 32
RNG = np.random.default_rng(0)
SKELETON = Skeleton(RNG.normal(scale=0.3, size=(JOINTS, 3)).astype(np.float32), tuple("abcd"), (-1, 0, 1, 1))
DATA = Data(
    PoseSpace(SKELETON),
    30.0,
    BANDS,
    Statistics(RNG.normal(size=(JOINTS, 6)).astype(np.float32), np.full((JOINTS, 6), 0.5, np.float32)),
)
KEYPOINTS = Data(
    PoseSpace(PoseLayout(tuple("abcd"), ((0, 1), (1, 2), (1, 3))), "keypoints"),
    15.0,
    BANDS,
    Statistics(RNG.normal(size=(JOINTS, 2)).astype(np.float32), np.full((JOINTS, 2), 3.0, np.float32)),
)
EXPONENTIAL = Data(
    PoseSpace(SKELETON, "exponential"),
    20.0,
    BANDS,
    Statistics(RNG.normal(scale=0.3, size=(JOINTS, 3)).astype(np.float32), np.full((JOINTS, 3), 0.5, np.float32)),
)
BASE = replace(
    PRESETS["tiny"],
    audio_channels=(6,),
    motion_channels=(6,),
    decoder_channels=(6,),
    head_channels=6,
    code_channels=3,
    clip_frames=FRAMES,
    dct_points=FRAMES,
    kl_ramp_steps=0,
    alignment_ramp_steps=0,
    **MAPPING,
)
VARIANTS = {
    "gru": {"backbone": "gru", "recurrent_layers": 2, "recurrent_channels": 3},
    "transformer": {"backbone": "transformer", "attention_layers": 2, "attention_channels": 4, "attention_hidden": 6},
    "dct": {"latent": "dct"},
    "no split": {"split": False},
    "no mapping": {"mapping": False},
    "structured": {"stft_weight": 0.5, "ssim_weight": 0.5},
    "steps": {"specific_frames": 8},
    "authors": {
        "initialisation": "normal",
        "reductions": "authors",
        "kl_restarts": True,
        "kl_ramp_steps": 10,
        "bicycle_shared_weight": 0.1,
        "diversity_reference": "transfer",
    },
    "relative": {"relative_losses": True, "sampled_stft_weight": 0.1, "free_nats": 1e-3},
}


def batch(data, frames=FRAMES, dtype=np.float32):
    random = np.random.default_rng(1)
    width = data.pose_statistics.mean.shape
    pose = np.cumsum(random.normal(scale=0.1, size=(2, frames, *width)), axis=1) + 1.0
    return Batch(on_device(random.normal(size=(2, frames, BANDS)), dtype), on_device(pose, dtype))


def params_of(model, dtype=np.float32):
    """Random ones for every leaf, biases too."""
    random = np.random.default_rng(3)

    def fill(leaf):
        width = np.sqrt(1.5 / np.prod(leaf.shape[:-1])) if len(leaf.shape) > 1 else 0.3
        return on_device(random.normal(scale=width, size=leaf.shape), dtype)

    return jax.tree.map(fill, jax.eval_shape(model.init, jax.random.key(0)))


#: Variants that are trained together, and their poses: each program takes seconds to compile.
TRAINED = {
    "gru, authors": ("gru", "authors"),
    "transformer, steps, relative": ("transformer", "steps", "relative"),
    "dct": ("dct",),
    "no split": ("no split",),
}
POSES = {"gru, authors": EXPONENTIAL, "transformer, steps, relative": KEYPOINTS}


@pytest.mark.parametrize("name", TRAINED)
def test_every_parameter_learns(name):
    data, config = POSES.get(name, DATA), BASE
    for variant in TRAINED[name]:
        config = replace(config, **VARIANTS[variant])
    model = build(config, data)
    params = params_of(model)
    step = jax.jit(jax.value_and_grad(joint_loss(model.stages[0]), has_aux=True))
    (loss, terms), gradient = jax.device_get(step(params, jax.random.key(0), batch(data), jnp.int32(5)))
    assert np.isfinite(loss)
    assert all(np.isfinite(value) for value in terms.values())
    for path, leaf in jax.tree_util.tree_leaves_with_path(gradient):
        assert np.abs(leaf).max() > 0, jax.tree_util.keystr(path)
    assert ("rotation" in terms) == (data is not KEYPOINTS)
    assert ("bicycle" in terms) == (name != "no split")
    assert ("mapping_net" in params) == (name != "no split")
    assert ("kl_shared" in terms) == (name != "dct")


def test_exponential_maps_are_the_rotations_they_stand_for():
    """The losses on poses are the same for both ways to write rotations."""
    pose = on_device(np.random.default_rng(4).normal(scale=0.5, size=(2, FRAMES, JOINTS, 3)), jnp.float32)
    codec = Codec(BASE, EXPONENTIAL)
    rotations, places = jax.jit(codec.positions)(pose)
    expected = Rotation.from_rotvec(np.asarray(pose).reshape(-1, 3)).as_matrix().reshape(*pose.shape, 3)
    np.testing.assert_allclose(rotations, expected, atol=1e-5)
    same = jax.jit(lambda rotations: Codec(BASE, DATA).positions(matrix_to_6d(rotations)))(np.float32(expected))
    np.testing.assert_allclose(places, same[1], atol=1e-5)
    np.testing.assert_array_equal(codec.valid(pose, rotations), pose)


@pytest.mark.parametrize(
    "name", ["transformer", "dct", "no mapping", "steps", pytest.param("no split", marks=pytest.mark.slow)]
)
def test_windows_give_the_motion_of_one_pass(name):
    model = build(replace(BASE, **VARIANTS[name]), DATA)
    params = params_of(model)
    code = on_device(np.random.default_rng(6).uniform(0.5, 1, size=(4, 3)), jnp.float32)
    summary = {"specific_mean": code, "specific_std": code}
    audio = np.random.default_rng(8).normal(size=(1152, BANDS)).astype(np.float32)

    @jax.jit
    def sample(audio, start):
        return model.sample(params, summary, jax.random.key(0), model.condition(params, {}, Condition(audio)), start)

    # Both are of 1024 frames, and agree where neither end is near: one program.
    whole, window = (np.asarray(sample(audio[first : first + 1024], jnp.int32(first))) for first in (0, 128))
    halo = model.halo
    assert halo < 400
    np.testing.assert_allclose(window[halo : 896 - halo], whole[128 + halo : 1024 - halo], atol=2e-5)
    assert np.abs(np.asarray(sample(audio[1023::-1], jnp.int32(0))) - whole).mean() > 1e-3


def test_a_gru_forgets_within_its_context():
    """Its memory is unbounded; beyond the context of generation its effect is far below a millimetre."""
    model = build(replace(BASE, **VARIANTS["gru"]), DATA)
    params = params_of(model)
    random = np.random.default_rng(8)
    audio = random.normal(size=(640, BANDS)).astype(np.float32)
    other = np.concatenate([random.normal(size=(128, BANDS)).astype(np.float32), audio[128:]])
    encode = jax.jit(lambda audio: model.condition(params, {}, Condition(audio)).shared.mean)
    first, second = np.asarray(encode(audio))[0], np.asarray(encode(other))[0]
    assert np.abs(first - second)[:128].max() > 0.1
    assert np.abs(first - second)[128 + 256 :].max() < 1e-5


def test_the_shared_code_of_the_dct_space_is_certain_and_the_specific_one_has_a_spread_for_each_band():
    config = replace(BASE, latent="dct")
    codec = Codec(config, DATA)
    params = params_of(build(config, DATA))
    encode, pose = jax.jit(codec.encode_motion), batch(DATA, 2 * FRAMES).pose
    shared, specific = encode(params, pose)
    np.testing.assert_array_equal(shared.sample(jax.random.key(0)), shared.mean)
    assert np.asarray(specific.log_variance).std(axis=1).min() > 0
    # The shared head is linear, so it is the same in time and in bands.
    alone = encode(params, np.asarray(pose)[:, FRAMES:])[0]
    np.testing.assert_allclose(np.asarray(shared.mean)[:, FRAMES:], alone.mean, atol=1e-5)
    back = jax.jit(lambda mean: block_dct(codec.to_frames(mean), FRAMES))(shared.mean)
    np.testing.assert_allclose(back, shared.mean, atol=1e-5)
    with pytest.raises(ValueError, match="multiple of 32 frames"):
        codec.encode_motion(params, batch(DATA, 40).pose)


def test_edits_are_made_in_generation_alone():
    plain = build(replace(BASE, latent="dct"), DATA)
    edited = build(
        replace(BASE, latent="dct"), DATA, Audio2GesturesSampling(edits=("specific keep 0", "shared sample 0:32 3"))
    )
    params = params_of(plain)
    summary = {"specific_mean": jnp.ones((1, 3)), "specific_std": jnp.ones((1, 3))}
    audio = batch(DATA, 128).audio[0]

    def motions(model):
        @jax.jit
        def sample(key):
            return model.sample(params, summary, key, model.condition(params, {}, Condition(audio)), jnp.int32(0))

        return (np.asarray(sample(jax.random.key(number))) for number in (0, 1))

    first, second = motions(edited)
    np.testing.assert_allclose(first, second, atol=1e-5)  # nothing that is drawn is left
    first, second = motions(plain)
    assert np.abs(first - second).max() > 1e-3
    trained = (
        str(jax.make_jaxpr(joint_loss(model.stages[0]))(params, jax.random.key(0), batch(DATA), jnp.int32(0)))
        for model in (plain, edited)
    )
    assert next(trained) == next(trained)


def test_gradients_of_structured_and_perceptual_losses(x64):
    """Of the whole objective, against differences."""
    weights = on_device(np.random.default_rng(9).normal(size=(JOINTS * 6, 3)))

    def features(pose):
        return [jnp.tanh(pose.reshape(*pose.shape[:2], -1) @ weights.astype(pose.dtype))]

    silent = {f"{name}_weight": 0.0 for name in ("rotation", "relaxed", "bicycle", "diversity", "sampled_rotation")}
    config = replace(BASE, **silent, stft_weight=0.5, ssim_weight=0.5, lpips_weight=0.5)
    model = build(config, DATA._replace(perceptual=features))
    params, clips = params_of(model, np.float64), batch(DATA, dtype=np.float64)
    bias = params["decoder"]["Dense_0"]["bias"]

    @jax.jit
    def loss(bias):
        decoder = {**params["decoder"], "Dense_0": {**params["decoder"]["Dense_0"], "bias": bias}}
        return joint_loss(model.stages[0])({**params, "decoder": decoder}, jax.random.key(0), clips, jnp.int32(5))

    check_grads(lambda bias: loss(bias)[0], (bias,), order=1, modes=["rev"], atol=1e-3, rtol=1e-3)
    terms = loss(bias)[1]
    assert min(terms[name] for name in ("stft", "ssim", "lpips")) > 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stft_weight": 1.0, "clip_frames": 16}, "clips of 32 frames or more"),
        ({"backbone": "rnn"}, "expected one of tcn, gru, transformer"),
        ({"latent": "dct", "clip_frames": 40}, "multiple of --dct-points 32"),
        ({"latent": "dct", "split": False}, "no DCT variant"),
        ({"latent": "dct", "dct_points": 24, "clip_frames": 24}, "divisor of 128"),
        ({"attention_window": 7}, "an even number"),
        ({"recurrent_layers": 0}, "--recurrent-layers: expected 1 or more"),
        ({"specific_frames": 24}, "--specific-frames: expected a divisor of 128"),
        ({"specific_frames": 64}, "multiple of --specific-frames 64"),
        ({"latent": "dct", "specific_frames": 2}, "it needs --specific-frames 1"),
        ({"stored_codes": True, "split": False}, "--stored-codes: needs --split true"),
        ({"adversarial_steps": 2, "split": False}, "--adversarial-steps: needs --split true"),
        ({"adversarial_steps": 2, "latent": "dct"}, "needs --adversarial-steps 0"),
        ({"smoothing": -1}, "--smoothing: expected 0 or more"),
        ({"reductions": "mean"}, "--reductions: expected one of paper, authors"),
        ({"initialisation": "zero"}, "--initialisation: expected one of xavier, normal"),
        ({"free_nats": -1.0}, "--free-nats: expected 0 or more"),
    ],
)
def test_refused(changes, message):
    with pytest.raises(InputError, match=message):
        build(replace(BASE, **changes), DATA)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"edits": ("shared swap 0:3",)}, "from Python only"),
        ({"edits": ("shared blur",)}, "for example"),
        ({"keep_shared": 33}, "there are 32 bands"),
        ({"redraw_frames": -1}, "--redraw-frames: expected 0 or more"),
    ],
)
def test_refused_in_generation(changes, message):
    with pytest.raises(InputError, match=message):
        build(BASE, DATA, Audio2GesturesSampling(**changes))


def test_perceptual_losses_need_a_feature_network():
    assert build(replace(BASE, lpips_weight=1.0), DATA).needs_perceptual
    assert not build(BASE, DATA).needs_perceptual
