"""Mean and standard deviation of features, and normalisation."""

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float


@dataclass(frozen=True, eq=False)
class Statistics:
    """Mean and standard deviation of each feature over a training split; a pytree."""

    mean: Float[Array | np.ndarray, "*feature"]
    std: Float[Array | np.ndarray, "*feature"]

    def normalise(self, x: Float[Array | np.ndarray, "..."]) -> Any:
        """``(x - mean) / std`` over the trailing axes; of NumPy arrays as NumPy."""
        return (x - self._like(self.mean, x)) / self._like(self.std, x)

    def denormalise(self, x: Float[Array | np.ndarray, "..."]) -> Any:
        """Inverse of :meth:`normalise`."""
        return x * self._like(self.std, x) + self._like(self.mean, x)

    @staticmethod
    def _like(value, x):
        # Explicit leading axes: the package runs under JAX's strict rank promotion.
        return value.reshape((1,) * (x.ndim - value.ndim) + value.shape)


jax.tree_util.register_dataclass(Statistics, data_fields=["mean", "std"], meta_fields=[])


class RunningStatistics:
    """Mean and variance of arrays that arrive in pieces, in float64 (Chan, Golub and LeVeque's update)."""

    def __init__(self) -> None:
        self.count = 0
        self.mean: np.ndarray | float = 0.0
        self.square: np.ndarray | float = 0.0

    def add(self, rows: Float[np.ndarray, "N *feature"]) -> None:
        """Add N rows."""
        count = len(rows)
        if count == 0:
            return
        rows = np.asarray(rows, np.float64)
        mean = rows.mean(axis=0)
        total = self.count + count
        delta = mean - self.mean
        self.square = self.square + ((rows - mean) ** 2).sum(axis=0) + delta**2 * (self.count * count / total)
        self.mean = self.mean + delta * (count / total)
        self.count = total

    def result(self, floor: float) -> Statistics:
        """Statistics of all rows so far; deviations of at least ``floor`` keep constant features small."""
        if self.count == 0:
            raise ValueError("Expected statistics of at least one row; got none.")
        std = np.sqrt(np.asarray(self.square) / self.count)
        return Statistics(mean=np.asarray(self.mean, np.float32), std=np.maximum(std, floor).astype(np.float32))
