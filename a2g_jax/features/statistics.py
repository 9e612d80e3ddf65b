"""Mean and standard deviation of features, and normalising by them."""

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float


@dataclass(frozen=True, eq=False)
class Statistics:
    """Per-feature mean and standard deviation, taken over a training split; a pytree."""

    mean: Float[Array | np.ndarray, "*feature"]
    std: Float[Array | np.ndarray, "*feature"]

    def normalise(self, x: Float[Array | np.ndarray, "..."]) -> Any:
        """``(x - mean) / std`` over the trailing axes; NumPy stays NumPy."""
        return (x - self._like(self.mean, x)) / self._like(self.std, x)

    def denormalise(self, x: Float[Array | np.ndarray, "..."]) -> Any:
        """Inverse of :meth:`normalise`."""
        return x * self._like(self.std, x) + self._like(self.mean, x)

    @staticmethod
    def _like(value, x):
        # Leading axes are written out: the package runs under JAX's strict rank promotion.
        return value.reshape((1,) * (x.ndim - value.ndim) + value.shape)


jax.tree_util.register_dataclass(Statistics, data_fields=["mean", "std"], meta_fields=[])


class RunningStatistics:
    """Mean and variance of arrays that arrive in pieces, in float64 (Chan, Golub and LeVeque's update)."""

    def __init__(self) -> None:
        self.count = 0
        self.mean: np.ndarray | float = 0.0
        self.square: np.ndarray | float = 0.0

    def add(self, rows: Float[np.ndarray, "N *feature"]) -> None:
        """Take in N more rows."""
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
        """Statistics so far; standard deviations below ``floor`` are raised to it, so constant features stay small."""
        if self.count == 0:
            raise ValueError("Expected at least one row before statistics are taken; got none.")
        std = np.sqrt(np.asarray(self.square) / self.count)
        return Statistics(mean=np.asarray(self.mean, np.float32), std=np.maximum(std, floor).astype(np.float32))
