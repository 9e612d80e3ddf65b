"""The stages of a training on a common count of steps."""

from dataclasses import replace
from typing import NamedTuple

import jax

from a2g_jax.errors import InputError
from a2g_jax.models.base import Model, Stage
from a2g_jax.models.train_config import TrainConfig


class StageSpan(NamedTuple):
    """A stage and its steps of the run."""

    stage: Stage
    first: int
    """Step of the run at which it begins."""
    config: TrainConfig
    """The training's settings with the stage's own number of steps, for schedules."""

    @property
    def stop(self) -> int:
        """Step of the run after its last."""
        return self.first + self.config.steps


def stage_spans(model: Model, config: TrainConfig) -> tuple[StageSpan, ...]:
    """The stages one after another, with their steps.

    Raises:
        InputError: stages or updates of one name, more than one stage without a number of steps, or parameters that do
            not exist.
    """
    names = [stage.name for stage in model.stages]
    if not names or len(set(names)) < len(names):
        raise InputError(f"{model.name}: expected stages of different names; got {', '.join(names) or 'none'}.")
    if sum(stage.steps is None for stage in model.stages) > 1:
        raise InputError(f"{model.name}: expected a number of steps for all stages but one.")
    parameters = set(jax.eval_shape(model.init, jax.random.key(0)))
    for stage in model.stages:
        updates = [update.name for update in stage.updates]
        if not updates or len(set(updates)) < len(updates):
            raise InputError(f"{model.name}, stage {stage.name}: expected updates of different names; got {updates}.")
        if unknown := {name for update in stage.updates for name in update.trains} - parameters:
            raise InputError(
                f"{model.name}, stage {stage.name}: trains {', '.join(sorted(unknown))}; the parameters are"
                f" {', '.join(sorted(parameters))}."
            )
    if config.stage_steps and len(config.stage_steps) != len(names):
        raise InputError(
            f"--stage-steps: expected {len(names)} numbers, for {', '.join(names)}; got {len(config.stage_steps)}."
        )
    lengths = config.stage_steps or [config.steps if stage.steps is None else stage.steps for stage in model.stages]
    spans: list[StageSpan] = []
    first = 0
    for stage, steps in zip(model.stages, lengths, strict=True):
        spans.append(StageSpan(stage, first, replace(config, steps=steps)))
        first += steps
    return tuple(spans)


def span_at(spans: tuple[StageSpan, ...], step: int) -> StageSpan:
    """The stage that a step (counted from 0) belongs to; the last one after the end."""
    return next((span for span in spans if step < span.stop), spans[-1])
