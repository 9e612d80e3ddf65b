"""A trained motion autoencoder as what measures motion: for perceptual losses, Fréchet distance and LPIPS."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import jax
from jaxtyping import Array

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.io.files import sha256_file
from a2g_jax.models.motion_autoencoder import encode

if TYPE_CHECKING:
    from a2g_jax.training.run import Run, RunConfig

FEATURE_MODEL = "motion_autoencoder"


@dataclass(frozen=True, eq=False)
class Perceptual:
    """The frozen network of a perceptual loss, as a run remembers it."""

    fingerprint: str
    """SHA-256 of its weights."""
    features: Callable[[Array], list[Array]]
    """Poses (B, T, R, D) to features of each block (B, T, width), differentiable."""


def load_feature_run(folder: str | os.PathLike[str], corpus: Corpus) -> tuple["Run", str]:
    """A run of ``motion_autoencoder`` that looks at such poses as a corpus has, and the SHA-256 of its weights.

    Args:
        folder: of the run, or "demo" for the one that comes with the package.

    Raises:
        InputError: not a run, one of another model, or one for other joints, poses or frame rate.
    """
    from a2g_jax.training.run import WEIGHTS_FILE, demo_feature_run, load_run

    if folder == "demo":
        run, fingerprint = demo_feature_run()
    else:
        run, fingerprint = load_run(folder), sha256_file(Path(folder) / WEIGHTS_FILE)
    config = run.config
    if config.model != FEATURE_MODEL:
        raise InputError(f"{folder}: is a run of {config.model}; a feature network is one of {FEATURE_MODEL}.")
    check_sight(str(folder), config, corpus)
    return run, fingerprint


def check_sight(folder: str, config: "RunConfig", corpus: Corpus) -> None:
    """Refuse a network that looks at other motion than a corpus has.

    Raises:
        InputError: other joints, poses or frame rate.
    """
    there = (config.representation, config.statistics["pose"].mean.shape, config.fps)
    here = (corpus.representation, corpus.statistics["pose"].mean.shape, corpus.fps)
    if there != here:
        raise InputError(
            f"{folder}: looks at {there[0]} {there[1]} at {there[2]:g} fps, but {corpus.path} holds {here[0]} {here[1]}"
            f" at {here[2]:g} fps; train one on such a corpus, or prepare the corpus so (--fps, --pose, --joints)."
        )


def load_perceptual(folder: str | os.PathLike[str], corpus: Corpus) -> Perceptual:
    """The feature network of a run, its weights held fixed.

    Raises:
        InputError: see :func:`load_feature_run`.
    """
    run, fingerprint = load_feature_run(folder, corpus)
    params, data = jax.device_put(run.params), run.config.data()
    return Perceptual(fingerprint, lambda pose: encode(run.config.model_config, data, params, pose))


def absent(fingerprint: str) -> Perceptual:
    """The network of a finished run, which only training needs."""

    def features(_pose: Array) -> list[Array]:
        raise ValueError("the feature network is there in training alone")

    return Perceptual(fingerprint, features)
