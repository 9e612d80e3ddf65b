"""The registry entry of a model; importable without JAX."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from a2g_jax.models.fine_tuning import FineTuning
from a2g_jax.models.train_config import TRAIN_PRESETS, TrainConfig


@dataclass(frozen=True)
class NoSampling:
    """Sampling settings of a model without any."""


NO_SAMPLING = NoSampling()


@dataclass(frozen=True)
class Entry:
    """The settings of a model with their presets, and the function that builds the model."""

    config: type
    """Frozen dataclass of the settings of networks and losses; it has ``clip_frames``."""
    presets: Mapping[str, Any]
    """Instances of ``config`` by name: ``tiny`` trains in minutes on 2 cores, ``paper`` has the paper's settings."""
    build: str
    """``module:function`` of ``build(config, data, sampling) -> Model``; imported when it is needed, with JAX."""
    sampling: type = NoSampling
    """Frozen dataclass of the sampling settings; the flags of ``a2g generate`` are made from it."""
    sampling_presets: Mapping[str, Any] = field(default_factory=dict)
    """Instances of ``sampling`` by preset; the defaults of ``sampling`` where a preset is missing."""
    training: Mapping[str, TrainConfig] = field(default_factory=lambda: TRAIN_PRESETS)
    """Training settings by preset."""
    poses: tuple[str, ...] = ()
    """Kinds of poses that the model takes (:data:`a2g_jax.geometry.pose_space.WIDTHS`); all if empty."""
    needs_emotions: bool = False
    """Whether every recording of the corpus needs an emotion."""
    fine_tuning: FineTuning = field(default_factory=FineTuning)
    """How training goes that starts from a run (``a2g train --from``)."""

    def builder(self) -> Callable[..., Any]:
        """The function that ``build`` names."""
        module, _, name = self.build.partition(":")
        function: Callable[..., Any] = getattr(import_module(module), name)
        return function

    def sampling_preset(self, preset: str) -> Any:
        """Sampling settings of a preset."""
        return self.sampling_presets.get(preset, self.sampling())

    def training_preset(self, preset: str) -> TrainConfig:
        """Training settings of a preset; the common ones of that name if the model has none of its own."""
        return self.training.get(preset, TRAIN_PRESETS.get(preset, TRAIN_PRESETS["tiny"]))
