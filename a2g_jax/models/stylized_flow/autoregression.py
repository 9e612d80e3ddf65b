"""Sampling of the flow, pose by pose.

Poses of training have a little normal noise (``input_noise``), so what is drawn is a clean pose plus such noise. The
drawn pose conditions the later ones, as in training, and the motion gets the clean one's expectation given the drawn
one and its conditioning, which is the drawn pose plus ``noise^2`` times the gradient of its own log-density (Tweedie's
formula; Efron 2011): a function of the present and the past.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from a2g_jax.models.base import Params, Summary
from a2g_jax.models.stylized_flow.networks import AudioContext, FlowNetworks
from a2g_jax.nn.flow.glow import Prepared, first_states, glow_inverse_step, glow_step, prepare
from a2g_jax.nn.flow.predictor import inverse_whitening, predictor, predictor_inverse
from a2g_jax.nn.flow.priors import log_prob
from a2g_jax.nn.spline import AFTER, BEFORE, along

#: Largest correction of a value, standard deviations of the noise: where the density is poorly learned, its gradient
#: is too.
_FARTHEST = 3.0


class State(NamedTuple):
    """State of sampling between poses."""

    history: Float[Array, "B history C"]
    """Poses as drawn, z-scores, the oldest first."""
    shown: Float[Array, "B 2 C"]
    """The last two poses of the motion."""
    states: Any
    """Hidden states of the recurrent layers."""


class Limits(NamedTuple):
    """The range of each channel in training motion, z-scores; generated poses beyond it are pulled back.

    Errors of a pose enter the next one, and over minutes they accumulate in channels that hardly move, such as ankles.
    """

    low: Float[Array, " C"]
    high: Float[Array, " C"]

    @classmethod
    def of(cls, summary: Summary) -> "Limits | None":
        """Limits of training motion; None for a summary without them."""
        if "pose_low" not in summary:
            return None
        low, high = jnp.asarray(summary["pose_low"]), jnp.asarray(summary["pose_high"])
        return cls(jnp.min(low, axis=0), jnp.max(high, axis=0))

    def kept(self, x: Float[Array, "B C"]) -> Float[Array, "B C"]:
        """Poses with half of the excess over the range removed: a spring, so that no motion stops within a frame."""
        return x - 0.5 * (x - jnp.clip(x, self.low[None], self.high[None]))


class Sampling(NamedTuple):
    """How poses are drawn."""

    limits: Limits | None = None
    """Within them the poses are the latents' own."""
    noise: float = 0.0
    """Standard deviation of the noise that is removed, z-scores; 0 for none."""
    guidance: float = 1.0
    """Weight of the style code, and of the controls that come with it: 1 as in training, more for a stronger style.
    Without a style code it has no effect."""


def start(
    networks: FlowNetworks,
    params: Params,
    count: int,
    seed: Float[Array, "history C"] | None = None,
    how: Sampling = Sampling(),  # noqa: B008
) -> State:
    """State before the first pose of ``count`` sequences.

    Args:
        seed: poses before it; the mean pose if None.
    """
    shape = (count, networks.config.history_frames, networks.channels)
    history = jnp.zeros(shape) if seed is None else jnp.broadcast_to(seed[None], shape)
    last = jnp.concatenate([history[:, :1], history], axis=1)[:, -2:]
    runs = count if how.guidance == 1.0 else 2 * count
    return State(history, last, first_states(prepare(params["glow"]), networks.shape, runs, history.dtype))


