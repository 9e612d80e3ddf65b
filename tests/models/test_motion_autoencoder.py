"""The feature network: reach, reconstruction, poses of every kind."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.data.batch import Batch
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.base import Data
from a2g_jax.models.motion_autoencoder.config import PRESETS, MotionAutoencoderConfig
from a2g_jax.models.motion_autoencoder.model import build, encode
from a2g_jax.training.state import joint_loss

SMALL = MotionAutoencoderConfig(encoder_channels=(8, 8, 8, 16, 4), decoder_channels=(4, 8), clip_frames=16)
CHAIN = Skeleton(np.array([[0, 0, 0], [0, 0.3, 0], [0.2, 0, 0]], np.float32), ("a", "b", "c"), (-1, 0, 1))
LAYOUT = PoseLayout(("a", "b", "c"), ((0, 1), (1, 2)))


def data_of(representation):
    """Unit statistics of a small body."""
    shape = {"6d": (3, 6), "exponential": (3, 3), "directions": (2, 3), "keypoints": (3, 2)}[representation]
    body = CHAIN if representation in ("6d", "exponential") else LAYOUT
    return Data(
        PoseSpace(body, representation), 30.0, 4, Statistics(np.zeros(shape, np.float32), np.ones(shape, np.float32))
    )


def batch_of(representation, frames=16, clips=2, seed=0):
    """Random poses; rotations are valid ones."""
    random = np.random.default_rng(seed)
    shape = data_of(representation).pose_statistics.mean.shape
    pose = random.normal(size=(clips, frames, *shape)).astype(np.float32)
    if representation == "6d":
        turns = Rotation.random(clips * frames * 3, rng=random).as_matrix()
        pose = np.swapaxes(turns[:, :, :2], 1, 2).reshape(clips, frames, 3, 6).astype(np.float32)
    return Batch(jnp.zeros((clips, frames, 4)), jnp.asarray(pose))


def test_the_fourth_block_has_the_papers_128_values():
    for config in PRESETS.values():
        assert (config.encoder_channels[3], len(config.encoder_channels)) == (128, 5)


def test_it_spans_125_frames():
    data = data_of("6d")
    model = build(SMALL, data)
    params = jax.jit(model.init)(jax.random.key(0))
    assert 2 * model.halo + 1 == 125
    pose = batch_of("6d", frames=160, clips=1).pose
    code = lambda p: encode(SMALL, data, params, p)[-1][0, 80].sum()  # noqa: E731
    touched = np.nonzero(np.abs(np.asarray(jax.jit(jax.grad(code))(pose)[0])).sum(axis=(1, 2)))[0]
    assert touched.min() >= 80 - 62
    assert touched.max() <= 80 + 62
    assert len(touched) > 60


@pytest.mark.parametrize("representation", ["6d", "exponential", "directions", "keypoints"])
def test_it_learns_to_reconstruct(representation):
    import optax

    data, batch = data_of(representation), batch_of(representation)
    batch = batch._replace(pose=jnp.broadcast_to(batch.pose[:, :1], batch.pose.shape))  # still poses
    model = build(SMALL, data)
    params = jax.jit(model.init)(jax.random.key(1))
    optimiser = optax.adam(3e-3)

    @jax.jit
    def step(params, state):
        (loss, _), gradient = jax.value_and_grad(joint_loss(model.stages[0]), has_aux=True)(
            params, jax.random.key(0), batch, jnp.int32(0)
        )
        updates, state = optimiser.update(gradient, state)
        return optax.apply_updates(params, updates), state, loss

    state, history = jax.jit(optimiser.init)(params), []
    for _ in range(150):
        params, state, loss = step(params, state)
        history.append(float(loss))
    assert history[-1] < 0.6 * history[0]
    assert jax.eval_shape(model.reconstruct, params, batch).shape == batch.pose.shape


def test_noise_is_only_on_the_input():
    data, batch = data_of("directions"), batch_of("directions")
    noisy = build(MotionAutoencoderConfig(**{**vars(SMALL), "noise": 0.5}), data)
    params = jax.jit(noisy.init)(jax.random.key(0))
    loss = jax.jit(joint_loss(noisy.stages[0]))
    losses = [float(loss(params, jax.random.key(seed), batch, jnp.int32(0))[0]) for seed in (0, 0, 1)]
    assert losses[0] == losses[1] != losses[2]
    with_noise, without = (jax.jit(model.reconstruct)(params, batch) for model in (noisy, build(SMALL, data)))
    np.testing.assert_array_equal(with_noise, without)
