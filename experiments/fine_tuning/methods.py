"""What is compared on a part of a take: shipped weights, adapted statistics, training from scratch, fine-tuning."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from a2g_jax.io.files import read_json, write_json
from a2g_jax.models.base import Model
from a2g_jax.models.fine_tuning import FineTuning
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.dynamics import corpus_dynamics
from a2g_jax.training.fine_tuning import start_from, tuned_config, tuned_model, with_validation, without_measured
from a2g_jax.training.loop import train
from a2g_jax.training.run import Run, RunConfig, open_run
from a2g_jax.training.validation import collect_summary
from experiments.fine_tuning.takes import Fold


class Made(NamedTuple):
    """A run, and what it cost."""

    run: Run
    cpu_minutes: float


#: ``method(name of the shipped run, fold, seed, folder) -> Made``
Method = Callable[[str, Fold, int, Path], Made]


def shipped(name: str, fold: Fold, seed: int, folder: Path) -> Made:
    """The weights as they are."""
    del fold, seed, folder
    return Made(open_run(name), 0.0)


def adapted(name: str, fold: Fold, seed: int, folder: Path) -> Made:
    """Fine-tuning at step 0: the weights with the z-scores and the summary of the person."""
    del folder
    return Made(_untrained(name, fold, seed)[0], 0.0)


def moved(name: str, fold: Fold, seed: int, folder: Path) -> Made:
    """The same with the dynamics of the person."""
    del folder
    begun = time.process_time()
    run, model = _untrained(name, fold, seed)
    dynamics = corpus_dynamics(model, run.config, run.params, run.summary, fold.corpus)
    return Made(replace(run, dynamics=dynamics), (time.process_time() - begun) / 60.0)


def scratch_moved(name: str, fold: Fold, seed: int, folder: Path) -> Made:
    """The run from scratch with the dynamics of the person, as fine-tuning measures them."""
    begun = time.process_time()
    made = from_scratch(name, fold, seed, folder.with_name(folder.name.replace("-with-dynamics", "")))
    run, start = made.run, start_from(name, open_run(name))
    config = replace(run.config, source=start.source)
    dynamics = corpus_dynamics(config.build(), config, run.params, run.summary, fold.corpus)
    return Made(replace(run, dynamics=dynamics), made.cpu_minutes + (time.process_time() - begun) / 60.0)


def _untrained(name: str, fold: Fold, seed: int) -> tuple[Run, Model]:
    start = start_from(name, open_run(name))
    config = tuned_config(start, *_tuned_settings(start.run, seed), fold.corpus)
    model = tuned_model(config.build(), start.source)
    corpus, _ = with_validation(fold.corpus, model.clip_frames)
    summary = collect_summary(model, start.run.params, corpus, config)
    return Run(config, start.run.params, summary, 0), model


def fine_tuned(name: str, fold: Fold, seed: int, folder: Path) -> Made:
    """``a2g train MODEL --from NAME``, with its defaults."""
    start = start_from(name, open_run(name))
    config = tuned_config(start, *_tuned_settings(start.run, seed), fold.corpus)
    return _timed(config, fold, folder, start.run.params)


def from_scratch(name: str, fold: Fold, seed: int, folder: Path) -> Made:
    """The run's settings from initial weights, with as many steps; those of an own stage in their share of them."""
    run = open_run(name)
    steps = run.config.entry.fine_tuning.training.steps
    settings, training = run.config.model_config, run.config.train_config
    later = getattr(settings, "adversarial_steps", 0)
    if later:
        later = round(steps * later / (later + training.steps))
        settings = replace(settings, adversarial_steps=later)
    first = steps - later
    training = replace(training, steps=first, seed=seed, warmup_steps=first // 10, validate_every=10**6)
    config = RunConfig.of(run.config.model, run.config.preset, settings, training, fold.corpus)
    return _timed(replace(config, sampling=without_measured(run.config.sampling)), fold, folder, None)


METHODS: dict[str, Method] = {
    "shipped": shipped,
    "z-scores adapted alone": adapted,
    "z-scores and dynamics alone": moved,
    "from scratch": from_scratch,
    "from scratch with dynamics": scratch_moved,
    "fine-tuned": fine_tuned,
}
#: What of the settings of fine-tuning a method depends on; it is measured again when they change.
SETTINGS: dict[str, Callable[[FineTuning], str]] = {
    "shipped": lambda tuning: "",
    "z-scores adapted alone": lambda tuning: repr(replace(tuning, training=TrainConfig())),
    "z-scores and dynamics alone": lambda tuning: repr(replace(tuning, training=TrainConfig())),
    "from scratch": lambda tuning: str(tuning.training.steps),
    "from scratch with dynamics": lambda tuning: str(tuning.training.steps),
    "fine-tuned": repr,
}


def _tuned_settings(run: Run, seed: int) -> tuple[Any, TrainConfig]:
    tuning = run.config.entry.fine_tuning
    return replace(run.config.model_config, **tuning.settings), replace(tuning.training, seed=seed)


def _timed(config: RunConfig, fold: Fold, folder: Path, start: Any) -> Made:
    """The trained run, resumed where it was interrupted; minutes of processor time of all attempts."""
    clock = folder.parent / f"{folder.name}.json"
    before = read_json(clock)["cpu_minutes"] if clock.is_file() else 0.0
    begun = time.process_time()
    try:
        run = train(config, fold.corpus, folder, resume=folder.is_dir(), progress=False, start=start)
    finally:
        spent = before + (time.process_time() - begun) / 60.0
        folder.parent.mkdir(parents=True, exist_ok=True)
        write_json(clock, {"cpu_minutes": spent})
    return Made(run, spent)
