"""Poses as the flow sees them: z-scores of the channels that move, at every frame or at the knots of a spline."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.nn.spline import curve, knots


class Channels:
    """The C channels of M poses, between ``(B, T, R, D)`` and ``(B, M, C)`` arrays."""

    def __init__(self, statistics: Statistics, stride: int = 1, least_std: float = 0.0) -> None:
        """
        Args:
            statistics: of poses (R, D).
            stride: frames between poses.
            least_std: channels with a smaller standard deviation are left out.

        Raises:
            InputError: no channel is left.
        """
        self._statistics, self.stride = statistics, stride
        self.rows: tuple[int, int] = statistics.mean.shape  # type: ignore[assignment]
        self.kept = np.flatnonzero(np.asarray(statistics.std).reshape(-1) >= least_std).astype(np.int32)
        if len(self.kept) < 2:
            raise InputError(f"--least-std {least_std:g}: leaves {len(self.kept)} channels; give a smaller one.")

    def __len__(self) -> int:
        return len(self.kept)

    def frames(self, flat: Float[Array, "B T C"]) -> Float[Array, "B T R D"]:
        """Poses of z-scores frame by frame; channels that are left out have their means."""
        everything = self.rows[0] * self.rows[1]
        if len(self) < everything:
            flat = jnp.zeros((*flat.shape[:2], everything), flat.dtype).at[..., self.kept].set(flat)
        poses: Any = self._statistics.denormalise(flat.reshape(*flat.shape[:2], *self.rows))
        return poses

    def flat(self, pose: Float[Array, "B T R D"]) -> Float[Array, "B M C"]:
        """Z-scores of poses, at frames 0, stride, 2 stride, ..."""
        every: Any = self._statistics.normalise(pose).reshape(*pose.shape[:2], -1)
        return knots(every if len(self) == every.shape[-1] else every[..., self.kept], self.stride)

    def pose(self, flat: Float[Array, "B M C"]) -> Float[Array, "B T R D"]:
        """Poses of z-scores, ``stride`` times as many."""
        return self.frames(curve(flat, self.stride))
