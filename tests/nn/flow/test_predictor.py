"""The linear first layer of a flow: inverse, log-determinant against autodiff, what it is fitted to."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.test_util import check_grads

from a2g_jax.nn.flow.predictor import (
    as_steps,
    expected,
    fit_predictor,
    init_predictor,
    inverse_whitening,
    predictor,
    predictor_inverse,
    predictor_log_det,
)

HISTORY, CHANNELS = 4, 3


def smooth(clips=6, frames=80, seed=0, noise=0.01):
    """Frames and the poses before them, of waves of many speeds whose channels hang together."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames + HISTORY)[None, :, None]
    waves = np.sin(time * rng.uniform(0.05, 0.3, (clips, 1, CHANNELS)) + rng.uniform(0, 6, (clips, 1, CHANNELS)))
    waves = waves @ rng.normal(size=(CHANNELS, CHANNELS)) + noise * rng.normal(size=(*waves.shape[:2], CHANNELS))
    poses = np.stack([waves[:, lag : lag + frames] for lag in range(HISTORY)], axis=2)
    return jnp.asarray(waves[:, HISTORY:], jnp.float32), jnp.asarray(poses, jnp.float32)


def moved(seed=1):
    """Parameters away from where they start."""
    params = init_predictor(HISTORY, CHANNELS)
    keys = jax.random.split(jax.random.key(seed), len(params))
    return {
        name: value + 0.4 * jax.random.normal(key, value.shape)
        for (name, value), key in zip(params.items(), keys, strict=True)
    }


def test_the_inverse_gives_the_poses_back():
    x, poses = smooth()
    for params in (moved(), fit_predictor(x, poses)):
        y = predictor(params, x, poses)
        np.testing.assert_allclose(predictor_inverse(params, y, poses, inverse_whitening(params)), x, atol=1e-5)


def test_its_log_determinant_is_that_of_the_jacobian():
    x, poses = smooth()
    params = moved()
    jacobian = jax.jacobian(lambda frame: predictor(params, frame[None], poses[0, :1])[0])(x[0, 0])
    np.testing.assert_allclose(predictor_log_det(params), jnp.linalg.slogdet(jacobian)[1], rtol=1e-5)


def test_fitted_its_errors_are_white_and_smaller_than_steps():
    x, poses = smooth()
    params = fit_predictor(x, poses)
    errors = np.asarray(predictor(params, x, poses)).reshape(-1, CHANNELS)
    np.testing.assert_allclose(np.cov(errors.T, bias=True), np.eye(CHANNELS), atol=0.05)
    step = np.asarray(x - poses[:, :, -1])
    left = np.asarray(x - expected(params, poses))
    assert left.std() < 0.3 * step.std()
    steps = np.asarray(as_steps(params, poses))
    np.testing.assert_allclose(np.sqrt(np.mean(steps[:, :, :-1] ** 2, axis=(0, 1, 2))), 1.0, atol=0.05)
    np.testing.assert_array_equal(steps[:, :, -1], poses[:, :, -1])


def test_motion_of_constant_speed_is_continued_exactly():
    frames = jnp.arange(40.0)[None, :, None] * jnp.array([0.3, -0.1, 0.02])[None, None]
    poses = jnp.stack([frames[:, lag : lag + 36] for lag in range(HISTORY)], axis=2)
    params = fit_predictor(frames[:, HISTORY:], poses)
    unpulled = {**params, "pull": jnp.zeros(CHANNELS)}
    np.testing.assert_allclose(expected(unpulled, poses), frames[:, HISTORY:], atol=2e-3)
    assert np.all(np.asarray(params["pull"]) <= -1 / 500)


def test_the_pull_is_that_of_a_process_that_returns():
    rng, frames = np.random.default_rng(3), 4000
    walk = np.zeros((1, frames, 1))
    for frame in range(1, frames):
        walk[:, frame] = 0.95 * walk[:, frame - 1] + rng.normal(size=(1, 1))
    poses = np.stack([walk[:, lag : frames - HISTORY + lag] for lag in range(HISTORY)], axis=2)
    params = fit_predictor(jnp.asarray(walk[:, HISTORY:], jnp.float32), jnp.asarray(poses, jnp.float32))
    np.testing.assert_allclose(params["pull"], -0.05, atol=0.02)


def test_a_channel_that_never_moves_is_no_trouble():
    x, poses = smooth(noise=0.0)
    x, poses = x.at[..., 1].set(0.5), poses.at[..., 1].set(0.5)
    params = fit_predictor(x, poses)
    assert all(np.isfinite(value).all() for value in params.values())


def test_gradients_are_those_of_differences(x64):
    x, poses = (array.astype(jnp.float64)[:1, :3] for array in smooth())
    params = jax.tree.map(lambda array: array.astype(jnp.float64), moved())
    del params["spread"]

    def loss(trained):
        whole = {**jax.tree.map(jnp.asarray, trained), "spread": jnp.ones(CHANNELS)}
        return jnp.sum(jnp.square(predictor(whole, x, poses))) + predictor_log_det(whole)

    check_grads(loss, (params,), order=1, modes=["rev"])
