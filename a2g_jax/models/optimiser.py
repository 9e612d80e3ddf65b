"""The common optimiser of training: Adam with a schedule and clipping."""

import jax.numpy as jnp
import optax

from a2g_jax.models.train_config import TrainConfig


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
        raise ValueError(f"Expected schedule 'constant', 'cosine' or 'noam'; got {config.schedule!r}.")
    if config.warmup_steps == 0:
        return after
    up = optax.linear_schedule(0.0, config.learning_rate, config.warmup_steps)
    return optax.join_schedules([up, after], [config.warmup_steps])


def _noam(config: TrainConfig) -> optax.Schedule:
    """Linear warm-up to the learning rate, then decay with the inverse root of the step, to a tenth of the rate."""
    warmup = max(1, config.warmup_steps)

    def schedule(count):
        number = jnp.asarray(count, jnp.float32) + 1.0
        scale = jnp.sqrt(warmup) * jnp.minimum(number * warmup**-1.5, number**-0.5)
        return config.learning_rate * jnp.where(number > warmup, jnp.maximum(scale, 0.1), scale)

    return schedule


def make_optimiser(config: TrainConfig, momentum: float = 0.9) -> optax.GradientTransformation:
    """Adam with the schedule and clipping of the settings.

    Args:
        momentum: decay of the first moment; 0.5 is usual in adversarial games.
    """
    adam = optax.adam(learning_rate(config), b1=momentum)
    clips = [optax.clip(config.clip_value)] if config.clip_value > 0 else []
    clips += [optax.clip_by_global_norm(config.clip_norm)] if config.clip_norm > 0 else []
    return optax.chain(*clips, adam) if clips else adam
