"""A run folder: everything that generation needs, in JSON and safetensors."""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from flax.traverse_util import flatten_dict, unflatten_dict

from a2g_jax import __version__
from a2g_jax.config import from_json
from a2g_jax.data.body_json import body_from_json, body_to_json
from a2g_jax.errors import InputError, brief
from a2g_jax.features.dynamics import Dynamics
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.io.files import atomic_path, sha256_file
from a2g_jax.metrics.body.bounds import extremes_from_json, extremes_to_json
from a2g_jax.models.base import Params
from a2g_jax.models.registry import find_trained_model
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.run_config import Perceptual as Perceptual
from a2g_jax.training.run_config import Run as Run
from a2g_jax.training.run_config import RunConfig as RunConfig
from a2g_jax.training.run_config import Source as Source
from a2g_jax.training.run_file import (
    FORMAT,
    RUN_FILE,
    SHIPPED,
    SHIPPED_FEATURES,
    VERSION,
    WEIGHTS_FILE,
    read_description,
    run_folder,
    split_settings,
)
from a2g_jax.training.run_hashes import Written, read_weights, write_description, write_exchange
from a2g_jax.training.shapes import parameter_shapes
from a2g_jax.training.speech_range import read_speech_range


def save_run(folder: str | os.PathLike[str], run: Run, log: Mapping[str, Any] | None = None) -> None:
    """Write ``run.json`` and ``weights.safetensors``: at every moment the two belong together.

    Args:
        log: ``bytes`` and ``sha256`` of the log of training so far.
    """
    folder, data = Path(folder), weights_bytes(run)
    values, written = run_to_json(run.config, run.steps), Written(hashlib.sha256(data).hexdigest(), log)
    with atomic_path(folder / WEIGHTS_FILE) as temporary:
        temporary.write_bytes(data)
        write_exchange(folder, values, written)
    write_description(folder, values, written)


def weights_bytes(run: Run) -> bytes:
    """The contents of a run's ``weights.safetensors``."""
    from safetensors.numpy import save

    arrays = {f"params/{name}": value for name, value in flatten_dict(run.params, sep="/").items()}
    arrays |= {f"summary/{name}": value for name, value in run.summary.items()}
    for name, statistics in run.config.statistics.items():
        arrays[f"statistics/{name}/mean"], arrays[f"statistics/{name}/std"] = statistics.mean, statistics.std
    if run.dynamics is not None:
        arrays |= {f"dynamics/{name}": value for name, value in run.dynamics.arrays().items()}
    return bytes(save({name: np.require(value, requirements="C") for name, value in arrays.items()}))


