"""Our Audio2Gestures and its PyTorch twin: same weights, same noise, same numbers."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.data.batch import Batch
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models import audio2gestures
from a2g_jax.models.audio2gestures import objective
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.model import build
from a2g_jax.models.base import Data
from a2g_jax.models.motion_autoencoder.config import MotionAutoencoderConfig
from a2g_jax.models.motion_autoencoder.model import build as build_autoencoder
from a2g_jax.models.motion_autoencoder.model import encode
from a2g_jax.training.state import joint_loss

torch = pytest.importorskip("torch")
twins = pytest.importorskip("experiments.benchmarks.torch_twin")
weights = pytest.importorskip("experiments.benchmarks.torch_params")
layers = pytest.importorskip("experiments.benchmarks.torch_layers")

#: A small tree with forks: the compiler, not the sums, takes this test's time.
PARENTS = (-1, 0, 0, 1, 1, 2)
CLIPS, FRAMES, BANDS, JOINTS = 2, 16, 10, len(PARENTS)
CONFIG = audio2gestures.Audio2GesturesConfig(
    audio_channels=(8, 12),
    motion_channels=(16, 8),
    decoder_channels=(8, 12),
    head_channels=6,
    code_channels=4,
    clip_frames=FRAMES,
)
#: What Table 2, 4, 5 and 6 change in the networks and losses.
VARIANTS = {
    "gru": replace(CONFIG, backbone="gru", recurrent_layers=2, recurrent_channels=5),
    "transformer": replace(
        CONFIG, backbone="transformer", attention_layers=2, attention_channels=6, attention_hidden=9, attention_window=6
    ),
    # Two blocks to a clip.
    "dct": replace(CONFIG, latent="dct", dct_points=8),
    "no split": replace(CONFIG, split=False),
    "no mapping net": replace(CONFIG, mapping=False),
    # Longer than one window of the transform, and no multiple of its hop.
    "structural losses": replace(CONFIG, clip_frames=44, stft_weight=1.0, ssim_weight=1.0, lpips_weight=1.0),
}
#: Losses that the papers do not have, of weight 0 in their preset.
OURS = {"spread", "sampled_stft", "bicycle_shared"}
EYES = MotionAutoencoderConfig(encoder_channels=(7, 6, 5, 4), decoder_channels=(4,), clip_frames=16)


def _setting(dtype, config=CONFIG):
    """Codec, parameters, a batch of smooth motion and the key of a step; all from fixed seeds."""
    rng = np.random.default_rng(3)
    skeleton = Skeleton(rng.normal(0, 0.2, (JOINTS, 3)).astype(dtype), tuple("abcdef"), PARENTS)
    statistics = Statistics(np.zeros((JOINTS, 6), dtype), np.ones((JOINTS, 6), dtype))
    data = Data(PoseSpace(skeleton), 30.0, BANDS, statistics)
    features = None
    if config.lpips_weight > 0:
        eyes = jax.tree.map(lambda p: jnp.asarray(p, dtype), build_autoencoder(EYES, data).init(jax.random.key(8)))
        network = layers.TCN(6 * JOINTS, EYES.encoder_channels, EYES.kernel_size)
        weights.load_params(network, eyes["encoder"])
        data = data._replace(perceptual=lambda pose, data=data: encode(EYES, data, eyes, pose))
        features = network.blocks
    params = jax.tree.map(lambda p: jnp.asarray(p, dtype), Codec(config, data).init(jax.random.key(5)))
    # Biases start at zero; drawn ones show whether each reaches its place.
    params = jax.tree.map(lambda p: p + jnp.asarray(rng.normal(0, 0.05, p.shape), dtype), params)
    pose = np.cumsum(rng.normal(0, 0.1, (CLIPS, config.clip_frames, JOINTS, 6)), axis=1) + np.eye(3)[:2].reshape(6)
    batch = Batch(
        jnp.asarray(rng.normal(size=(CLIPS, config.clip_frames, BANDS)), dtype),
        jnp.asarray(pose, dtype),
    )
    twin = twins.Twin(config, skeleton, BANDS, features).to(getattr(torch, np.dtype(dtype).name))
    weights.load_params(twin, params)
    return data, params, batch, jax.random.key(11), twin


def _torch(array):
    return torch.from_numpy(np.array(array))


def _channels_second(array):
    return _torch(array).transpose(1, 2).contiguous()


def _noise(key, dtype, config):
    """What our step draws from its key, in the order in which it does."""
    keys = jax.random.split(key, 11 if config.split else 5)
    frames, channels = config.clip_frames, config.code_channels
    draws = [jax.random.normal(keys[i % len(keys)], (CLIPS, frames, channels), dtype) for i in range(5)]
    draws.append(jax.random.normal(keys[5 % len(keys)], (2 * CLIPS, frames, channels), dtype))
    return twins.Noise(*(_channels_second(draw) for draw in draws))


def _close(ours, theirs, tolerance):
    """Largest difference relative to the largest entry."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    assert ours.shape == theirs.shape
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance * max(np.abs(theirs).max(), 1e-3))


