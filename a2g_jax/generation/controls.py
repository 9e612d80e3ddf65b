"""Requested controls of a speech, frame by frame."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.models.control_curves import Curve


def percentiles(curves: Sequence[Curve], start: int, frames: int, fps: float) -> Float[np.ndarray, "T K"]:
    """Requested percentiles of the frames from ``start``, which may lie before the first."""
    seconds = (start + np.arange(frames)) / fps
    columns = [np.interp(seconds, curve.seconds, curve.percentiles) for curve in curves]
    return np.stack(columns, axis=-1).astype(np.float32)