def run_to_json(config: RunConfig, steps: int) -> dict[str, Any]:
    """The contents of ``run.json``."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "package": __version__,
        "model": config.model,
        "preset": config.preset,
        "steps": steps,
        "model_config": asdict(config.model_config),
        "sampling": asdict(config.sampling_settings),
        "train_config": asdict(config.train_config),
        "fps": config.fps,
        "mel": asdict(config.mel),
        "pose": config.space.kind,
        **body_to_json(config.space.body),
        "corpus": config.corpus,
        "feature_network": None if config.perceptual is None else config.perceptual.fingerprint,
        "body_extremes": None if config.body_extremes is None else extremes_to_json(config.body_extremes),
        **({} if config.source is None else {"from": asdict(config.source)}),
        **({} if config.settings_file is None else {"settings_file": dict(config.settings_file)}),
    }


def load_run(folder: str | os.PathLike[str], check_shapes: bool = True) -> Run:
    """Read a run folder.

    Args:
        check_shapes: whether to compare the weights with the networks, which takes a second; those of the package
            are compared by its tests.

    Raises:
        InputError: not a run, nothing trained yet, or damaged or mismatching files: a changed byte is found by the
            hash of the weights in ``run.json``, and by its checksum.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    folder = Path(folder)
    about, weights = folder / RUN_FILE, folder / WEIGHTS_FILE
    if not about.is_file():
        read_description(folder)  # which says that it is no run
    data, values = read_weights(folder)
    try:
        arrays = dict(sorted(load(data).items()))  # they come in no order
    except (SafetensorError, OSError, ValueError) as error:
        raise InputError(f"{weights}: is damaged ({error}); restore it or train again.") from None
    try:
        statistics = {
            name: Statistics(arrays[f"statistics/{name}/mean"], arrays[f"statistics/{name}/std"])
            for name in ("audio", "pose", "root")
        }
        entry = find_trained_model(str(values["model"]), str(about))
        settings, sampling = split_settings(entry, values, about)
        config = RunConfig(
            model=values["model"],
            preset=values["preset"],
            model_config=from_json(entry.config, settings, str(about)),
            sampling=from_json(entry.sampling, sampling, str(about)),
            train_config=from_json(TrainConfig, values["train_config"], str(about)),
            fps=float(values["fps"]),
            mel=from_json(MelConfig, values["mel"], str(about)),
            space=PoseSpace(body_from_json(values), str(values.get("pose", "6d"))),
            statistics=statistics,
            corpus=values["corpus"],
            perceptual=Perceptual(values["feature_network"]) if values.get("feature_network") else None,
            source=from_json(Source, values["from"], str(about)) if values.get("from") else None,
            settings_file=stored_file(values),
        )
        if values.get("body_extremes") is not None:
            where = f"{about}: body_extremes"
            found = extremes_from_json(values["body_extremes"], config.body_reference, where)
            config = replace(config, body_extremes=found)
        config = replace(config, speech_range=read_speech_range(folder, config.mel))
        steps = int(values["steps"])
        gains = {
            name.removeprefix("dynamics/"): array for name, array in arrays.items() if name.startswith("dynamics/")
        }
        dynamics = Dynamics.of(gains) if gains else None
        if not isinstance(config.corpus, dict):
            raise TypeError("corpus is not an object")
    except InputError as error:
        if str(folder) in str(error):
            raise
        raise InputError(f"{about}: {error}") from None
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        reason = f"lacks {error}" if isinstance(error, KeyError) else f"cannot be read: {brief(error, 200)}"
        raise InputError(
            f"{folder}: is damaged ({RUN_FILE} or {WEIGHTS_FILE} {reason}); restore it or train again."
        ) from None
    params = unflatten_dict(
        {name.removeprefix("params/"): array for name, array in arrays.items() if name.startswith("params/")}, sep="/"
    )
    _check_params(weights, parameter_shapes(config) if check_shapes else None, params)
    summary = {name.removeprefix("summary/"): array for name, array in arrays.items() if name.startswith("summary/")}
    return Run(config, params, summary, steps, dynamics)


def stored_file(values: Mapping[str, Any]) -> dict[str, str] | None:
    """What a run's description has of the file of its settings."""
    found = values.get("settings_file")
    return {str(name): str(text) for name, text in found.items()} if isinstance(found, dict) else None


def demo_run() -> Run:
    """The trained Audio2Gestures shipped with the package: ``demo`` on the command line."""
    return open_run("demo")


def open_run(name: str | os.PathLike[str]) -> Run:
    """A run folder, or one of those that are shipped with the package: ``demo``, ``demo-flow`` and
    ``demo-emotion``.

    Raises:
        InputError: not a run, nothing trained yet, or damaged or mismatching files.
    """
    return load_run(run_folder(name), check_shapes=str(name) not in SHIPPED)


def demo_feature_run() -> tuple[Run, str]:
    """The shipped feature network, and the SHA-256 of its weights."""
    folder = run_folder("demo", SHIPPED_FEATURES)
    return load_run(folder), sha256_file(folder / WEIGHTS_FILE)


def keep_sampling(config: RunConfig, folder: Path) -> RunConfig:
    """The run with the sampling settings of its folder, which may have been changed since it was trained."""
    about = folder / RUN_FILE
    _, sampling = split_settings(config.entry, read_description(folder), about)
    return replace(config, sampling=from_json(config.entry.sampling, sampling, str(about)))


def _check_params(weights: Path, expected: dict[str, tuple[int, ...]] | None, params: Params) -> None:
    """Compare shapes with the model's own, where they are given, before anything is computed; refuse NaN."""
    found = flatten_dict(params, sep="/")
    if expected is None:
        expected = {name: tuple(array.shape) for name, array in found.items()}
    for name in sorted({*expected, *found}):
        want, got = expected.get(name, "nothing"), found.get(name)
        shape = "nothing" if got is None else tuple(got.shape)
        if got is None or want != shape:
            raise InputError(f"{weights}: {name}: expected {want}; got {shape}; it is of another model.")
        if not np.all(np.isfinite(got)):
            raise InputError(f"{weights}: {name} holds NaN or infinity; restore it or train again.")
