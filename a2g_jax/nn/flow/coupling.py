"""Affine coupling whose scale and shift come from a recurrent network over time (MoGlow, Sec. 3.3).

The first half of a frame's channels is kept. Together with the pose history and the condition of the frame (audio,
style) it is the input of recurrent layers and a linear layer, initialised to zero, that give a scale and a shift of the
second half.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from a2g_jax.nn.flow.broadcast import of_channels
from a2g_jax.nn.linear import linear
from a2g_jax.nn.recurrent import gru_scan, gru_step, lstm_scan, lstm_step

Params = dict[str, Any]
#: Hidden state of each layer: (B, H) of a GRU, a pair of these of an LSTM.
States = tuple[Any, ...]

#: Smallest scale of the second half.
_EPSILON = 1e-6
#: Added to the raw scale before the sigmoid.
_OFFSET = 2.0
_GATES = {"gru": 3, "lstm": 4}


class Shape(NamedTuple):
    """Sizes of a coupling."""

    channels: int
    """Channels of a frame."""
    history: int
    """Width of the pose history of a frame."""
    condition: int
    """Width of the condition of a frame: audio, style."""
    hidden: int
    layers: int = 2
    cell: str = "gru"
    """``gru`` or ``lstm``."""
    exact: bool = False
    """Whether the layer is initialised to the identity; otherwise it scales by s(2) = 0.88, as the authors' does."""

    @property
    def kept(self) -> int:
        """Channels that stay as they are."""
        return self.channels // 2


def init_coupling(key: Key[Array, ""], shape: Shape) -> Params:
    """Initial parameters: recurrent weights uniform within the root of one over their width, as PyTorch's; the last
    layer zero."""
    gates, bound = _GATES[shape.cell] * shape.hidden, shape.hidden**-0.5

    def uniform(number: int, *size: int) -> Array:
        return jax.random.uniform(jax.random.fold_in(key, number), size, minval=-bound, maxval=bound)

    layers = []
    for layer in range(shape.layers):
        recurrent = {
            "input_bias": uniform(8 * layer, gates),
            "state_kernel": uniform(8 * layer + 1, shape.hidden, gates),
            "state_bias": uniform(8 * layer + 2, gates),
        }
        if layer == 0:
            recurrent["kept_kernel"] = uniform(3, shape.kept, gates)
            recurrent["history_kernel"] = uniform(4, shape.history, gates)
            recurrent["known_kernel"] = uniform(5, shape.condition, gates)
        else:
            recurrent["input_kernel"] = uniform(8 * layer + 3, shape.hidden, gates)
        layers.append(recurrent)
    changed = 2 * (shape.channels - shape.kept)
    return {
        **{f"layer_{number}": layer for number, layer in enumerate(layers)},
        "out_kernel": jnp.zeros((shape.hidden, changed)),
        "out_bias": jnp.zeros((changed,)),
    }


def project_condition(params: Params, condition: Float[Array, "*S D"]) -> Float[Array, "*S gates"]:
    """Contribution of the condition and the bias to the gates of the first layer: one product for all frames."""
    first = params["layer_0"]
    projected: Float[Array, "*S gates"] = linear(condition, first["known_kernel"])
    return projected + of_channels(first["input_bias"], projected)


def start_states(shape: Shape, count: int, dtype: Any = jnp.float32) -> States:
    """Zero states, as at the start of every training clip."""
    zeros = jnp.zeros((count, shape.hidden), dtype)
    return tuple((zeros, zeros) if shape.cell == "lstm" else zeros for _ in range(shape.layers))


def _over_time(params, shape, kept, history, condition):
    """Output of the recurrent layers for whole clips."""
    first = params["layer_0"]
    projected = project_condition(params, condition) + linear(history, first["history_kernel"])
    projected = projected + linear(kept, first["kept_kernel"])
    x = jnp.swapaxes(projected, 0, 1)
    for layer, state in enumerate(start_states(shape, kept.shape[0], kept.dtype)):
        weights = params[f"layer_{layer}"]
        if layer > 0:
            x = linear(x, weights["input_kernel"]) + of_channels(weights["input_bias"], x)
        if shape.cell == "lstm":
            x = lstm_scan(x, state, weights["state_kernel"], weights["state_bias"])[0]
        else:
            x = gru_scan(x, state, weights["state_kernel"], weights["state_bias"])
    return jnp.swapaxes(x, 0, 1)


