"""Recurrent layers with PyTorch's gates, and a backward pass whose cost per frame does not grow with the length.

The input's contribution to every gate is one matrix product for all frames, before the scan. Autodiff would add a
gradient as large as the weights at every frame; here the backward scan keeps only the gradients of the gates, and one
product after it gives the gradient of the weights. The price is forward-mode differentiation.
"""

from functools import partial

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.nn.linear import linear

State = Float[Array, "B H"]


def gru_step(
    projected: Float[Array, "B gates"], state: State, weights: Float[Array, "H gates"], bias: Float[Array, " gates"]
) -> State:
    """One frame of a GRU.

    ``r = s(x_r + h_r)``, ``z = s(x_z + h_z)``, ``n = tanh(x_n + r h_n)``, ``h' = (1 - z) n + z h``, where ``x`` is the
    input's contribution to the gates (bias included) and ``h_* = h W + b``; the order of gates is r, z, n.
    """
    return _gru_gates(projected, state, weights, bias)[0]


def lstm_step(
    projected: Float[Array, "B gates"],
    state: tuple[State, State],
    weights: Float[Array, "H gates"],
    bias: Float[Array, " gates"],
) -> tuple[State, State]:
    """One frame of an LSTM: gates i, f, g, o; ``c' = s(f) c + s(i) tanh(g)``, ``h' = s(o) tanh(c')``."""
    return _lstm_gates(projected, state, weights, bias)[0]


def _gru_gates(projected, state, weights, bias):
    hidden = state @ weights + bias[None]
    x_r, x_z, x_n = jnp.split(projected, 3, axis=-1)
    h_r, h_z, h_n = jnp.split(hidden, 3, axis=-1)
    r, z = jax.nn.sigmoid(x_r + h_r), jax.nn.sigmoid(x_z + h_z)
    n = jnp.tanh(x_n + r * h_n)
    return (1.0 - z) * n + z * state, (r, z, n, h_n)


def _lstm_gates(projected, state, weights, bias):
    h, c = state
    i, f, g, o = jnp.split(projected + h @ weights + bias[None], 4, axis=-1)
    i, f, g, o = jax.nn.sigmoid(i), jax.nn.sigmoid(f), jnp.tanh(g), jax.nn.sigmoid(o)
    new = f * c + i * g
    return (o * jnp.tanh(new), new), (i, f, g, o)


@jax.custom_vjp
def gru_scan(
    projected: Float[Array, "T B gates"],
    state: State,
    weights: Float[Array, "H gates"],
    bias: Float[Array, " gates"],
) -> Float[Array, "T B H"]:
    """States after each frame of a GRU, time first: :func:`gru_step` over frames."""
    return _gru_forward(projected, state, weights, bias)[0]


def _gru_forward(projected, state, weights, bias):
    def step(h, x):
        new, gates = _gru_gates(x, h, weights, bias)
        return new, (new, gates)

    _, (states, gates) = jax.lax.scan(step, state, projected)
    return states, (state, states, gates, weights)


def _gru_backward(saved, upstream):
    state, states, gates, weights = saved
    before = jnp.concatenate([state[None], states[:-1]])

    def step(carry, frame):
        dy, h, (r, z, n, h_n) = frame
        dh = carry + dy
        dn = dh * (1.0 - z) * (1.0 - n * n)
        dz = dh * (h - n) * z * (1.0 - z)
        dr = dn * h_n * r * (1.0 - r)
        dhidden = jnp.concatenate([dr, dz, dn * r], axis=-1)
        return dh * z + dhidden @ weights.T, (jnp.concatenate([dr, dz, dn], axis=-1), dhidden)

    dstate, (dprojected, dhidden) = jax.lax.scan(step, jnp.zeros_like(state), (upstream, before, gates), reverse=True)
    return dprojected, dstate, _product(before, dhidden), jnp.sum(dhidden, axis=(0, 1))


gru_scan.defvjp(_gru_forward, _gru_backward)


@jax.custom_vjp
def lstm_scan(
    projected: Float[Array, "T B gates"],
    state: tuple[State, State],
    weights: Float[Array, "H gates"],
    bias: Float[Array, " gates"],
) -> tuple[Float[Array, "T B H"], Float[Array, "T B H"]]:
    """States h and c after each frame of an LSTM, time first: :func:`lstm_step` over frames."""
    return _lstm_forward(projected, state, weights, bias)[0]


