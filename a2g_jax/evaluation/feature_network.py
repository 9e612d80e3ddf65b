"""The trained network whose features are compared by learned metrics."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.training.perceptual import load_feature_run
from a2g_jax.training.run import Run, RunConfig

#: Residual block whose features FID compares: the fourth (Audio2Gestures, extended, Sec. 5.1).
FID_BLOCK = 3


@dataclass(frozen=True, eq=False)
class FeatureNetwork:
    """A trained motion autoencoder."""

    run: Run
    fingerprint: str
    """SHA-256 of its weights: scores of different networks cannot be compared."""

    @property
    def clip_frames(self) -> int:
        """Frames of a clip, from which one feature vector is computed."""
        frames: int = self.run.config.model_config.clip_frames
        return frames

    @property
    def features(self) -> int:
        """Length of a feature vector."""
        width: int = self.run.config.model_config.encoder_channels[FID_BLOCK]
        return width

    @cached_property
    def _blocks(self) -> Any:
        features = self.run.config.build().features
        assert features is not None
        return jax.jit(features)

    def blocks(self, pose: Float[np.ndarray, "B T R D"]) -> list[Float[np.ndarray, "B T _"]]:
        """Features of every residual block, frame by frame."""
        return [np.asarray(block) for block in self._blocks(self.run.params, jnp.asarray(pose))]

    def clip_features(self, pose: Float[np.ndarray, "T R D"]) -> Float[np.ndarray, "n F"]:
        """Time-averaged features of the fourth block, for clips one after another; a remainder is left out."""
        count = len(pose) // self.clip_frames
        clips = pose[: count * self.clip_frames].reshape(count, self.clip_frames, *pose.shape[1:])
        if count == 0:
            return np.zeros((0, self.features), np.float32)
        return self.blocks(np.asarray(clips, np.float32))[FID_BLOCK].mean(axis=1)


def load_feature_network(folder: str | os.PathLike[str], corpus: Corpus) -> FeatureNetwork:
    """Load a run of ``motion_autoencoder`` for the poses of a corpus.

    Raises:
        InputError: not a run, one of another model, or one for other joints, poses or frame rates.
    """
    return FeatureNetwork(*load_feature_run(folder, corpus))


def check_separate(runs: Mapping[str, Run], network: FeatureNetwork | None) -> None:
    """Refuse to score runs with the network that a loss of theirs used.

    A run that was trained to match a network's features scores well by these features, whatever it looks like.

    Args:
        runs: runs by name.
        network: for FGD and LPIPS; None for neither.

    Raises:
        InputError: a run's perceptual loss used the network.
    """
    for name, run in runs.items():
        if network is not None and trained_against(run.config, network):
            raise InputError(
                f"{name}: was trained with a loss on the feature network {network.fingerprint[:16]}, which therefore"
                " favours it in FGD and LPIPS; give --features a network trained with another seed (a2g train"
                " motion_autoencoder --seed 1), or leave it out."
            )


def trained_against(config: RunConfig, network: FeatureNetwork) -> bool:
    """Whether a loss of a run uses the network: the same weights, by their hash."""
    used = config.perceptual if config.build().needs_perceptual else None
    return used is not None and used.fingerprint == network.fingerprint


def vectors_of(frames: Sequence[int], clip_frames: int, where: str) -> tuple[int, int]:
    """Number of feature vectors in clips of these lengths, and of clips too short for one.

    Args:
        frames: length of each clip.
        clip_frames: frames from which the network takes one vector.
        where: the corpus and split, for the error.

    Raises:
        InputError: fewer than two vectors, which have no covariance.
    """
    counts = [count // clip_frames for count in frames]
    if sum(counts) < 2:
        raise InputError(
            f"{where}: feature vectors are of {clip_frames} frames, and in clips of at most {max(frames)} there are"
            f" {sum(counts)}, but FGD needs two or more; prepare longer recordings, train a network with smaller"
            " --clip-frames, or leave out --features."
        )
    return sum(counts), counts.count(0)
