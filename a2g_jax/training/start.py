"""Starting a training: settings read from text, corpus and feature network opened from their paths."""

import dataclasses
from pathlib import Path
from typing import Any

from a2g_jax.config import parse_text
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.loop import train
from a2g_jax.training.perceptual import load_perceptual
from a2g_jax.training.run import Run, RunConfig


def parse_settings(pairs: list[str], model: Any, training: TrainConfig) -> tuple[Any, TrainConfig]:
    """The settings of model and training, changed by flags such as ``["--learning-rate", "3e-4"]``.

    Raises:
        InputError: an unknown setting, or a value that does not fit it.
    """
    fields = {field.name: owner for owner in (model, training) for field in dataclasses.fields(owner)}
    changes: dict[str, dict[str, Any]] = {"model": {}, "training": {}}
    rest = list(pairs)
    while rest:
        flag = rest.pop(0)
        if not flag.startswith("--"):
            raise InputError(f"unexpected argument {flag!r}; settings are written --name value.")
        name, equals, text = flag[2:].partition("=")
        name = name.replace("-", "_")
        if name not in fields:
            raise InputError(f"no setting --{name.replace('_', '-')}; 'a2g train MODEL --settings' lists them.")
        owner = fields[name]
        if not equals:
            if rest and not rest[0].startswith("--"):
                text = rest.pop(0)
            elif isinstance(getattr(owner, name), bool):
                text = "true"
            else:
                raise InputError(f"{flag}: needs a value.")
        changes["model" if owner is model else "training"][name] = parse_text(type(owner), name, text)
    return dataclasses.replace(model, **changes["model"]), dataclasses.replace(training, **changes["training"])


def run_training(
    name: str,
    preset: str,
    model: Any,
    training: TrainConfig,
    corpus: str | Path,
    out: str | Path,
    resume: bool,
    features: str | Path | None = None,
) -> Run:
    """Train a model from the paths of a corpus and a feature network.

    Args:
        name: of the model.
        preset: from which the settings were made.
        model: its settings.
        out: folder of the run.
        resume: from the latest checkpoint in ``out``.
        features: a run of ``motion_autoencoder`` for a perceptual loss, or ``"demo"``.

    Raises:
        InputError: a corpus, run or feature network that cannot be used.
        Interrupted: by a signal, after saving the state.
    """
    opened = Corpus.open(corpus)
    perceptual = None if features is None else load_perceptual(features, opened)
    return train(RunConfig.of(name, preset, model, training, opened, perceptual), opened, out, resume=resume)
