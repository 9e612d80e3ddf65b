"""K steps of actnorm, invertible convolution and affine coupling, one after another (MoGlow, Sec. 3)."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from a2g_jax.nn.flow.actnorm import actnorm, actnorm_inverse, actnorm_log_det, fit_actnorm, init_actnorm
from a2g_jax.nn.flow.coupling import (
    Shape,
    States,
    coupling,
    coupling_inverse,
    coupling_inverse_step,
    coupling_step,
    init_coupling,
    project_condition,
    start_states,
)
from a2g_jax.nn.flow.invertible import (
    init_invertible,
    inverse_weight,
    invertible,
    invertible_inverse,
    invertible_log_det,
    weight,
)

#: ``{"actnorm": ..., "invertible": ..., "coupling": ...}``, every array with a leading axis of K steps.
Params = dict[str, Any]


def init_glow(key: Key[Array, ""], shape: Shape, steps: int) -> Params:
    """Initial parameters of K steps; :func:`fit_glow` sets the actnorms from data."""

    def one(step_key: Key[Array, ""]) -> Params:
        keys = jax.random.split(step_key)
        return {
            "actnorm": init_actnorm(shape.channels),
            "invertible": init_invertible(keys[0], shape.channels),
            "coupling": init_coupling(keys[1], shape),
        }

    return jax.vmap(one)(jax.random.split(key, steps))


def fit_glow(
    params: Params,
    shape: Shape,
    x: Float[Array, "B T C"],
    history: Float[Array, "B T H"],
    condition: Float[Array, "B T D"],
) -> Params:
    """Parameters whose actnorms give outputs of mean 0 and standard deviation 1 for this batch."""

    def step(x, one):
        fitted = fit_actnorm(x)
        x = invertible(one["invertible"], actnorm(fitted, x))
        return coupling(one["coupling"], shape, x, history, condition)[0], fitted

    _, fitted = jax.lax.scan(step, x, params)
    return {**params, "actnorm": fitted}


def glow(
    params: Params,
    shape: Shape,
    x: Float[Array, "B T C"],
    history: Float[Array, "B T H"],
    condition: Float[Array, "B T D"],
    recompute: bool = False,
) -> tuple[Float[Array, "B T C"], Float[Array, "B T"]]:
    """Latents of a motion, and the log-determinant of every frame.

    Args:
        x: the motion.
        history: the poses before each frame, as its conditioning.
        condition: the rest of its conditioning: audio, style.
        recompute: the gradient computes each step again from its input, in place of storing its states.
    """

    def step(carry, one):
        x, log_det = carry
        x = invertible(one["invertible"], actnorm(one["actnorm"], x))
        x, more = coupling(one["coupling"], shape, x, history, condition)
        return (x, log_det + more + actnorm_log_det(one["actnorm"]) + invertible_log_det(one["invertible"])), None

    # A scan separates both passes already, so that nothing has to prevent XLA from merging them.
    body = jax.checkpoint(step, prevent_cse=False) if recompute else step
    (z, log_det), _ = jax.lax.scan(body, (x, jnp.zeros(x.shape[:2], x.dtype)), params)
    return z, log_det


def glow_inverse(
    params: Params,
    shape: Shape,
    z: Float[Array, "B T C"],
    history: Float[Array, "B T H"],
    condition: Float[Array, "B T D"],
    recompute: bool = False,
) -> Float[Array, "B T C"]:
    """The motion of latents, for all frames at once, since the history is given (teacher forcing)."""

    def step(x, one):
        x = coupling_inverse(one["coupling"], shape, x, history, condition)
        return actnorm_inverse(one["actnorm"], invertible_inverse(one["invertible"], x)), None

    body = jax.checkpoint(step, prevent_cse=False) if recompute else step
    x, _ = jax.lax.scan(body, z, params, reverse=True)
    return x


class Prepared(NamedTuple):
    """A flow prepared for sampling frame by frame, with everything precomputed that no frame changes."""

    couplings: tuple[Any, ...]
    matrices: tuple[Array, ...]
    """Inverse of convolution and actnorm scale as one matrix, transposed."""
    biases: tuple[Array, ...]
    """Biases of the actnorms."""
    forward: tuple[Array, ...]
    """Inverses of ``matrices``."""


def prepare(params: Params) -> Prepared:
    """Precompute inverse matrices and unstack the steps: a scan over steps would copy every weight for every frame."""
    steps = len(params["actnorm"]["bias"])
    apart = [jax.tree.map(lambda array, k=k: array[k], params) for k in range(steps)]
    return Prepared(
        tuple(one["coupling"] for one in apart),
        tuple(inverse_weight(one["invertible"]).T * jnp.exp(-one["actnorm"]["log_scale"])[None] for one in apart),
        tuple(one["actnorm"]["bias"] for one in apart),
        tuple(jnp.exp(one["actnorm"]["log_scale"])[:, None] * weight(one["invertible"]).T for one in apart),
    )


def project(prepared: Prepared, condition: Float[Array, "*S D"]) -> tuple[Array, ...]:
    """:func:`a2g_jax.nn.flow.coupling.project_condition` of every step."""
    return tuple(project_condition(one, condition) for one in prepared.couplings)


def first_states(prepared: Prepared, shape: Shape, count: int, dtype: Any = jnp.float32) -> tuple[States, ...]:
    """Zero states of every step for ``count`` sequences."""
    return tuple(start_states(shape, count, dtype) for _ in prepared.couplings)


def glow_inverse_step(
    prepared: Prepared,
    shape: Shape,
    z: Float[Array, "B C"],
    history: Float[Array, "B H"],
    projected: tuple[Array, ...],
    states: tuple[States, ...],
    guidance: float = 1.0,
) -> tuple[Float[Array, "B C"], tuple[States, ...]]:
    """:func:`glow_inverse` of one frame.

    Args:
        projected: this frame's rows of :func:`project`, (B, gates) for every step.
        states: after the previous frame.
        guidance: of :func:`a2g_jax.nn.flow.coupling.coupling_inverse_step`.
    """
    x, after = z, []
    for one, matrix, bias, gates, state in reversed(
        list(zip(prepared.couplings, prepared.matrices, prepared.biases, projected, states, strict=True))
    ):
        x, state = coupling_inverse_step(one, shape, x, history, gates, state, guidance)
        x = x @ matrix - bias[None]
        after.append(state)
    return x, tuple(reversed(after))


def glow_step(
    prepared: Prepared,
    shape: Shape,
    x: Float[Array, "B C"],
    history: Float[Array, "B H"],
    projected: tuple[Array, ...],
    states: tuple[States, ...],
    guidance: float = 1.0,
) -> tuple[Float[Array, "B C"], Float[Array, " B"]]:
    """:func:`glow` of one frame: its latent, and the part of its log-determinant that depends on it.

    Arguments of :func:`glow_inverse_step`.
    """
    log_det = jnp.zeros(x.shape[0], x.dtype)
    for one, matrix, bias, gates, state in zip(
        prepared.couplings, prepared.forward, prepared.biases, projected, states, strict=True
    ):
        x, more = coupling_step(one, shape, (x + bias[None]) @ matrix, history, gates, state, guidance)
        log_det = log_det + more
    return x, log_det
