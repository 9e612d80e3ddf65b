"""``a2g train``: train a model on a corpus."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from a2g_jax.cli.argument_types import VERIFY, device_count, seed_list
from a2g_jax.cli.paths import existing_corpus, existing_features, existing_run, writable_folder
from a2g_jax.cli.settings_file import TABLES, SettingsFile, read_settings, settings_text
from a2g_jax.config import from_json, parse_flags, settings_lines
from a2g_jax.errors import InputError
from a2g_jax.models.entry import Entry
from a2g_jax.models.registry import find_model, model_names
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.run_file import RUN_FILE, read_description, run_folder, split_settings

DESCRIPTION = "Train a model on a corpus. Every setting of the model and the training is a flag too: see --settings."
#: Further flags are settings.
TAKES_SETTINGS = True


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g train``; those of settings are read later, since they depend on the model."""
    parser.add_argument(
        "model", metavar="MODEL", help=f"{', '.join(model_names())}, or package.module:ENTRY of another package"
    )
    parser.add_argument("--corpus", metavar="CORPUS", help="made by 'a2g prepare'")
    parser.add_argument("--out", metavar="RUN", help="folder of the run")
    parser.add_argument(
        "--preset",
        help="tiny: minutes on 2 cores; paper: as published; for stylized_flow also ted, moglow and moglow_styled"
        " (default: tiny)",
    )
    parser.add_argument(
        "--from",
        dest="source",
        metavar="RUN",
        help="start from the weights of a run (a folder, or demo, demo-flow or demo-emotion), with its settings, to"
        " adapt it to one to ten minutes of a person's recordings; prepare these with 'a2g prepare ... --for RUN'",
    )
    parser.add_argument(
        "--features", metavar="RUN", help="a run of motion_autoencoder, or 'demo', for models with a perceptual loss"
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="resume from the latest checkpoint with the settings of the run, or start where there is none",
    )
    parser.add_argument(
        "--devices",
        type=device_count,
        metavar="N|all",
        help="devices that share the clips of each batch; several hosts by JAX_COORDINATOR_ADDRESS, JAX_NUM_PROCESSES"
        " and JAX_PROCESS_ID, or Slurm (default: 1; with several processes all)",
    )
    parser.add_argument("--verify", action="store_true", help=VERIFY)
    parser.add_argument(
        "--seeds",
        type=seed_list,
        metavar="N,N,...",
        help="a run for each seed, one after the other: RUN_seed0, RUN_seed1, ...; --resume resumes all",
    )
    parser.add_argument(
        "--config",
        metavar="FILE.toml",
        help="settings in the tables [model] and [training], which flags override; recorded in the run",
    )
    parser.add_argument("--settings", action="store_true", help="list every setting with its value, and exit")
    parser.add_argument("--toml", action="store_true", help="with --settings: as a file for --config")


def run(options: argparse.Namespace, extra: list[str]) -> None:
    """Train, or list the settings.

    Args:
        extra: settings, such as ``["--learning-rate", "3e-4"]``.

    Raises:
        InputError: an unknown model, setting or preset, or a corpus, run or feature network that cannot be used.
    """
    entry = find_model(options.model)
    if options.source is not None and options.preset is not None:
        raise InputError(f"--preset: the settings are those of {options.source}; leave --preset or --from out.")
    preset = options.preset or "tiny"
    if preset not in entry.presets:
        raise InputError(f"{options.model} has no preset {preset!r}; there are: {', '.join(entry.presets)}.")
    existing_run(options.source)
    if not options.settings:
        for name in ("corpus", "out"):
            if getattr(options, name) is None:
                raise InputError(f"--{name} is needed (see 'a2g train --help').")
        existing_corpus(options.corpus)
        existing_features(options.features)
        writable_folder(options.out)
    if options.toml and not options.settings:
        raise InputError("--toml: is for --settings, which prints a file for --config.")
    if options.seeds and any(text.partition("=")[0] == "--seed" for text in extra):
        raise InputError("--seed: the seeds are those of --seeds; leave one of them out.")
    file = None if options.config is None else read_settings(options.config)
    names = [options.out] if not options.seeds else [f"{options.out}_seed{seed}" for seed in options.seeds]
    if options.seeds and not options.settings and not options.resume:
        for name in names:
            if (Path(name) / RUN_FILE).exists():
                raise InputError(f"{name}: holds a run already; continue all with --resume, or choose another --out.")

    runs = []
    for name, seed in zip(names, options.seeds or [None], strict=True):
        flags = extra if seed is None else [*extra, "--seed", str(seed)]
        runs.append(_chosen(argparse.Namespace(**{**vars(options), "out": name}), flags, entry, preset, file))
    if options.settings:
        for _, _, model, training, _ in runs[:1]:
            print(settings_text(model, training) if options.toml else _listed(model, training))
        return

    from a2g_jax.training.processes import joined_processes

    with joined_processes():
        for run_options, run_preset, model, training, new in runs:
            _train(run_options, run_preset, model, training, new, None if file is None else file.record())


