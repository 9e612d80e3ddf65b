"""How a model is fine-tuned on recordings of a person, starting from the weights of a run; importable without JAX."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from a2g_jax.models.train_config import TrainConfig


@dataclass(frozen=True)
class FineTuning:
    """What a model does differently when it starts from a run; the defaults suit one to ten minutes of data."""

    training: TrainConfig = field(
        default_factory=lambda: TrainConfig(
            steps=400,
            batch_size=8,
            learning_rate=1e-4,
            schedule="cosine",
            warmup_steps=20,
            clip_norm=1.0,
            augmentation=0.5,
            checkpoint_every=50,
            validate_every=50,
            patience=4,
        )
    )
    """Training settings, which flags change."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the model in place of the run's, such as weights of losses; flags change them."""
    stages: tuple[str, ...] = ()
    """Names of the stages of training that are run; all of them if empty. A single one takes ``--steps`` steps."""
    frozen: tuple[str, ...] = ()
    """Networks that are not trained, those of them that a run has; ``--frozen`` names further ones."""
    pose_statistics: str = "corpus"
    """``corpus``: poses are z-scores of the new recordings, so that the networks' outputs have the new person's posture
    and amplitude from the first step; ``run``: z-scores of the run's corpus."""
    audio_statistics: str = "corpus"
    """The same of the audio features."""
    share: float = 1.0
    """Share of the trained weights in those of the new run; the rest are the weights that the training started from.
    Below 1, the motion keeps more of how those move and of their agreement with the speech."""
    dynamics: bool = False
    """Whether the new run has gains that bring its motion to the dynamics of the recordings
    (:mod:`a2g_jax.features.dynamics`); for models whose motion the audio alone decides."""
    keep_constant: bool = False
    """Whether values of poses that are constant in the run's corpus stay constant, for models that leave them out."""