def _one_frame(params, shape, kept, history, projected, states):
    """Output of the recurrent layers for one frame, and their states after it."""
    first = params["layer_0"]
    x, after = projected + history @ first["history_kernel"] + kept @ first["kept_kernel"], []
    for layer, state in enumerate(states):
        weights = params[f"layer_{layer}"]
        if layer > 0:
            x = x @ weights["input_kernel"] + of_channels(weights["input_bias"], x)
        step = lstm_step if shape.cell == "lstm" else gru_step
        state = step(x, state, weights["state_kernel"], weights["state_bias"])
        x = state[0] if shape.cell == "lstm" else state
        after.append(state)
    return x, tuple(after)


def _scale_and_shift(params, shape, output, guidance=1.0):
    raw = linear(output, params["out_kernel"])
    raw = raw + of_channels(params["out_bias"], raw)
    if guidance != 1.0:
        # The first half of the sequences have the whole condition, the second half lack what is guided.
        given, lacking = jnp.split(raw, 2)
        raw = jnp.tile(lacking + guidance * (given - lacking), (2, 1))
    shift, raw_scale = jnp.split(raw, 2, axis=-1)
    scale = jax.nn.sigmoid(raw_scale + _OFFSET) + _EPSILON
    if shape.exact:
        scale = scale / (jax.nn.sigmoid(_OFFSET) + _EPSILON)
    return scale, shift


def coupling(
    params: Params,
    shape: Shape,
    x: Float[Array, "B T C"],
    history: Float[Array, "B T H"],
    condition: Float[Array, "B T D"],
) -> tuple[Float[Array, "B T C"], Float[Array, "B T"]]:
    """``(z2 + shift) scale`` of the second half over whole clips, and the log-determinant of every frame."""
    kept, changed = jnp.split(x, [shape.kept], axis=-1)
    scale, shift = _scale_and_shift(params, shape, _over_time(params, shape, kept, history, condition))
    return jnp.concatenate([kept, (changed + shift) * scale], axis=-1), jnp.sum(jnp.log(scale), axis=-1)


def coupling_inverse(
    params: Params,
    shape: Shape,
    y: Float[Array, "B T C"],
    history: Float[Array, "B T H"],
    condition: Float[Array, "B T D"],
) -> Float[Array, "B T C"]:
    """Inverse of :func:`coupling`, for all frames at once, since the history is given."""
    kept, changed = jnp.split(y, [shape.kept], axis=-1)
    scale, shift = _scale_and_shift(params, shape, _over_time(params, shape, kept, history, condition))
    return jnp.concatenate([kept, changed / scale - shift], axis=-1)


def coupling_inverse_step(
    params: Params,
    shape: Shape,
    y: Float[Array, "B C"],
    history: Float[Array, "B H"],
    projected: Float[Array, "B gates"],
    states: States,
    guidance: float = 1.0,
) -> tuple[Float[Array, "B C"], States]:
    """:func:`coupling_inverse` of one frame.

    Args:
        projected: from :func:`project_condition`.
        states: after the previous frame.
        guidance: if not 1, the sequences are two halves that differ in their condition, and shift and raw scale of
            both are the second half's plus ``guidance`` times the difference of the first half's (classifier-free
            guidance, Ho and Salimans 2022).
    """
    kept, changed = jnp.split(y, [shape.kept], axis=-1)
    output, after = _one_frame(params, shape, kept, history, projected, states)
    scale, shift = _scale_and_shift(params, shape, output, guidance)
    return jnp.concatenate([kept, changed / scale - shift], axis=-1), after


def coupling_step(
    params: Params,
    shape: Shape,
    x: Float[Array, "B C"],
    history: Float[Array, "B H"],
    projected: Float[Array, "B gates"],
    states: States,
    guidance: float = 1.0,
) -> tuple[Float[Array, "B C"], Float[Array, " B"]]:
    """:func:`coupling` of one frame, and its log-determinant; arguments of :func:`coupling_inverse_step`."""
    kept, changed = jnp.split(x, [shape.kept], axis=-1)
    output, _ = _one_frame(params, shape, kept, history, projected, states)
    scale, shift = _scale_and_shift(params, shape, output, guidance)
    return jnp.concatenate([kept, (changed + shift) * scale], axis=-1), jnp.sum(jnp.log(scale), axis=-1)
