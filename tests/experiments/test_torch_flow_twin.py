"""Our stylized flow and MoGlow, and their PyTorch twin: same weights, same latents, same numbers."""

import math
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.base import Data
from a2g_jax.models.stylized_flow.autoregression import proceed, start
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.networks import FlowNetworks
from a2g_jax.nn.flow.invertible import FIXED
from a2g_jax.nn.flow.priors import log_prob

torch = pytest.importorskip("torch")
twins = pytest.importorskip("experiments.benchmarks.torch_flow")
weights = pytest.importorskip("experiments.benchmarks.torch_flow_weights")

CLIPS, BANDS, ROWS = 2, 3, 5
SMALL = {"flow_steps": 3, "hidden": 8, "history_frames": 3, "lookahead_frames": 2, "clip_frames": 12}
CONFIGS = {
    # An odd number of poses, so that the encoder's halving rounds.
    "gru, global encoder": StylizedFlowConfig(
        **SMALL, global_channels=4, encoder_channels=6, encoder_blocks=2, embedding_channels=5
    ),
    "gru, normalised strides": StylizedFlowConfig(
        **SMALL, global_channels=4, encoder_channels=6, encoder_blocks=2, embedding_channels=5, strided_norm=True
    ),
    "lstm": StylizedFlowConfig(**SMALL, cell="lstm", freedom=0.0, global_channels=0, exact_identity=True),
}


class Setting:
    """FlowNetworks, weights moved off their start, clips, what is hidden of them, and latents; all from fixed seeds."""

    def __init__(self, config):
        self.config, rng = config, np.random.default_rng(3)
        statistics = Statistics(np.zeros((ROWS, 1), np.float32), np.ones((ROWS, 1), np.float32))
        layout = PoseLayout(tuple("abcde"), ())
        self.networks = FlowNetworks(config, Data(PoseSpace(layout, "directions"), 20.0, BANDS, statistics))
        self.params = jax.tree_util.tree_map_with_path(partial(_moved, rng), self.networks.init(jax.random.key(5)))
        normal = lambda *size: jnp.asarray(rng.normal(size=size), jnp.float32)  # noqa: E731
        inner = config.clip_frames - config.history_frames - config.lookahead_frames
        self.flat, self.audio = normal(CLIPS, config.clip_frames, ROWS), normal(CLIPS, config.clip_frames, BANDS)
        self.mask = jnp.asarray(rng.random((CLIPS, inner, config.history_frames)) < 0.6)
        self.z = normal(CLIPS, inner, ROWS)
        self.twin = twins.Twin(config, ROWS, BANDS)
        weights.load_params(self.twin, self.params)


def _moved(rng, path, leaf):
    fixed = any(getattr(part, "key", None) in FIXED for part in path)
    return leaf if fixed else leaf + jnp.asarray(rng.normal(0, 0.2, leaf.shape), leaf.dtype)


@pytest.fixture(scope="module", params=CONFIGS)
def setting(request):
    return Setting(CONFIGS[request.param])


def _torch(array):
    return torch.from_numpy(np.array(array))


def test_latents_log_determinants_and_inverse_agree(setting):
    networks, twin = setting.networks, setting.twin

    @jax.jit
    def ours(params, flat, audio):
        given = networks.conditioning(params, audio, flat, setting.mask)
        inner = networks.inner(flat)
        return inner, *networks.latents(params, inner, given), networks.motion(params, setting.z, given)

    inner, z, log_det, motion = ours(setting.params, setting.flat, setting.audio)
    with torch.no_grad():
        condition = twin.condition(_torch(setting.flat), _torch(setting.audio), _torch(setting.mask))
        their_z, their_log_det = twin.latents(_torch(inner), condition)
        their_motion = twin.motion(_torch(setting.z), condition)
    np.testing.assert_allclose(z, their_z, atol=1e-4)
    np.testing.assert_allclose(log_det, their_log_det, atol=1e-4)
    np.testing.assert_allclose(motion, their_motion, atol=1e-4)


@pytest.mark.parametrize("precompute", [False, True])
def test_sampling_frame_by_frame_agrees(setting, precompute):
    networks, audio = setting.networks, setting.audio[0]
    z = jnp.concatenate([setting.z, setting.z[:, :5]], axis=1)

    @jax.jit
    def ours(params, audio, z):
        given = networks.audio_context(params, audio[: z.shape[0]])
        return proceed(networks, params, z, given, start(networks, params, CLIPS), jnp.int32(0))[0]

    x = ours(setting.params, audio, jnp.swapaxes(z, 0, 1))
    theirs = setting.twin.sample(_torch(z), _torch(audio), precompute)
    np.testing.assert_allclose(x, theirs, atol=1e-4)


def test_losses_and_gradients_agree(setting):
    config, networks = setting.config, setting.networks

    def terms(params):
        given = networks.conditioning(params, setting.audio, setting.flat, setting.mask)
        inner = networks.inner(setting.flat)
        z, log_det = networks.latents(params, inner, given)
        bits = -jnp.mean(log_prob(z, config.freedom) + log_det) / math.log(2.0)
        return jnp.stack([bits, jnp.mean(jnp.abs(networks.motion(params, setting.z, given) - inner))])

    @jax.jit
    def ours_with_gradients(params):
        values, pull = jax.vjp(terms, params)
        return values, jax.lax.map(lambda row: pull(row)[0], jnp.eye(2))

    ours, ours_gradients = ours_with_gradients(setting.params)
    batch = (setting.flat, setting.audio, setting.mask, setting.z)
    theirs = setting.twin.terms(*(_torch(array) for array in batch))
    for number, name in enumerate(("bits", "reconstruction")):
        np.testing.assert_allclose(float(ours[number]), theirs[name].item(), rtol=1e-4, err_msg=name)
        setting.twin.zero_grad()
        theirs[name].backward(retain_graph=True)
        expected = weights.gradients(setting.twin)
        largest = max(np.abs(leaf).max() for leaf in jax.tree.leaves(expected))
        assert largest > 0, name

        def close(path, leaf, other, number=number, largest=largest):
            where = jax.tree_util.keystr(path)
            np.testing.assert_allclose(leaf[number], other, rtol=1e-3, atol=1e-3 * largest, err_msg=where)
            moves = not any(getattr(part, "key", None) in FIXED for part in path)
            assert np.any(other != 0) == moves, where

        jax.tree_util.tree_map_with_path(close, ours_gradients, expected)


def test_load_params_refuses_other_networks(setting):
    with pytest.raises(ValueError, match="Expected the parameters"):
        weights.load_params(setting.twin, {"flow": setting.params["glow"]})
    glow = {**setting.params["glow"], "actnorm": {"bias": np.zeros((3, 4)), "log_scale": np.zeros((3, 5))}}
    with pytest.raises(ValueError, match="of shape"):
        weights.load_params(setting.twin, {**setting.params, "glow": glow})
