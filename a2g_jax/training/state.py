"""The state of a training run and the step that advances it."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.models.base import Model, Params
from a2g_jax.models.train_config import TrainConfig


class TrainState(NamedTuple):
    """Everything that a run needs to go on; a pytree. The data position is the step: batches are a function of it."""

    params: Params
    optimiser: optax.OptState
    step: Int[Array, ""]
    """Steps done."""
    key: Key[Array, ""]
    """The run's key; never changes, and is folded with the step."""
    good: Array
    """Whether every loss and gradient so far was finite."""


Metrics = dict[str, Float[Array, ""]]


def learning_rate(config: TrainConfig) -> optax.Schedule:
    """Learning rate as a function of the step."""
    if config.schedule == "noam":
        return _noam(config)
    if config.schedule == "constant":
        after = optax.constant_schedule(config.learning_rate)
    elif config.schedule == "cosine":
        after = optax.cosine_decay_schedule(
            config.learning_rate, max(1, config.steps - config.warmup_steps), alpha=0.01
        )
    else:
        raise ValueError(f"Expected schedule 'constant' or 'cosine'; got {config.schedule!r}.")
    if config.warmup_steps == 0:
        return after
    up = optax.linear_schedule(0.0, config.learning_rate, config.warmup_steps)
    return optax.join_schedules([up, after], [config.warmup_steps])


def _noam(config: TrainConfig) -> optax.Schedule:
    """Linearly up to the learning rate over the warm-up, then down with the root of the step, to a tenth of it."""
    warmup = max(1, config.warmup_steps)

    def schedule(count):
        number = jnp.asarray(count, jnp.float32) + 1.0
        scale = jnp.sqrt(warmup) * jnp.minimum(number * warmup**-1.5, number**-0.5)
        return config.learning_rate * jnp.where(number > warmup, jnp.maximum(scale, 0.1), scale)

    return schedule


def make_optimiser(config: TrainConfig) -> optax.GradientTransformation:
    """Adam with the schedule and clipping of the settings."""
    adam = optax.adam(learning_rate(config))
    clips = [optax.clip(config.clip_value)] if config.clip_value > 0 else []
    clips += [optax.clip_by_global_norm(config.clip_norm)] if config.clip_norm > 0 else []
    return optax.chain(*clips, adam) if clips else adam


def init_state(model: Model, config: TrainConfig) -> TrainState:
    """A run at step 0."""
    key = jax.random.key(config.seed)
    # Step numbers count up from 0, so the initial weights take the one number that no step has.
    params = jax.jit(model.init)(jax.random.fold_in(key, jnp.uint32(2**32 - 1)))
    return TrainState(params, make_optimiser(config).init(params), jnp.zeros((), jnp.int32), key, jnp.array(True))


def step_keys(key: Key[Array, ""], step: Int[Array, ""]) -> Key[Array, " 3"]:
    """Keys of one step: for the choice of clips, their augmentation, and the model."""
    return jax.random.split(jax.random.fold_in(key, step), 3)


def advance(
    model: Model, config: TrainConfig, state: TrainState, batch: Batch, key: Key[Array, ""]
) -> tuple[TrainState, Metrics]:
    """One step of training, to be jitted.

    A step whose loss or gradient is not finite changes no parameter; from then on ``good`` is false and no later step
    changes any, until the host notices and stops.
    """
    params = state.params
    if (warm_start := model.warm_start) is not None:
        params = jax.lax.cond(state.step == 0, lambda p: warm_start(p, batch), lambda p: p, params)
    (loss, terms), gradient = jax.value_and_grad(model.loss, has_aux=True)(params, key, batch, state.step)
    norm = optax.global_norm(gradient)
    good = state.good & jnp.isfinite(loss) & jnp.isfinite(norm)
    updates, optimiser = make_optimiser(config).update(gradient, state.optimiser, params)
    params = optax.apply_updates(params, updates)
    keep: Callable[[Array, Array], Array] = lambda new, old: jnp.where(good, new, old)  # noqa: E731
    params = jax.tree.map(keep, params, state.params)
    optimiser = jax.tree.map(keep, optimiser, state.optimiser)
    metrics = {"loss": loss, "gradient_norm": norm, **terms}
    return TrainState(params, optimiser, state.step + 1, state.key, good), metrics
