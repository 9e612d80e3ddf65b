"""A model of another package: a GAN stage, a second stage on the frozen first, labels, words and seed poses."""

from dataclasses import dataclass

from a2g_jax.models.entry import Entry
from a2g_jax.models.train_config import TrainConfig


@dataclass(frozen=True)
class ToyConfig:
    """Settings of the networks."""

    channels: int = 8
    clip_frames: int = 16
    seed_frames: int = 2
    spread_steps: int = 8
    """Training steps of the second stage."""


@dataclass(frozen=True)
class ToySampling:
    """Settings of generation."""

    amplitude: float = 1.0
    """Scale of the drawn noise."""


ENTRY = Entry(
    config=ToyConfig,
    presets={"tiny": ToyConfig()},
    build="toy_gestures.model:build",
    sampling=ToySampling,
    training={
        "tiny": TrainConfig(
            steps=12,
            batch_size=4,
            learning_rate=1e-3,
            clip_norm=1.0,
            checkpoint_every=5,
            validate_every=10,
            log_every=1,
        )
    },
)
