"""The state of a training run and the step that advances it."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Int, Key

from a2g_jax.models.base import Batch, Model, Params
from a2g_jax.training.config import TrainConfig


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


def make_optimiser(config: TrainConfig) -> optax.GradientTransformation:
    """Adam with the schedule and clipping of the settings."""
    adam = optax.adam(learning_rate(config))
    return optax.chain(optax.clip_by_global_norm(config.clip_norm), adam) if config.clip_norm > 0 else adam


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
    (loss, terms), gradient = jax.value_and_grad(model.loss, has_aux=True)(state.params, key, batch, state.step)
    norm = optax.global_norm(gradient)
    good = state.good & jnp.isfinite(loss) & jnp.isfinite(norm)
    updates, optimiser = make_optimiser(config).update(gradient, state.optimiser, state.params)
    params = optax.apply_updates(state.params, updates)
    keep: Callable[[Array, Array], Array] = lambda new, old: jnp.where(good, new, old)  # noqa: E731
    params = jax.tree.map(keep, params, state.params)
    optimiser = jax.tree.map(keep, optimiser, state.optimiser)
    metrics = {"loss": loss, "gradient_norm": norm, **terms}
    return TrainState(params, optimiser, state.step + 1, state.key, good), metrics
