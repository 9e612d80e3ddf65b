"""Local attention against a loop over frames, and how far it reaches."""

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.nn.attention import LocalAttention, Transformer

X = jnp.asarray(np.random.default_rng(0).normal(size=(2, 20, 6)), jnp.float32)


def test_equals_a_loop():
    layer = LocalAttention(4, 3)
    params = layer.init(jax.random.key(0), X)
    bias = jnp.asarray(np.random.default_rng(1).normal(size=7), jnp.float32)
    params = {"params": {**params["params"], "distance_bias": bias}}
    out = np.asarray(layer.apply(params, X))
    q, k, v = (np.asarray(X) @ np.asarray(params["params"][f"Dense_{i}"]["kernel"]) for i in range(3))
    for clip in range(2):
        for frame in range(20):
            near = range(max(0, frame - 3), min(20, frame + 4))
            scores = np.array([q[clip, frame] @ k[clip, o] / 2 + bias[o - frame + 3] for o in near])
            weights = np.exp(scores - scores.max()) / np.exp(scores - scores.max()).sum()
            np.testing.assert_allclose(out[clip, frame], weights @ v[clip, list(near)], atol=1e-5)


def test_one_frame_reaches_half_a_window_a_layer():
    network = Transformer(layers=2, channels=4, hidden=8, window=6)
    params = network.init(jax.random.key(0), X)
    changed = X.at[:, 10].add(1.0)
    difference = np.abs(np.asarray(network.apply(params, X) - network.apply(params, changed))).max(axis=(0, 2))
    assert np.nonzero(difference > 0)[0].tolist() == list(range(4, 17))


def test_does_not_depend_on_where_the_window_begins():
    network = Transformer(layers=1, channels=4, hidden=8, window=4)
    params = network.init(jax.random.key(0), X)
    np.testing.assert_allclose(network.apply(params, X[:, 3:])[:, 2:], network.apply(params, X)[:, 5:], atol=1e-5)
