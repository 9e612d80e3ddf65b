"""The trained network whose features are compared by learned metrics."""

import os
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.training.perceptual import load_feature_run
from a2g_jax.training.run import Run

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
            return np.zeros((0, self.run.config.model_config.encoder_channels[FID_BLOCK]), np.float32)
        return self.blocks(np.asarray(clips, np.float32))[FID_BLOCK].mean(axis=1)


def load_feature_network(folder: str | os.PathLike[str], corpus: Corpus) -> FeatureNetwork:
    """Load a run of ``motion_autoencoder`` for the poses of a corpus.

    Raises:
        InputError: not a run, one of another model, or one for other joints, poses or frame rates.
    """
    return FeatureNetwork(*load_feature_run(folder, corpus))
