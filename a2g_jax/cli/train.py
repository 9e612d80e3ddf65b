"""``a2g train``: train a model on a corpus."""

import argparse
import dataclasses

from a2g_jax.cli.paths import existing_corpus, existing_features
from a2g_jax.errors import InputError

DESCRIPTION = "Train a model on a corpus. Every setting of the model and the training is a flag too: see --settings."
#: Names of :data:`a2g_jax.models.MODELS`, whose modules import JAX.
MODEL_NAMES = ("audio2gestures", "speech2gesture", "stylized_flow", "motion_autoencoder", "emotion_classifier")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g train``; those of settings are read later, since they depend on the model."""
    parser.add_argument("model", choices=MODEL_NAMES)
    parser.add_argument("--corpus", metavar="CORPUS", help="made by 'a2g prepare'")
    parser.add_argument("--out", metavar="RUN", help="folder of the run")
    parser.add_argument(
        "--preset",
        default="tiny",
        help="tiny: minutes on 2 cores; paper: as published; for stylized_flow also ted, moglow and moglow_styled"
        " (default: tiny)",
    )
    parser.add_argument(
        "--features", metavar="RUN", help="a run of motion_autoencoder, or 'demo', for models with a perceptual loss"
    )
    parser.add_argument("--resume", action="store_true", help="resume from the latest checkpoint")
    parser.add_argument("--settings", action="store_true", help="list every setting with its value, and exit")


def run(options: argparse.Namespace, extra: list[str]) -> None:
    """Train, or list the settings.

    Args:
        extra: settings, such as ``["--learning-rate", "3e-4"]``.

    Raises:
        InputError: an unknown setting or preset, or a corpus, run or feature network that cannot be used.
    """
    if not options.settings:
        for name in ("corpus", "out"):
            if getattr(options, name) is None:
                raise InputError(f"--{name} is needed (see 'a2g train --help').")
        existing_corpus(options.corpus)
        existing_features(options.features)

    from a2g_jax.compilations import keep_compilations
    from a2g_jax.models import find_model
    from a2g_jax.models.train_config import training_preset
    from a2g_jax.training.start import parse_settings, run_training

    entry = find_model(options.model)
    if options.preset not in entry.presets:
        raise InputError(f"{options.model} has no preset {options.preset!r}; there are: {', '.join(entry.presets)}.")
    published = training_preset(options.model, options.preset)
    model, training = parse_settings(extra, entry.presets[options.preset], published)
    if options.settings:
        _print_settings(model)
        _print_settings(training)
        return
    keep_compilations()
    trained = run_training(
        options.model, options.preset, model, training, options.corpus, options.out, options.resume, options.features
    )
    following = f"a2g generate {options.out} --audio speech.wav --out DIR"
    if trained.config.build().sample is None:
        following = f"a2g inspect {options.out}"
    print(f"{options.out}: trained for {trained.steps} steps; next: {following}")


def _print_settings(settings: object) -> None:
    print(f"# {type(settings).__name__}")
    for field in dataclasses.fields(settings):  # type: ignore[arg-type]
        value = getattr(settings, field.name)
        text = ",".join(map(str, value)) if isinstance(value, tuple) else value
        print(f"--{field.name.replace('_', '-')} {text}")
