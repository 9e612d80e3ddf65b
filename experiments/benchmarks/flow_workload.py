"""Workload of the flow's benchmarks: the papers' sizes, random weights, random audio; nothing is downloaded."""

from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.base import Data
from a2g_jax.models.stylized_flow.config import PRESETS, StylizedFlowConfig


@dataclass(frozen=True)
class Case:
    """A model on a data set."""

    title: str
    preset: str
    rows: int
    """Joints or bones, of three values each."""
    bands: int
    fps: float
    batch: int
    """Clips of a training step, as published."""

    @property
    def channels(self) -> int:
        """Values of a pose."""
        return 3 * self.rows

    @property
    def config(self) -> StylizedFlowConfig:
        """The preset without the loss that needs another network."""
        return replace(PRESETS[self.preset], perceptual_weight=0.0)

    @property
    def data(self) -> Data:
        """Data of poses that are z-scores already."""
        zeros = np.zeros((self.rows, 3), np.float32)
        layout = PoseLayout(tuple(f"row {row}" for row in range(self.rows)), ())
        return Data(PoseSpace(layout, "directions"), self.fps, self.bands, Statistics(zeros, zeros + 1.0))


CASES = {
    "moglow": Case("MoGlow (LSTM 512), 45 values", "moglow", 15, 27, 20.0, 80),
    "trinity": Case("stylized flow (GRU 800), 45 values", "paper", 15, 27, 20.0, 100),
    "ted": Case("stylized flow (GRU 800), 27 values", "ted", 9, 29, 15.0, 200),
}


def moved(params: Any, seed: int) -> Any:
    """Weights with nonzero last layers, so that every layer affects the motion."""
    coupling = params["glow"]["coupling"]
    noise = 0.01 * jax.random.normal(jax.random.key(seed), coupling["out_kernel"].shape)
    return {**params, "glow": {**params["glow"], "coupling": {**coupling, "out_kernel": jnp.asarray(noise)}}}
