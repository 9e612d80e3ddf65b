"""The state of a training run and the step that advances it."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Bool, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.models.base import Loss, Model, Params, Stage, Update
from a2g_jax.models.optimiser import make_optimiser
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.precision import half_products
from a2g_jax.training.stages import StageSpan


class TrainState(NamedTuple):
    """Everything that a run needs to resume; a pytree. The data position is the step: batches are a function of it."""

    params: Params
    optimisers: dict[str, optax.OptState]
    """Of each update of each stage: see :func:`optimiser_name`."""
    step: Int[Array, ""]
    """Steps done, over all stages."""
    key: Key[Array, ""]
    """The run's key; never changes, and is folded with the step."""
    good: Bool[Array, ""]
    """Whether every loss and gradient so far was finite."""


Metrics = dict[str, Float[Array, ""]]


def optimiser_name(stage: Stage, update: Update) -> str:
    """The name of an update's optimiser in the state."""
    return f"{stage.name}.{update.name}"


def optimiser_of(update: Update, config: TrainConfig) -> optax.GradientTransformation:
    """The optimiser of an update.

    Args:
        config: settings of its stage.
    """
    return (update.optimiser or make_optimiser)(config)


def trained(update: Update, params: Params) -> Params:
    """The part of the parameters that an update changes."""
    return {name: params[name] for name in update.trains} if update.trains else params


def init_state(model: Model, spans: tuple[StageSpan, ...], seed: int, start: Params | None = None) -> TrainState:
    """The state at step 0, with the optimisers of all stages.

    Args:
        start: parameters of a run in place of initial ones; those that training alone has are initial.
    """
    key = jax.random.key(seed)
    # Step numbers count up from 0, so the initial weights take the one number that no step has.
    first = jax.random.fold_in(key, jnp.uint32(2**32 - 1))
    if start is None:
        params = jax.jit(model.init)(first)
    elif set(jax.eval_shape(model.init, first)) <= set(start):
        params = jax.tree.map(jnp.array, start)
    else:
        params = {**jax.jit(model.init)(first), **jax.tree.map(jnp.array, start)}
    optimisers = {
        optimiser_name(span.stage, update): optimiser_of(update, span.config).init(trained(update, params))
        for span in spans
        for update in span.stage.updates
    }
    return TrainState(params, optimisers, jnp.zeros((), jnp.int32), key, jnp.array(True))


def step_keys(key: Key[Array, ""], step: Int[Array, ""]) -> Key[Array, " 3"]:
    """Keys of one step, for the choice of clips, their augmentation, and the model."""
    return jax.random.split(jax.random.fold_in(key, step), 3)


def advance(span: StageSpan, state: TrainState, batch: Batch, key: Key[Array, ""]) -> tuple[TrainState, Metrics]:
    """One step of a stage, to be jitted: its updates one after another on one batch.

    A step whose losses or gradients are not finite changes no parameter; from then on ``good`` is false and no later
    step changes any, until the host notices and stops.
    """
    stage, params = span.stage, state.params
    step = state.step - span.first if span.first else state.step
    if (warm_start := stage.warm_start) is not None:
        params = jax.lax.cond(step == 0, lambda p: warm_start(p, batch), lambda p: p, params)
    good, total = state.good, jnp.zeros(())
    compute: Callable[..., Any]
    metrics: Metrics = {}
    optimisers = dict(state.optimisers)
    single = len(stage.updates) == 1
    for number, update in enumerate(stage.updates):
        own = key if single else jax.random.fold_in(key, number)
        params, name = dict(params), optimiser_name(stage, update)
        compute = partial(_gradient, update)
        if span.config.precision == "bf16":
            compute = half_products(compute)
        (loss, terms), gradient = compute(params, own, batch, step)
        norm = optax.global_norm(gradient)
        good &= jnp.isfinite(loss) & jnp.isfinite(norm)
        part = trained(update, params)
        changes, optimisers[name] = optimiser_of(update, span.config).update(gradient, optimisers[name], part)
        params |= optax.apply_updates(part, changes)
        total = loss if single else total + loss
        metrics |= {"gradient_norm" if single else f"gradient_norm_{update.name}": norm, **terms}
    keep: Callable[[Array, Array], Array] = lambda new, old: jnp.where(good, new, old)  # noqa: E731
    params = jax.tree.map(keep, params, state.params)
    optimisers = jax.tree.map(keep, optimisers, state.optimisers)
    return TrainState(params, optimisers, state.step + 1, state.key, good), {"loss": total, **metrics}


def _gradient(update: Update, params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]) -> Any:
    """Loss with its terms, and the gradient with respect to the part that the update trains."""

    def loss(part: Params) -> tuple[Array, dict[str, Array]]:
        return update.loss({**params, **part}, key, batch, step)

    return jax.value_and_grad(loss, has_aux=True)(trained(update, params))


def joint_loss(stage: Stage) -> Loss:
    """A loss: the sum of those of a stage's updates, with the terms of all."""
    if len(stage.updates) == 1:
        return stage.updates[0].loss

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        first, *others = (update.loss(params, key, batch, step) for update in stage.updates)
        total, terms = first[0], dict(first[1])
        for value, more in others:
            total, terms = total + value, {**terms, **more}
        return total, terms

    return loss