def _chosen(
    options: argparse.Namespace, extra: list[str], entry: Entry, preset: str, file: SettingsFile | None
) -> tuple[argparse.Namespace, str, Any, TrainConfig, bool]:
    """The flags, preset and settings of a run, and whether there is none to resume."""
    published = [entry.presets[preset], entry.training_preset(preset)]
    if options.source is not None:
        preset, *published = _source(options.source, options.model, entry)
    stored = None if options.settings or not options.resume else _stored(Path(options.out), options.model, entry)
    if stored is not None:
        preset, *published = stored
    if file is not None:
        published = [file.applied(table, settings) for table, settings in zip(TABLES, published, strict=True)]
    model, training = parse_flags(extra, *published, hint=f"'a2g train {options.model} --settings'")
    return options, preset, model, training, stored is None


def _listed(model: Any, training: TrainConfig) -> str:
    parts = "# settings of the model", *settings_lines(model), "", "# settings of the training"
    return "\n".join((*parts, *settings_lines(training)))


def _train(
    options: argparse.Namespace,
    preset: str,
    model: Any,
    training: TrainConfig,
    new: bool,
    file: dict[str, str] | None,
) -> None:
    """Train, and print what may follow.

    Args:
        new: whether there is no run to resume.
        file: what the run records of a file of settings.
    """
    from a2g_jax.compilations import keep_compilations
    from a2g_jax.training.processes import is_first
    from a2g_jax.training.start import run_training

    keep_compilations()
    if options.resume and new and is_first():
        print(f"{options.out}: holds no run to resume; training starts at step 0")
    trained = run_training(
        options.model,
        preset,
        model,
        training,
        options.corpus,
        options.out,
        options.resume,
        options.features,
        options.source,
        options.verify,
        options.devices,
        file,
    )
    if not is_first():
        return
    # A run folder names its model, and code of other packages is imported only by permission.
    allowed = f"A2G_MODELS={options.model} " if ":" in options.model else ""
    following = f"{allowed}a2g generate {options.out} --audio speech.wav --out DIR"
    if not trained.config.space.has_rotations:
        following = f"{allowed}a2g evaluate {options.out} --corpus {options.corpus} --out DIR"
    if trained.config.build().sample is None:
        following = f"{allowed}a2g inspect {options.out}"
    print(f"{options.out}: trained for {trained.steps} steps; next: {following}")


def _source(name: str, model: str, entry: Entry) -> tuple[str, Any, TrainConfig]:
    """Preset and settings of the run to start from, and the settings of the model's fine-tuning."""
    folder = run_folder(name)
    about, values = folder / RUN_FILE, read_description(folder)
    if values.get("model") != model:
        raise InputError(f"{name}: is a run of {values.get('model')}; train that model, or start from one of {model}.")
    settings: Any = from_json(entry.config, split_settings(entry, values, about)[0], str(about))
    tuning = entry.fine_tuning
    return str(values.get("preset")), replace(settings, **tuning.settings), tuning.training


def _stored(folder: Path, model: str, entry: Entry) -> tuple[str, Any, TrainConfig] | None:
    """Preset and settings of the run in a folder; None where there is no run of that model."""
    about = folder / RUN_FILE
    if not about.is_file() or (values := read_description(folder)).get("model") != model:
        return None
    settings: Any = from_json(entry.config, split_settings(entry, values, about)[0], str(about))
    training = from_json(TrainConfig, values.get("train_config", {}), str(about))
    return str(values.get("preset")), settings, training
