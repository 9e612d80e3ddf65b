"""GRU and LSTM against plain loops over frames, and their hand-written backward passes against autodiff."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.nn.recurrent import GRU, LSTM, gru_scan, gru_step, lstm_scan, lstm_step

B, T, C, H = 2, 7, 3, 4


def sigmoid(x):
    return 1 / (1 + np.exp(-x))


def layer_and_input(layer):
    x = jnp.asarray(np.random.default_rng(0).normal(size=(B, T, C)), jnp.float32)
    return layer.init(jax.random.key(0), x), x


def by_hand(params, x, gates):
    """One frame after another, gate by gate."""
    p = {name: np.asarray(value, np.float64) for name, value in params["params"].items()}
    h, c, out = np.zeros((B, H)), np.zeros((B, H)), []
    for t in range(x.shape[1]):
        gx = np.split(np.asarray(x[:, t]) @ p["input_kernel"] + p["input_bias"], gates, axis=1)
        gh = np.split(h @ p["state_kernel"] + p["state_bias"], gates, axis=1)
        if gates == 3:
            r, z = sigmoid(gx[0] + gh[0]), sigmoid(gx[1] + gh[1])
            h = (1 - z) * np.tanh(gx[2] + r * gh[2]) + z * h
        else:
            i, f, g, o = (a + b for a, b in zip(gx, gh, strict=True))
            c = sigmoid(f) * c + sigmoid(i) * np.tanh(g)
            h = sigmoid(o) * np.tanh(c)
        out.append(h)
    return np.stack(out, axis=1)


@pytest.mark.parametrize(("layer", "gates"), [(GRU(H), 3), (LSTM(H), 4)], ids=["gru", "lstm"])
def test_equals_a_loop(layer, gates):
    params, x = layer_and_input(layer)
    np.testing.assert_allclose(layer.apply(params, x)[0], by_hand(params, x, gates), atol=1e-6)


@pytest.mark.parametrize(("layer", "back"), [(GRU(H), GRU(H, reverse=True)), (LSTM(H), LSTM(H, reverse=True))])
def test_reverse_reads_backwards(layer, back):
    params, x = layer_and_input(layer)
    forward, _ = layer.apply(params, x[:, ::-1])
    np.testing.assert_allclose(back.apply(params, x)[0], forward[:, ::-1], atol=1e-6)


@pytest.mark.parametrize("layer", [GRU(H), LSTM(H)], ids=["gru", "lstm"])
def test_continues_from_a_state(layer):
    params, x = layer_and_input(layer)
    whole, last = layer.apply(params, x)
    first, state = layer.apply(params, x[:, :3])
    second, end = layer.apply(params, x[:, 3:], state)
    np.testing.assert_allclose(jnp.concatenate([first, second], axis=1), whole, atol=1e-6)
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-6), end, last)


def _arguments(gates, dtype=np.float32):
    random = np.random.default_rng(1)
    draw = lambda *shape: jnp.asarray(random.normal(size=shape), dtype)  # noqa: E731
    state = draw(B, H) if gates == 3 else (draw(B, H), draw(B, H))
    return draw(T, B, gates * H), state, draw(H, gates * H), draw(gates * H)


def _slow(step, gates):
    """The same by autodiff alone."""

    def scan(projected, state, weights, bias):
        def one(carry, x):
            new = step(x, carry, weights, bias)
            return new, new

        return jax.lax.scan(one, state, projected)[1]

    return scan


@pytest.mark.parametrize(
    ("fast", "step", "gates"), [(gru_scan, gru_step, 3), (lstm_scan, lstm_step, 4)], ids=["gru", "lstm"]
)
def test_backward_pass_equals_autodiff(fast, step, gates):
    arguments = _arguments(gates)
    weigh = jax.random.normal(jax.random.key(5), (T, B, H))

    def value(scan):
        def scalar(*given):
            out = jax.tree.leaves(scan(*given))
            return sum(jnp.sum(jnp.sin(one) * weigh * (n + 1)) for n, one in enumerate(out))

        return scalar

    ours = jax.grad(value(fast), argnums=(0, 1, 2, 3))(*arguments)
    theirs = jax.grad(value(_slow(step, gates)), argnums=(0, 1, 2, 3))(*arguments)
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_allclose(a, b, atol=2e-5)