def _lstm_forward(projected, state, weights, bias):
    def step(carry, x):
        new, gates = _lstm_gates(x, carry, weights, bias)
        return new, (new, gates)

    _, (states, gates) = jax.lax.scan(step, state, projected)
    return states, (state, states, gates, weights)


def _lstm_backward(saved, upstream):
    (h0, c0), (hs, cs), gates, weights = saved
    before_h, before_c = jnp.concatenate([h0[None], hs[:-1]]), jnp.concatenate([c0[None], cs[:-1]])

    def step(carry, frame):
        (dh, dc), (dy, dcell, c, new, (i, f, g, o)) = carry, frame
        dh, tanh = dh + dy, jnp.tanh(new)
        dc = dc + dcell + dh * o * (1.0 - tanh * tanh)
        parts = [dc * g * i * (1.0 - i), dc * c * f * (1.0 - f), dc * i * (1.0 - g * g), dh * tanh * o * (1.0 - o)]
        dgates = jnp.concatenate(parts, axis=-1)
        return (dgates @ weights.T, dc * f), dgates

    start = (jnp.zeros_like(h0), jnp.zeros_like(c0))
    dstate, dgates = jax.lax.scan(step, start, (*upstream, before_c, cs, gates), reverse=True)
    return dgates, dstate, _product(before_h, dgates), jnp.sum(dgates, axis=(0, 1))


lstm_scan.defvjp(_lstm_forward, _lstm_backward)


def _product(states, gradients):
    """Gradient of the recurrent weights, of all frames at once."""
    return states.reshape(-1, states.shape[-1]).T @ gradients.reshape(-1, gradients.shape[-1])


class _Recurrent(nn.Module):
    features: int
    reverse: bool = False

    def _weights(self, gates: int, inputs: int):
        initial = partial(_uniform, scale=self.features**-0.5)
        width = gates * self.features
        return (
            self.param("input_kernel", initial, (inputs, width)),
            self.param("input_bias", initial, (width,)),
            self.param("state_kernel", initial, (self.features, width)),
            self.param("state_bias", initial, (width,)),
        )

    def _project(self, x, kernel, bias):
        """Time first, in the order of reading."""
        frames = jnp.swapaxes(linear(x, kernel) + bias[None, None], 0, 1)
        return frames[::-1] if self.reverse else frames

    def _ordered(self, states):
        return jnp.swapaxes(states[::-1] if self.reverse else states, 0, 1)


def _uniform(key, shape, scale):
    return jax.random.uniform(key, shape, minval=-scale, maxval=scale)


class GRU(_Recurrent):
    """One GRU layer; weights initialised uniform within the root of one over its width, as PyTorch's.

    Args:
        reverse: read from the last frame to the first.
    """

    @nn.compact
    def __call__(
        self, x: Float[Array, "B T C"], state: Float[Array, "B H"] | None = None
    ) -> tuple[Float[Array, "B T H"], Float[Array, "B H"]]:
        """Outputs, and the state after the last frame in the order of reading."""
        input_kernel, input_bias, kernel, bias = self._weights(3, x.shape[-1])
        if state is None:
            state = jnp.zeros((x.shape[0], self.features), x.dtype)
        states = gru_scan(self._project(x, input_kernel, input_bias), state, kernel, bias)
        return self._ordered(states), states[-1]


class LSTM(_Recurrent):
    """One LSTM layer, initialised as :class:`GRU`; its state is (h, c)."""

    @nn.compact
    def __call__(
        self, x: Float[Array, "B T C"], state: tuple[Float[Array, "B H"], Float[Array, "B H"]] | None = None
    ) -> tuple[Float[Array, "B T H"], tuple[Float[Array, "B H"], Float[Array, "B H"]]]:
        """Outputs, and the state after the last frame in the order of reading."""
        input_kernel, input_bias, kernel, bias = self._weights(4, x.shape[-1])
        if state is None:
            zeros = jnp.zeros((x.shape[0], self.features), x.dtype)
            state = (zeros, zeros)
        states, cells = lstm_scan(self._project(x, input_kernel, input_bias), state, kernel, bias)
        return self._ordered(states), (states[-1], cells[-1])
