"""Starting a training from the paths of a corpus and a feature network."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.io.files import sha256_file
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.progress import say
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.fine_tuning import check_fits, start_from, tuned_config
from a2g_jax.training.loop import train
from a2g_jax.training.perceptual import load_perceptual
from a2g_jax.training.run import Run, RunConfig, load_run, open_run, stored_file
from a2g_jax.training.run_file import RUN_FILE, WEIGHTS_FILE, read_description, run_folder


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
    verify: bool = False,
    devices: int | str | None = None,
    settings_file: Mapping[str, str] | None = None,
) -> Run:
    """Train a model from the paths of a corpus, a feature network and a run to start from.

    Args:
        name: of the model.
        preset: from which the settings were made.
        model: its settings.
        out: folder of the run.
        resume: from the latest checkpoint in ``out``.
        features: a run of ``motion_autoencoder`` for a perceptual loss, or ``"demo"``.
        source: a run folder, or a shipped run, whose weights the training starts from. It is not needed to resume:
            what is kept of it is stored in ``out`` with the first checkpoint.
        verify: read all files of the corpus to compare their hashes, see :func:`~a2g_jax.training.loop.train`.
        devices: how many share the clips of each batch, see the same.
        settings_file: what the run records of a file of settings; a resumed run keeps its own if None.

    Raises:
        InputError: a corpus, run or feature network that cannot be used, or recordings that do not fit the source.
        Interrupted: by a signal, after saving the state.
    """
    opened = Corpus.open(corpus)
    if settings_file is None and resume and (Path(out) / RUN_FILE).is_file():
        settings_file = stored_file(read_description(Path(out)))
    perceptual = None if features is None else load_perceptual(features, opened)
    stored = _stored_source(Path(out)) if resume else None
    if stored is not None and _has_begun(Path(out)):
        if source is not None:
            _check_weights(source, stored["weights"], out)
        before = load_run(out)
        check_fits(str(out), before.config, opened)
        config = replace(
            RunConfig.of(name, preset, model, training, opened, perceptual),
            space=before.config.space,
            statistics=before.config.statistics,
            sampling=before.config.sampling,
            body_extremes=before.config.body_extremes,
            source=before.config.source,
            settings_file=settings_file,
        )
        # The checkpoint replaces these parameters.
        return train(config, opened, out, resume=True, start=before.params, verify=verify, devices=devices)
    if source is None and stored is not None:
        source = stored["run"]
    if source is None:
        config = replace(RunConfig.of(name, preset, model, training, opened, perceptual), settings_file=settings_file)
        return train(config, opened, out, resume=resume, verify=verify, devices=devices)
    start = start_from(source, open_run(source))
    config = replace(tuned_config(start, model, training, opened, perceptual), settings_file=settings_file)
    if config.sampling != start.run.config.sampling:
        say(
            f"{out}: gains of controls are not taken from {source}, whose weights they were measured on; measure those"
            f" of the new weights with 'python -m experiments.controls {out} --store'."
        )
    return train(config, opened, out, resume=resume, start=start.run.params, verify=verify, devices=devices)


def _stored_source(out: Path) -> dict[str, Any] | None:
    """What the run in a folder records of the run that it started from; None if it started from initial weights."""
    source = read_description(out).get("from") if (out / RUN_FILE).is_file() else None
    return source if isinstance(source, dict) and {"run", "weights"} <= source.keys() else None


def _has_begun(out: Path) -> bool:
    """Whether a run folder has all that resuming needs: a checkpoint, and the statistics that lie with the weights."""
    return (out / WEIGHTS_FILE).is_file() and bool(Checkpoints(out / "checkpoints", 1).steps())


def _check_weights(source: str | Path, weights: str, out: str | Path) -> None:
    """Refuse a run to start from whose weights are not those of the training that is resumed."""
    file = run_folder(source) / WEIGHTS_FILE
    if not file.is_file() or sha256_file(file) != weights:
        raise InputError(
            f"{out}: started from other weights than those of {source}; resume without --from, or choose another"
            " folder."
        )