def proceed(
    networks: FlowNetworks,
    params: Params,
    z: Float[Array, "T B C"],
    given: AudioContext,
    state: State,
    first: Int[Array, ""],
    how: Sampling = Sampling(),  # noqa: B008
) -> tuple[Float[Array, "B F C"], State]:
    """Frames ``first`` to ``first + F - 1`` of motions as z-scores, one pose after another, and the state after them.

    Args:
        z: latents by frame, of F frames and the model's overlap after them. Those at multiples of the stride count.
        given: the context of the same frames.
        state: after the poses before ``first``.
    """
    stride, overlap = networks.config.stride, networks.config.overlap
    frames = len(z) - overlap
    if how.guidance != 1.0 and not given.unguided:
        # Half of the states are of the condition without the style; without guidance they are not used.
        count = len(state.history)
        half = state._replace(states=jax.tree.map(lambda array: array[:count], state.states))
        poses, after = proceed(networks, params, z, given, half, first, how._replace(guidance=1.0))
        both = jax.tree.map(lambda new, old: jnp.concatenate([new, old[count:]]), after.states, state.states)
        return poses, after._replace(states=both)
    step = _one_pose(networks, params, how)
    context = given.projected, given.unguided, given.embedding
    if stride == 1:
        after, shown = jax.lax.scan(lambda state, one: step(state, *one), state, (z, *context))
        return jnp.swapaxes(shown, 0, 1), after
    # Poses lie at the absolute frames that are multiples of the stride, so that windows agree. Those after the window
    # that its last frames depend on are drawn here and once more in the next window, from the state before them.
    offset = (-first) % stride
    own = -((-first - frames) // stride) - -(-first // stride)
    count = frames // stride + 1 + AFTER
    rows = jnp.minimum(offset + stride * jnp.arange(count), len(z) - 1)

    def one(states, inputs):
        (state, kept), (number, *rest) = states, inputs
        state, shown = step(state, *rest)
        kept = jax.tree.map(lambda new, old: jnp.where(number < own, new, old), state, kept)
        return (state, kept), shown

    inputs = jnp.arange(count), *jax.tree.map(lambda array: array[rows], (z, *context))
    (_, after), shown = jax.lax.scan(one, (state, state), inputs)
    around = jnp.concatenate([state.shown, jnp.swapaxes(shown, 0, 1)], axis=1)
    # The first of these knots lies two strides before the window's first pose, that of a spline one before frame 0.
    return along(around, jnp.arange(frames) - offset + (2 - BEFORE) * stride, stride), after


def _one_pose(networks: FlowNetworks, params: Params, how: Sampling) -> Any:
    """A function of the state and a pose's latents and context: the state after it, and the pose of the motion."""
    config, shape = networks.config, networks.shape
    prepared: Prepared = prepare(params["glow"])
    unwhitening = inverse_whitening(params["predictor"]) if config.predictor else None
    guidance = how.guidance

    def twice(array):
        return jnp.concatenate([array, array]) if guidance != 1.0 else array

    def step(state: State, latent, projected, unguided, embedding):
        history, _, hidden = state
        count = len(history)
        visible = networks.visible(params, history[:, None])
        poses = visible.reshape(count, -1)
        if config.global_channels:
            audio = jnp.broadcast_to(embedding[None, None], (count, 1, embedding.shape[0]))
            feature = networks.fuse(params, networks.embed(params, "pose", visible), audio)
            poses = jnp.concatenate([poses, feature[:, 0]], axis=-1)
        poses = twice(poses)
        context = tuple(jnp.broadcast_to(share[None], (count, share.shape[0])) for share in projected)
        if guidance != 1.0:
            plain = tuple(jnp.broadcast_to(share[None], (count, share.shape[0])) for share in unguided)
            context = tuple(jnp.concatenate(pair) for pair in zip(context, plain, strict=True))
        x, after = glow_inverse_step(prepared, shape, twice(latent), poses, context, hidden, guidance)
        x = x[:count]
        if unwhitening is not None:
            x = predictor_inverse(params["predictor"], x, history, unwhitening)
        drawn = x if how.limits is None else how.limits.kept(x)
        shown = drawn
        if how.noise > 0:

            def log_density(x):
                inner = predictor(params["predictor"], x, history) if config.predictor else x
                z, log_det = glow_step(prepared, shape, twice(inner), poses, context, hidden, guidance)
                return jnp.sum((log_prob(z, config.freedom) + log_det)[:count])

            change = how.noise**2 * jax.grad(log_density)(x)
            shown = drawn + jnp.clip(change, -_FARTHEST * how.noise, _FARTHEST * how.noise)
        history = jnp.concatenate([history[:, 1:], drawn[:, None]], axis=1)
        return State(history, jnp.concatenate([state.shown[:, 1:], shown[:, None]], axis=1), after), shown

    return step
