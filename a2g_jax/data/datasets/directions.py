"""Unit directions of bones from poses estimated from video."""

import numpy as np
from jaxtyping import Float

from a2g_jax.data.datasets.gaps import bridge_gaps

#: Shortest bone that has a direction, in the unit of the poses; estimators write zeros where they detect no person.
_SHORTEST = 1e-6


def unit_directions(bones: Float[np.ndarray, "T B 3"], fps: float, place: str) -> Float[np.ndarray, "T B 3"]:
    """Bones scaled to length 1, float32; gaps of up to half a second are bridged.

    A bone without length, or with NaN, is a gap. Frames without a skeleton are all zeros in the TED data
    sets.

    Raises:
        InputError: a bone has no direction for longer (:func:`~a2g_jax.data.datasets.gaps.bridge_gaps`).
    """
    with np.errstate(over="ignore"):
        length = np.linalg.norm(bones, axis=-1, keepdims=True)
    valid = np.isfinite(length) & (length > _SHORTEST)
    units = np.where(valid, bones / np.where(valid, length, 1.0), np.nan)
    units = bridge_gaps(units, fps, place)
    length = np.linalg.norm(units, axis=-1)
    # Halfway between opposite directions there is none: keep the one before.
    last = np.maximum.accumulate(np.where(length > _SHORTEST, np.arange(len(units))[:, None], 0), axis=0)
    units = np.take_along_axis(units, last[..., None], axis=0)
    return (units / np.linalg.norm(units, axis=-1, keepdims=True)).astype(np.float32)
