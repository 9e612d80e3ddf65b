"""Poses of a clip brought into the range of a run's training motion, channel by channel.

People stand, bend and hold their hands in other ways than the training corpus, and a rig's pose at rest is never quite
another's. A flow takes such offsets for enormous innovations: the latents of a real take are ten to twenty times as
large as those of training motion, and motion generated with them breaks. What a style is about, the order and rhythm of
movements, is in the deviations from the clip's own posture.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from a2g_jax.models.stylized_flow.channels import Channels
from a2g_jax.training.run import Run

#: Percentiles of training clips between which the middle of a clip's range is kept, and the largest half range.
_MIDDLES, _WIDEST = (1.0, 99.0), 95.0


class Ranges(NamedTuple):
    """Ranges of the C channels over training clips, z-scores."""

    channels: Int[np.ndarray, " C"]
    """Their numbers among the R * D values of a pose."""
    low: Float[np.ndarray, "N C"]
    high: Float[np.ndarray, "N C"]
    frames: int
    """Length of a training clip."""

    @classmethod
    def of(cls, run: Run) -> "Ranges | None":
        """Ranges that a run holds; None for a run without them."""
        if "pose_low" not in run.summary:
            return None
        settings = run.config.model_config
        channels = Channels(run.config.statistics["pose"], 1, getattr(settings, "least_std", 0.0)).kept
        low, high = np.asarray(run.summary["pose_low"]), np.asarray(run.summary["pose_high"])
        return cls(channels, low, high, run.config.build().clip_frames)


class Moved(NamedTuple):
    """Poses within the range, and what was changed; arrays have a value for each channel."""

    z: Float[np.ndarray, "T C"]
    offset: Float[np.ndarray, " C"]
    """Posture that was removed: the clip's own middle less the one that it was moved to, z-scores."""
    amplitude: Float[np.ndarray, " C"]
    """Factor on the deviations from the middle, at most 1."""
    clipped: float
    """Share of the values that were still beyond the range of all training clips, and were clipped to it."""


def into_range(z: Float[np.ndarray, "T C"], ranges: Ranges) -> Moved:
    """Z-scores of a clip whose posture and amplitude lie within those of the training clips.

    In each channel the middle of the clip's range is moved to the nearest one between the 1st and 99th percentile of
    training clips, and its half range is shrunk to their 95th. Both are means over parts as long as training clips. A
    clip within these ranges is unchanged.
    """
    width = min(ranges.frames, len(z))
    starts = range(0, len(z) - width + 1, max(1, width // 2))
    lowest, highest = (
        np.stack([edge(z[first : first + width], axis=0) for first in starts]) for edge in (np.min, np.max)
    )
    middle, half = (0.5 * (highest + lowest)).mean(axis=0), (0.5 * (highest - lowest)).mean(axis=0)
    middles = np.percentile(0.5 * (ranges.high + ranges.low), _MIDDLES, axis=0)
    widest = np.percentile(0.5 * (ranges.high - ranges.low), _WIDEST, axis=0)
    target = np.clip(middle, middles[0], middles[1])
    amplitude = np.minimum(1.0, widest / np.maximum(half, 1e-6))
    moved = target + amplitude * (z - middle)
    kept = np.clip(moved, ranges.low.min(axis=0), ranges.high.max(axis=0))
    return Moved(kept, middle - target, amplitude, float(np.mean(np.abs(kept - moved) > 1e-3)))


def rows_into_range(
    run: Run, rows: Float[np.ndarray, "T R D"], ranges: Ranges
) -> tuple[Float[np.ndarray, "T R D"], Moved]:
    """:func:`into_range` of poses; channels that do not move in training have their mean."""
    statistics, space = run.config.statistics["pose"], run.config.space
    mean, std = (np.asarray(part, np.float64).reshape(-1) for part in (statistics.mean, statistics.std))
    flat = space.continuous(rows, np.asarray(statistics.mean)).reshape(len(rows), -1)
    at = ranges.channels
    moved = into_range((flat[:, at] - mean[at]) / std[at], ranges)
    result = np.tile(mean, (len(rows), 1))
    result[:, at] += moved.z * std[at]
    return np.asarray(space.valid(jnp.asarray(result.reshape(rows.shape), jnp.float32))), moved
