"""The description of a run in its folder, ``run.json``; importable without JAX."""

import os
from collections.abc import Collection
from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError, brief
from a2g_jax.io.sealed import read_sealed
from a2g_jax.models.control_curves import from_percentiles
from a2g_jax.models.entry import Entry

FORMAT = "a2g_jax run"
VERSION = 1
RUN_FILE = "run.json"
WEIGHTS_FILE = "weights.safetensors"
LOG_FILE = "metrics.jsonl"
#: Entries of descriptions that have a checksum.
SEALED_WITH = ("weights_sha256",)

#: Folders of the package by the names of the runs that are shipped with it.
SHIPPED = {"demo": "demo", "demo-flow": "demo_flow", "demo-emotion": "demo_emotion"}
#: The same of the shipped feature network.
SHIPPED_FEATURES = {"demo": "demo_features"}
#: What programs with a form call the runs.
SHIPPED_TITLES = {"demo": "Lively", "demo-flow": "Flow", "demo-emotion": "Emotion"}

#: Sampling settings that runs of version 0.1 kept among those of the model, by their names then.
_MOVED = {"control_curves": "controls"}

#: Settings of version 0.1 that are gone, with the value at which they had no effect.
_RETIRED = {"noise_frames": 1}


def run_folder(name: str | os.PathLike[str], shipped: dict[str, str] = SHIPPED) -> Path:
    """The folder of a run: a path, or the name of a shipped one."""
    if str(name) in shipped:
        return Path(str(resources.files("a2g_jax"))) / shipped[str(name)]
    return Path(name)


def no_run(folder: Path, shipped: Collection[str] = ()) -> InputError:
    """The error of a folder that is not there, or holds no run.

    Args:
        shipped: names of the runs of the package that would do.
    """
    if not folder.exists():
        others = "".join(f", {name}" for name in shipped)
        return InputError(f"{folder}: there is no such run; name a run folder{others}.")
    return InputError(f"{folder}: is not a run (no {RUN_FILE} in it); train one with 'a2g train', or use 'demo'.")


def read_description(folder: Path) -> dict[str, Any]:
    """The contents of ``run.json``.

    Raises:
        InputError: not a run, or one of another version.
    """
    about = folder / RUN_FILE
    if not about.is_file():
        raise no_run(folder, SHIPPED)
    values = read_sealed(about, SEALED_WITH)
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise InputError(f"{about}: is not the description of a run; train one with 'a2g train'.")
    if values.get("version") != VERSION:
        raise InputError(
            f"{about}: has version {brief(values.get('version'))}, this package reads {VERSION}; train it again."
        )
    return values


def split_settings(entry: Entry, values: dict[str, Any], about: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Settings of the model and of sampling, which runs of version 0.1 store together.

    Args:
        values: the contents of ``run.json``.
        about: its path, for the error.

    Raises:
        InputError: damaged contents, or a setting that no longer exists.
    """
    settings, sampling = values.get("model_config"), values.get("sampling")
    if not isinstance(settings, dict) or not isinstance(sampling, dict | None):
        raise InputError(f"{about}: is damaged (model_config or sampling); restore it or train again.")
    for part in (settings, sampling or {}):
        for name, default in _RETIRED.items():
            if part.get(name, default) != default:
                raise InputError(f"{about}: has {name} {part[name]}, a setting of version 0.1; train it again.")
    settings = {name: value for name, value in settings.items() if name not in _RETIRED}
    if sampling is not None:
        return settings, {name: value for name, value in sampling.items() if name not in _RETIRED}
    own = {field.name for field in fields(entry.sampling)} - {field.name for field in fields(entry.config)}
    moved = {name: _MOVED.get(str(name), str(name)) for name in settings}
    stored = {moved[name]: value for name, value in settings.items() if moved[name] in own}
    if "controls" in stored:
        stored["controls"] = [from_percentiles(str(text)) for text in stored["controls"]]
    return {name: value for name, value in settings.items() if moved[name] not in own}, stored
