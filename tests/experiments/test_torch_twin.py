"""Our Audio2Gestures and its PyTorch twin: same weights, same noise, same numbers."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models import audio2gestures
from a2g_jax.models.audio2gestures import objective
from a2g_jax.models.audio2gestures.codec import Networks
from a2g_jax.models.base import Batch, Data

torch = pytest.importorskip("torch")
twins = pytest.importorskip("experiments.benchmarks.torch_twin")

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
TERMS = (
    "rotation",
    "position",
    "speed",
    "alignment",
    "kl_shared",
    "kl_specific",
    "relaxed",
    "sampled_rotation",
    "sampled_speed",
    "bicycle",
    "diversity",
)


def _setting(dtype):
    """Networks, parameters, a batch of smooth motion and the key of a step; all from fixed seeds."""
    rng = np.random.default_rng(3)
    skeleton = Skeleton(rng.normal(0, 0.2, (JOINTS, 3)).astype(dtype), tuple("abcdef"), PARENTS)
    statistics = Statistics(np.zeros((JOINTS, 6), dtype), np.ones((JOINTS, 6), dtype))
    data = Data(skeleton, 30.0, BANDS, statistics)
    params = jax.tree.map(lambda p: jnp.asarray(p, dtype), Networks(CONFIG, data).init(jax.random.key(5)))
    # Biases start at zero; drawn ones show whether each reaches its place.
    params = jax.tree.map(lambda p: p + jnp.asarray(rng.normal(0, 0.05, p.shape), dtype), params)
    pose = np.cumsum(rng.normal(0, 0.1, (CLIPS, FRAMES, JOINTS, 6)), axis=1) + np.eye(3)[:2].reshape(6)
    batch = Batch(
        jnp.asarray(rng.normal(size=(CLIPS, FRAMES, BANDS)), dtype),
        jnp.asarray(pose, dtype),
    )
    twin = twins.Twin(CONFIG, skeleton, BANDS).to(getattr(torch, np.dtype(dtype).name))
    twins.load_params(twin, params)
    return data, params, batch, jax.random.key(11), twin


def _torch(array):
    return torch.from_numpy(np.array(array))


def _channels_second(array):
    return _torch(array).transpose(1, 2).contiguous()


def _noise(key, dtype):
    """What our step draws from its key, in the order in which it does."""
    keys = jax.random.split(key, 10)
    draws = [jax.random.normal(keys[i], (CLIPS, FRAMES, CONFIG.code_channels), dtype) for i in range(5)]
    draws.append(jax.random.normal(keys[5], (2 * CLIPS, FRAMES, CONFIG.code_channels), dtype))
    return twins.Noise(*(_channels_second(draw) for draw in draws))


def _close(ours, theirs, tolerance):
    """Largest difference relative to the largest entry."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    assert ours.shape == theirs.shape
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance * max(np.abs(theirs).max(), 1e-3))


def test_networks_agree():
    data, params, batch, key, twin = _setting(np.float32)
    networks = Networks(CONFIG, data)
    close = partial(_close, tolerance=1e-4)

    @jax.jit
    def ours(params, batch):
        audio = networks.encode_audio(params, batch.audio)
        noise = jax.random.normal(key, audio.mean.shape)
        motion, mapped = networks.encode_motion(params, batch.pose), networks.map_noise(params, noise)
        return audio, noise, motion, mapped, networks.decode(params, noise, audio.mean)

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


def _compare(dtype, tolerance):
    data, params, batch, key, twin = _setting(dtype)
    model = audio2gestures.build(CONFIG, data)

    def terms(params):
        values = model.loss(params, key, batch, jnp.int32(0))[1]
        return jnp.stack([values[name] for name in TERMS])

    @jax.jit
    def ours_with_gradients(params):
        values, pull = jax.vjp(terms, params)
        # One term after another: a loop compiles the backward pass once.
        return values, jax.lax.map(lambda row: pull(row)[0], jnp.eye(len(TERMS), dtype=dtype))

    ours, ours_gradients = ours_with_gradients(params)
    theirs = twin.terms(_torch(batch.audio), _torch(batch.pose), _noise(key, dtype))
    assert set(theirs) == set(TERMS)
    for number, name in enumerate(TERMS):
        np.testing.assert_allclose(float(ours[number]), theirs[name].item(), rtol=tolerance, err_msg=name)
        twin.zero_grad()
        theirs[name].backward(retain_graph=True)
        gradient = jax.tree.map(lambda g, i=number: g[i], ours_gradients)
        expected = twins.gradients(twin)
        largest = max(np.abs(leaf).max() for leaf in jax.tree.leaves(expected))
        assert largest > 0, name
        jax.tree.map(
            lambda g, e, scale=largest: np.testing.assert_allclose(
                np.asarray(g), e, rtol=tolerance, atol=tolerance * scale
            ),
            gradient,
            expected,
        )


def test_losses_and_gradients_agree():
    _compare(np.float32, 1e-3)


def test_losses_and_gradients_agree_in_double_precision(x64):
    _compare(np.float64, 1e-9)


def test_loss_weights_agree():
    *_, twin = _setting(np.float32)
    weights = objective.weights(CONFIG)(jnp.int32(30_000))
    assert {name: float(weight) for name, weight in weights.items()} == pytest.approx(twin.weights(30_000))
    assert set(weights) == set(TERMS)


def test_load_params_refuses_other_networks():
    _, params, _, _, twin = _setting(np.float32)
    with pytest.raises(ValueError, match="Expected the parameters"):
        twins.load_params(twin, {name: params[name] for name in ("audio_encoder", "decoder", "mapping_net")})
    narrow = {"kernel": np.zeros((3, 4, 5)), "bias": np.zeros(4)}
    wrong = {**params, "mapping_net": {**params["mapping_net"], "Conv1D_0": narrow}}
    with pytest.raises(ValueError, match="of shape"):
        twins.load_params(twin, wrong)
