"""Longer training of a run than its settings said at first: ``--resume --steps MORE``."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax

from a2g_jax.config import from_json
from a2g_jax.errors import InputError
from a2g_jax.models.base import Model, Update
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.run_file import RUN_FILE, read_description
from a2g_jax.training.stages import StageSpan, stage_spans
from a2g_jax.training.state import optimiser_of, trained


def extended(config: TrainConfig, model: Model, out: Path) -> tuple[TrainConfig, str]:
    """The settings of a resumed run whose ``steps`` may be more than before, and a line about that; empty if not.

    Further steps are those of the last stage; the stages before it keep their lengths.

    Args:
        config: settings that are requested.
        out: folder of the run; of no run, the settings stay.

    Raises:
        InputError: fewer steps than before.
    """
    before = _stored(out)
    if before is None or (before.stage_steps, before.steps) == (config.stage_steps, config.steps):
        return config, ""
    if config.stage_steps not in ((), before.stage_steps):
        raise InputError(f"{out}: the lengths of its stages are recorded; leave --stage-steps out, and raise --steps.")
    config = replace(config, stage_steps=before.stage_steps)
    if config.steps == before.steps:
        return config, ""
    if config.steps < before.steps:
        raise InputError(
            f"--steps {config.steps}: {out} was trained for {before.steps}; name more to extend it, or leave it out."
        )
    old = stage_spans(model, before)
    if len(old) > 1 or before.stage_steps:
        lengths = [span.config.steps for span in old]
        config = replace(config, stage_steps=(*lengths[:-1], lengths[-1] + config.steps - before.steps))
    new = stage_spans(model, config)
    stage = "" if len(new) == 1 else f" in its last stage, {new[-1].stage.name},"
    line = f"{out}: extended{stage} from {old[-1].stop} to {new[-1].stop} steps"
    if _depends_on_length(model, old[-1], new[-1]):
        line += (
            "; its learning rate depends on the number of steps, and from here on it is that of the longer training:"
            " it changes at once, and the weights are not those of a training that was as long from the beginning"
        )
    return config, f"{line}."


def _stored(out: Path) -> TrainConfig | None:
    """The training settings of the run in a folder; None where there is nothing to resume."""
    if not (out / RUN_FILE).is_file() or not Checkpoints(out / "checkpoints", 1).steps():
        return None
    values: Any = read_description(out).get("train_config")
    return from_json(TrainConfig, values, str(out / RUN_FILE)) if isinstance(values, dict) else None


def _depends_on_length(model: Model, old: StageSpan, new: StageSpan) -> bool:
    """Whether any optimiser of a stage computes something else when the stage is longer."""
    params = jax.eval_shape(model.init, jax.random.key(0))

    def program(span: StageSpan, update: Update) -> str:
        optimiser, part = optimiser_of(update, span.config), trained(update, params)
        text = str(jax.make_jaxpr(optimiser.update)(part, jax.eval_shape(optimiser.init, part), part))
        return re.sub("0x[0-9a-f]+", "", text)  # addresses of functions

    return any(program(old, update) != program(new, update) for update in new.stage.updates)
