"""Starting a training from the paths of a corpus and a feature network."""

from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.fine_tuning import start_from, tuned_config
from a2g_jax.training.loop import train
from a2g_jax.training.perceptual import load_perceptual
from a2g_jax.training.run import Run, RunConfig, open_run


def run_training(
    name: str,
    preset: str,
    model: Any,
    training: TrainConfig,
    corpus: str | Path,
    out: str | Path,
    resume: bool,
    features: str | Path | None = None,
    source: str | None = None,
) -> Run:
    """Train a model from the paths of a corpus, a feature network and a run to start from.

    Args:
        name: of the model.
        preset: from which the settings were made.
        model: its settings.
        out: folder of the run.
        resume: from the latest checkpoint in ``out``.
        features: a run of ``motion_autoencoder`` for a perceptual loss, or ``"demo"``.
        source: a run folder, or a shipped run, whose weights the training starts from.

    Raises:
        InputError: a corpus, run or feature network that cannot be used, or recordings that do not fit the source.
        Interrupted: by a signal, after saving the state.
    """
    opened = Corpus.open(corpus)
    perceptual = None if features is None else load_perceptual(features, opened)
    if source is None:
        return train(RunConfig.of(name, preset, model, training, opened, perceptual), opened, out, resume=resume)
    start = start_from(source, open_run(source))
    config = tuned_config(start, model, training, opened, perceptual)
    return train(config, opened, out, resume=resume, start=start.run.params)
