"""Starting a training from the paths of a corpus and a feature network."""

from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.loop import train
from a2g_jax.training.perceptual import load_perceptual
from a2g_jax.training.run import Run, RunConfig


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