def test_networks_agree():
    data, params, batch, key, twin = _setting(np.float32)
    codec = Codec(CONFIG, data)
    close = partial(_close, tolerance=1e-4)

    @jax.jit
    def ours(params, batch):
        audio = codec.encode_audio(params, batch.audio)
        noise = jax.random.normal(key, audio.mean.shape)
        motion, mapped = codec.encode_motion(params, batch.pose), codec.map_noise(params, noise)
        return audio, noise, motion, mapped, codec.decode(params, noise, audio.mean)

    audio, noise, motion, mapped, pose = ours(params, batch)
    theirs = twin.audio_encoder(_channels_second(batch.audio))
    for mine, other in zip(audio, theirs, strict=True):
        close(mine, other.detach().transpose(1, 2))
    theirs = twin.motion_encoder(_torch(batch.pose).flatten(2).transpose(1, 2))
    for mine, other in zip(jax.tree.leaves(motion), [*theirs[0], *theirs[1]], strict=True):
        close(mine, other.detach().transpose(1, 2))
    theirs = twin.mapping_net(_channels_second(noise))
    for mine, other in zip(mapped, theirs, strict=True):
        close(mine, other.detach().transpose(1, 2))
    theirs = twin.decoder(_channels_second(noise), _channels_second(audio.mean))
    close(pose.reshape(CLIPS, FRAMES, -1), theirs.detach().transpose(1, 2))


def _compare(dtype, tolerance, config=CONFIG):
    data, params, batch, key, twin = _setting(dtype, config)
    model = build(config, data)
    theirs = twin.terms(_torch(batch.audio), _torch(batch.pose), _noise(key, dtype, config))
    weighted = set(objective.weights(config)(jnp.int32(0))) - OURS
    names = sorted(weighted & set(jax.eval_shape(joint_loss(model.stages[0]), params, key, batch, jnp.int32(0))[1]))
    assert sorted(theirs) == names

    def terms(params):
        values = joint_loss(model.stages[0])(params, key, batch, jnp.int32(0))[1]
        return jnp.stack([values[name] for name in names])

    @jax.jit
    def ours_with_gradients(params):
        values, pull = jax.vjp(terms, params)
        # One term after another: a loop compiles the backward pass once.
        return values, jax.lax.map(lambda row: pull(row)[0], jnp.eye(len(names), dtype=dtype))

    ours, ours_gradients = ours_with_gradients(params)
    for number, name in enumerate(names):
        np.testing.assert_allclose(float(ours[number]), theirs[name].item(), rtol=tolerance, err_msg=name)
        twin.zero_grad()
        theirs[name].backward(retain_graph=True)
        gradient = jax.tree.map(lambda g, i=number: g[i], ours_gradients)
        expected = weights.gradients(twin)
        largest = max(np.abs(leaf).max() for leaf in jax.tree.leaves(expected))
        assert largest > 0, name
        jax.tree.map(
            lambda g, e, scale=largest: np.testing.assert_allclose(
                np.asarray(g), e, rtol=tolerance, atol=tolerance * scale
            ),
            gradient,
            expected,
        )


@pytest.mark.slow  # in double precision quickly
def test_losses_and_gradients_agree():
    _compare(np.float32, 1e-3)


def test_losses_and_gradients_agree_in_double_precision(x64):
    _compare(np.float64, 1e-9)


@pytest.mark.parametrize("name", VARIANTS)
def test_variants_agree(name):
    """Outputs are compared too: every loss is of them."""
    _compare(np.float32, 1e-3, VARIANTS[name])


@pytest.mark.parametrize("name", ["gru", "transformer", "dct"])
def test_encoders_agree(name):
    config = VARIANTS[name]
    data, params, batch, _, twin = _setting(np.float32, config)
    codec = Codec(config, data)
    ours = jax.jit(lambda p, b: (codec.encode_audio(p, b.audio), codec.encode_motion(p, b.pose)))(params, batch)
    theirs = (
        twin._encode(twin.audio_encoder, _channels_second(batch.audio)),
        twin._encode(twin.motion_encoder, _torch(batch.pose).flatten(2).transpose(1, 2)),
    )
    for mine, other in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_allclose(mine, other.detach().transpose(1, 2), atol=1e-4)


def test_loss_weights_agree():
    config = replace(VARIANTS["structural losses"], alignment_ramp_steps=40_000)
    *_, twin = _setting(np.float32, config)
    weights = objective.weights(config)(jnp.int32(30_000))
    ours = {name: float(weight) for name, weight in weights.items()}
    assert all(ours.pop(name) == 0.0 for name in OURS)
    assert ours == pytest.approx(twin.weights(30_000))


def test_load_params_refuses_other_networks():
    _, params, _, _, twin = _setting(np.float32)
    with pytest.raises(ValueError, match="Expected the parameters"):
        weights.load_params(twin, {name: params[name] for name in ("audio_encoder", "decoder", "mapping_net")})
    narrow = {"kernel": np.zeros((3, 4, 5)), "bias": np.zeros(4)}
    wrong = {**params, "mapping_net": {**params["mapping_net"], "Conv1D_0": narrow}}
    with pytest.raises(ValueError, match="of shape"):
        weights.load_params(twin, wrong)
