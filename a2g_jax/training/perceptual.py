"""A trained feature network for perceptual losses, Frechet distance and LPIPS."""

import os
from collections.abc import Callable
from pathlib import Path

import jax
from jaxtyping import Array, Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.io.files import sha256_file
from a2g_jax.training.run import Perceptual, Run, RunConfig, demo_feature_run, load_run
from a2g_jax.training.run_file import WEIGHTS_FILE


def load_feature_run(folder: str | os.PathLike[str], corpus: Corpus) -> tuple[Run, str]:
    """A run of a model with features of motion, such as ``motion_autoencoder``, and the SHA-256 of its weights.

    Args:
        folder: of the run, or "demo" for the one that is shipped with the package.
        corpus: its poses must fit the network.

    Raises:
        InputError: not a run, one of a model without features, or one for other joints, poses or frame rate.
    """
    if folder == "demo":
        run, fingerprint = demo_feature_run()
    else:
        run, fingerprint = load_run(folder), sha256_file(Path(folder) / WEIGHTS_FILE)
    if run.config.build().features is None:
        raise InputError(f"{folder}: is a run of {run.config.model}; a feature network is one of motion_autoencoder.")
    check_poses(str(folder), run.config, corpus)
    return run, fingerprint


def check_poses(folder: str, config: RunConfig, corpus: Corpus) -> None:
    """Refuse a network that takes other poses than a corpus has.

    Raises:
        InputError: other joints, poses or frame rate.
    """
    theirs = (config.space.kind, config.space.shape, config.fps)
    ours = (corpus.space.kind, corpus.space.shape, corpus.fps)
    if theirs != ours:
        raise InputError(
            f"{folder}: takes {theirs[0]} {theirs[1]} at {theirs[2]:g} fps, but {corpus.path} holds {ours[0]}"
            f" {ours[1]} at {ours[2]:g} fps; train one on such a corpus, or prepare the corpus to match"
            " (--fps, --pose, --joints)."
        )


def features_of(run: Run) -> Callable[[Float[Array, "B T R D"]], list[Float[Array, "B T _"]]]:
    """A function of poses (B, T, R, D): features of each block (B, T, width), differentiable, weights constant."""
    params, features = jax.device_put(run.params), run.config.build().features
    assert features is not None
    return lambda pose: features(params, pose)


def load_perceptual(folder: str | os.PathLike[str], corpus: Corpus) -> Perceptual:
    """The feature network of a run, its weights frozen, for a perceptual loss.

    Raises:
        InputError: see :func:`load_feature_run`.
    """
    run, fingerprint = load_feature_run(folder, corpus)
    return Perceptual(fingerprint, features_of(run))
