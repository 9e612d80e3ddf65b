"""The description of a run, and a trained model with it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from a2g_jax.config import check_needs
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.features.dynamics import Dynamics, rows_with_dynamics
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.speech_range import SpeechRange
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.metrics.body.bounds import BodyBounds, Values, bounds_of
from a2g_jax.metrics.body.figures import Reference
from a2g_jax.models.base import Data, Model, Params, Summary
from a2g_jax.models.entry import Entry
from a2g_jax.models.registry import find_model
from a2g_jax.models.train_config import TrainConfig


@dataclass(frozen=True, eq=False)
class Perceptual:
    """The frozen feature network of a perceptual loss."""

    fingerprint: str
    """SHA-256 of its weights."""
    features: Callable[[Float[Array, "B T R D"]], list[Float[Array, "B T _"]]] | None = None
    """Poses (B, T, R, D) to features of each block (B, T, width), differentiable; None in a finished run, since only
    training needs them."""


@dataclass(frozen=True)
class Source:
    """The run that a training started from, and what was kept of it."""

    run: str
    """Its name or folder."""
    steps: int
    """Its training steps."""
    weights: str
    """SHA-256 of its weights."""
    corpus: str
    """Fingerprint of its corpus."""
    stages: tuple[str, ...] = ()
    """See :class:`a2g_jax.models.fine_tuning.FineTuning`, as for the other fields."""
    frozen: tuple[str, ...] = ()
    pose_statistics: str = "corpus"
    audio_statistics: str = "corpus"
    keep_constant: bool = False
    share: float = 1.0
    dynamics: bool = False


@dataclass(frozen=True, eq=False)
class RunConfig:
    """The description of a run: everything but its weights."""

    model: str
    preset: str
    model_config: Any
    train_config: TrainConfig
    fps: float
    mel: MelConfig
    space: PoseSpace
    """The body, and the kind of numbers that its poses are written in."""
    statistics: dict[str, Statistics]
    """``audio``, ``pose`` and ``root`` of the corpus's training split."""
    corpus: dict[str, Any]
    """Fingerprint, recipe, length, emotions and speakers of the corpus."""
    perceptual: Perceptual | None = None
    """The feature network of a perceptual loss."""
    sampling: Any = None
    """Sampling settings; None for those of the preset."""
    body_extremes: Values | None = None
    """Extremes of the training split's motion (:func:`~a2g_jax.metrics.body.bounds.extremes`), relative to the mean of
    :attr:`statistics`; None if not measured. Training of a run that starts from another one begins with those of that
    run."""
    source: Source | None = None
    """The run that training started from; None for initial weights."""
    speech_range: SpeechRange | None = None
    """The range of the training split's speech, in a file of its own beside ``run.json``; None if not measured."""
    settings_file: Mapping[str, str] | None = None
    """Name, SHA-256 and text of the file that settings were read from, where there was one; flags override it."""

    @property
    def entry(self) -> Entry:
        """The model's registry entry."""
        return find_model(self.model)

    @property
    def sampling_settings(self) -> Any:
        """Sampling settings."""
        return self.entry.sampling_preset(self.preset) if self.sampling is None else self.sampling

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton of the generated motion.

        Raises:
            InputError: the model generates keypoints or directions.
        """
        if not self.space.has_rotations:
            raise InputError(
                f"the run of {self.model} was trained on {self.space.noun}, which have no skeleton to animate; train on"
                " a corpus of rotations (a2g prepare --pose 6d), or score it with 'a2g evaluate'."
            )
        return self.space.skeleton

    @cached_property
    def body_bounds(self) -> BodyBounds:
        """Bounds of generated motion: those of the training split with margins; of any person if not measured.

        Raises:
            InputError: the model generates keypoints or directions.
        """
        return bounds_of(self.body_reference, self.body_extremes)

    @property
    def body_reference(self) -> Reference:
        """The mean pose of the training split, and the mean height of its root.

        Raises:
            InputError: the model generates keypoints or directions.
        """
        pose, root = self.statistics["pose"].mean, self.statistics["root"].mean
        return Reference(self.skeleton, np.asarray(self.space.mean_rotations(pose), np.float64), float(root[1]))

    @classmethod
    def of(
        cls,
        model: str,
        preset: str,
        model_config: Any,
        train_config: TrainConfig,
        corpus: Corpus,
        perceptual: Perceptual | None = None,
    ) -> "RunConfig":
        """The description of a run of a model on a corpus.

        Raises:
            InputError: the model does not take the corpus's kind of poses, or needs emotions where some recordings
                have none.
        """
        entry = find_model(model)
        if entry.poses:
            corpus.require_pose(*entry.poses)
        if entry.needs_emotions:
            corpus.require_emotions()
        about = {
            "fingerprint": corpus.fingerprint,
            "recipe": corpus.recipe,
            "seconds": corpus.frames / corpus.fps,
            "emotions": list(corpus.emotions),
            "speakers": list(corpus.speakers),
        }
        return cls(
            model=model,
            preset=preset,
            model_config=model_config,
            train_config=train_config,
            fps=corpus.fps,
            mel=corpus.mel,
            space=corpus.space,
            statistics=corpus.statistics,
            corpus=about,
            perceptual=perceptual,
        )

    def data(self) -> Data:
        """The properties of the corpus that the model is built for."""
        return Data(
            self.space,
            self.fps,
            self.mel.width,
            self.statistics["pose"],
            tuple(self.corpus.get("emotions", ())),
            tuple(self.corpus.get("speakers", ())),
            None if self.perceptual is None else self.perceptual.features,
            self.mel.sample_rate,
            self.mel.stack,
        )

    def build(self) -> Model:
        """The model's functions."""
        model: Model = self.entry.builder()(self.model_config, self.data(), self.sampling_settings)
        return model

    def with_sampling(self, **changes: Any) -> "RunConfig":
        """The run with other sampling settings.

        Raises:
            InputError: a setting that the model does not have or that has no effect on it, or a value out of range.
        """
        names = [field.name for field in fields(self.sampling_settings)]
        for name in changes:
            if name not in names:
                raise InputError(
                    f"{self.model}: has no sampling setting {name!r}; it has: {', '.join(names) or 'none'}."
                )
        changes = {name: tuple(value) if isinstance(value, list) else value for name, value in changes.items()}
        changed = replace(self.sampling_settings, **changes)
        check_needs(self.sampling_settings, changed, vars(self.model_config))
        return replace(self, sampling=changed)


@dataclass(frozen=True, eq=False)
class Run:
    """A trained model: description, parameters and latent summary."""

    config: RunConfig
    params: Params
    summary: Summary
    steps: int
    """Training steps of the weights."""
    dynamics: Dynamics | None = None
    """Gains of generated motion, of a run that was fine-tuned; None for none."""

    def finished(self, rows: Float[np.ndarray, "T R D"]) -> Float[np.ndarray, "T R D"]:
        """Poses of a whole generated motion with the run's dynamics: the poses themselves where it has none."""
        config = self.config
        return rows if self.dynamics is None else rows_with_dynamics(config.space, rows, self.dynamics, config.fps)
