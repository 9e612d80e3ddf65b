"""Per-frame log-likelihoods of the flow: against the whole clip's Jacobian, and its inverse after training."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from a2g_jax.data.batch import Batch
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.base import Data
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.model import build
from a2g_jax.models.stylized_flow.networks import FlowNetworks
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.nn.flow.invertible import FIXED
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import advance, init_state, joint_loss

SMALL = StylizedFlowConfig(
    flow_steps=3,
    hidden=6,
    layers=1,
    history_frames=2,
    lookahead_frames=1,
    clip_frames=8,
    global_channels=3,
    encoder_channels=4,
    encoder_blocks=1,
    embedding_channels=3,
    frame_dropout=0.0,
    reverse_share=0.0,
)
MOGLOW = replace(SMALL, cell="lstm", layers=2, freedom=0.0, global_channels=0)
SHAPE = (2, 2)
DATA = Data(
    PoseSpace(PoseLayout(("a", "b", "c"), ((0, 1), (1, 2))), "keypoints"),
    15.0,
    3,
    Statistics(np.full(SHAPE, 0.5, np.float32), np.full(SHAPE, 2.0, np.float32)),
)


def batch_of(clips=1, frames=8, seed=0):
    rng = np.random.default_rng(seed)
    audio = rng.normal(size=(clips, frames, 3))
    return Batch(jnp.asarray(audio), jnp.asarray(np.cumsum(rng.normal(size=(clips, frames, *SHAPE)), axis=1)))


def far_from_its_start(model):
    """Parameters as training leaves them: no layer zero, no actnorm the identity."""
    leaves, tree = jax.tree_util.tree_flatten_with_path(jax.jit(model.init)(jax.random.key(0)))
    keys = jax.random.split(jax.random.key(1), len(leaves))
    moved = [
        leaf.astype(jnp.float64)
        if any(getattr(part, "key", None) in FIXED for part in path)
        else leaf + 0.3 * jax.random.normal(key, leaf.shape, jnp.float64)
        for key, (path, leaf) in zip(keys, leaves, strict=True)
    ]
    return jax.tree_util.tree_unflatten(tree, moved)


@pytest.mark.parametrize("config", [SMALL, MOGLOW], ids=["stylized flow", "moglow"])
def test_log_likelihoods_add_up_to_that_of_the_clip_by_the_jacobian(x64, config):
    model, networks, batch = build(config, DATA), FlowNetworks(config, DATA), batch_of()
    params = far_from_its_start(model)
    flat = networks.flat(batch.pose)
    first, stop = config.history_frames, 8 - config.lookahead_frames

    def latents(inner):
        """Latents of the whole clip: a pose also conditions the frames after it."""
        clip = flat.at[:, first:stop].set(inner.reshape(1, stop - first, 4))
        return networks.latents(params, networks.inner(clip), networks.conditioning(params, batch.audio, clip))[
            0
        ].ravel()

    inner = flat[:, first:stop].ravel()
    both = jax.jit(lambda inner: (latents(inner), jax.jacrev(latents)(inner)))
    z, jacobian = (np.asarray(array) for array in both(inner))
    z = z.reshape(-1, 4)
    prior = (
        stats.multivariate_t(np.zeros(4), np.eye(4), df=50)
        if config.freedom
        else stats.multivariate_normal(np.zeros(4))
    )
    expected = prior.logpdf(z).sum() + np.linalg.slogdet(jacobian)[1]
    density = jax.jit(model.density.log_likelihood)(params, batch.audio, batch.pose)
    assert density.shape == (1, 5)
    np.testing.assert_allclose(density.sum(), expected, rtol=1e-9)
    # The density of an early frame is a block of the Jacobian: no later frame affects it.
    blocks = jacobian.reshape(5, 4, 5, 4)
    assert max(np.abs(blocks[t, :, t + 1 :]).max(initial=0.0) for t in range(5)) == 0.0
    parts = prior.logpdf(z) + [np.linalg.slogdet(blocks[t, :, t])[1] for t in range(5)]
    np.testing.assert_allclose(density[0], parts, rtol=1e-9)


def test_without_noise_it_is_the_training_loss():
    config = replace(SMALL, input_noise=0.0, global_channels=0)
    model, batch = build(config, DATA), jax.tree.map(lambda a: a.astype(jnp.float32), batch_of(3))
    params = jax.jit(model.init)(jax.random.key(0))
    bits, _ = jax.jit(joint_loss(model.stages[0]))(params, jax.random.key(1), batch, jnp.int32(0))
    density = jax.jit(model.density.log_likelihood)(params, batch.audio, batch.pose)
    np.testing.assert_allclose(-density.mean() / np.log(2), bits, rtol=1e-5)


def test_sixteen_steps_invert_after_training():
    config = replace(SMALL, flow_steps=16, hidden=8, frame_dropout=0.4, clip_frames=24, global_channels=0)
    model, networks = build(config, DATA), FlowNetworks(config, DATA)
    settings = TrainConfig(steps=80, learning_rate=5e-3, clip_value=5.0, clip_norm=100.0)
    state = init_state(model, stage_spans(model, settings), settings.seed)
    step = jax.jit(lambda state, batch, key: advance(stage_spans(model, settings)[0], state, batch, key))
    as_single = lambda batch: jax.tree.map(lambda a: a.astype(jnp.float32), batch)  # noqa: E731
    history = []
    for number in range(80):
        state, metrics = step(state, as_single(batch_of(8, 24, number % 4)), jax.random.key(number))
        history.append(float(metrics["bits_per_dim"]))
    assert np.mean(history[-5:]) < np.mean(history[:5]) - 0.5, "it has not learned anything"

    def back_and_forth(params, audio, pose):
        flat = networks.flat(pose)
        given = networks.conditioning(params, audio, flat)
        z, _ = networks.latents(params, networks.inner(flat), given)
        return networks.inner(flat), networks.motion(params, z, given)

    single = as_single(batch_of(4, 24, 9))
    x, back = jax.jit(back_and_forth)(state.params, single.audio, single.pose)
    assert back.dtype == jnp.float32
    np.testing.assert_allclose(back, x, atol=1e-4)
    with jax.enable_x64(True):
        double = batch_of(4, 24, 9)
        params = jax.tree.map(lambda a: jnp.asarray(np.asarray(a, np.float64)), state.params)
        x, back = jax.jit(back_and_forth)(params, double.audio, double.pose)
        assert back.dtype == jnp.float64
        np.testing.assert_allclose(back, x, atol=1e-10)
