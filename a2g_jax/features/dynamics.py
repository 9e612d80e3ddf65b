"""How strongly motion moves, in bands of frequency and as a whole, brought to that of recorded motion.

A network that was trained on a minute of a person has the person's postures, but moves too evenly and too smoothly:
averages over what it cannot predict. What is missing is little and regular, so that a filter adds it: each band of
frequency is scaled by a gain that depends on how strong the band is at the moment, and movements are slowed where the
whole body hardly moves. All filters are symmetric in time, so that gestures stay where they are in the speech.

Gains are found by :mod:`a2g_jax.features.dynamics_fit`.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from a2g_jax.geometry.pose_rows import rotations_from_rows, unit_vectors
from a2g_jax.geometry.pose_space import PoseSpace

Values = Float[np.ndarray, "T R D"]

#: Frequencies between the bands, Hz: there the filter of the lower band halves the amplitude.
EDGES = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
#: Standard deviation, seconds, of the Gaussian that halves the amplitude at 1 Hz.
_HALF = float(np.sqrt(np.log(2.0) / 2.0) / np.pi)
#: Smoothing of the body's speed, seconds (standard deviation), and the frequency in Hz below which slowed movements
#: return to where they would have been.
_SPEED_SMOOTHING, _RETURN = 0.2, 0.1
#: Added to amplitudes and to speeds before their logarithm, in standard deviations and in their own unit.
LEAST, _LEAST_SPEED = 1e-4, 1e-3


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Gains of motion, and the levels that they depend on. Gains and levels are natural logarithms."""

    mean: Float[np.ndarray, "R D"]
    """Mean of generated values, which gains leave as it is."""
    shift: Float[np.ndarray, "R D"]
    """From there to the mean of the recorded ones."""
    std: Float[np.ndarray, "R D"]
    """Standard deviation of recorded values."""
    weight: Float[np.ndarray, " R"]
    """Of each row in the body's speed."""
    slow: Float[np.ndarray, " R"]
    """Gain below the first band."""
    levels: Float[np.ndarray, "bands R shares"]
    """Quantiles of the envelope of each band and row, of generated motion."""
    gains: Float[np.ndarray, "bands R shares"]
    """Gain at each of them, between them interpolated."""
    speed_levels: Float[np.ndarray, " shares"]
    """Quantiles of the body's speed after that, of generated motion."""
    speed_gains: Float[np.ndarray, " shares"]
    """Gain of the speed at each of them, at most 0."""

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays by name."""
        return {name: np.asarray(value, np.float32) for name, value in asdict(self).items()}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray]) -> "Dynamics":
        """The inverse of :meth:`arrays`.

        Raises:
            ValueError: shapes that do not belong together, or NaN.
        """
        rows, shares = len(arrays["weight"]), len(arrays["speed_levels"])
        bands = (len(EDGES), rows, shares)
        expected = {"slow": (rows,), "levels": bands, "gains": bands, "speed_gains": (shares,)}
        expected |= dict.fromkeys(("mean", "shift", "std"), (rows, *arrays["mean"].shape[1:]))
        for name, shape in expected.items():
            if arrays[name].shape != shape:
                raise ValueError(f"dynamics/{name}: expected {shape}, got {arrays[name].shape}")
        if not all(np.all(np.isfinite(value)) for value in arrays.values()):
            raise ValueError("dynamics hold NaN or infinity")
        return cls(**arrays)


def values_of(space: PoseSpace, rows: Float[np.ndarray, "T R _"]) -> Float[np.ndarray, "T R _"]:
    """The numbers of poses that are filtered: rotations as 6D vectors, which never jump, and others as they are."""
    rotations = space.read(rows)
    return np.asarray(rows) if rotations is None else PoseSpace(space.skeleton, "6d").write(rotations)


def rows_with_dynamics(
    space: PoseSpace, rows: Float[np.ndarray, "T R D"], dynamics: Dynamics, fps: float
) -> Float[np.ndarray, "T R D"]:
    """Poses of a whole motion with the gains, as valid poses of their space."""
    values = with_dynamics(values_of(space, rows), dynamics, fps)
    if not space.has_rotations:
        return unit_vectors(values, space.kind, rows)
    return space.continuous(space.write(rotations_from_rows(values, "6d")), rows[0])


def with_dynamics(values: Values, dynamics: Dynamics, fps: float) -> Values:
    """The values of a whole motion with the gains; 6D vectors are no longer orthonormal.

    Args:
        values: 6D rotations or other poses whose numbers do not jump.
    """
    normal = (values - dynamics.mean) / dynamics.std
    change = band_change(normal, dynamics, fps)
    change += speed_change(normal + change, dynamics, fps)
    return np.asarray(values + change * dynamics.std + dynamics.shift, np.float32)


def band_change(normal: Values, dynamics: Dynamics, fps: float) -> Values:
    """What the gains of the bands add to z-scores."""
    slow, bands = split(normal, fps)
    change = slow * np.expm1(dynamics.slow)[:, None]
    for number, band in enumerate(bands):
        level = envelope(np.mean(np.square(band), axis=-1), number, fps)
        tables = zip(level.T, dynamics.levels[number], dynamics.gains[number], strict=True)
        gain = np.stack([np.interp(*table) for table in tables], axis=1)
        change = change + np.expm1(gain)[..., None] * band
    return change


def speed_change(normal: Values, dynamics: Dynamics, fps: float) -> Values:
    """What slowing of the whole body adds to z-scores.

    The velocity is multiplied by the gain. Places that are then not reached are returned to slowly.
    """
    level = speed_level(normal, dynamics.weight, fps)
    less = np.expm1(np.interp(level, dynamics.speed_levels, dynamics.speed_gains))[:, None, None]
    gap = np.concatenate([np.zeros_like(normal[:1]), np.cumsum(less * np.diff(normal, axis=0), axis=0)])
    return gap - _smooth(gap, _HALF / _RETURN * fps)


def split(values: Float[np.ndarray, "T *shape"], fps: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """The part below the first of :data:`EDGES`, and the bands above it; together they are the values."""
    smooth = [_smooth(values, _HALF / edge * fps) for edge in EDGES]
    return smooth[0], [upper - lower for upper, lower in zip([*smooth[1:], values], smooth, strict=True)]


def envelope(power: Float[np.ndarray, "T N"], number: int, fps: float) -> Float[np.ndarray, "T N"]:
    """Logarithm of the amplitude of a band, from its power at each frame.

    Args:
        number: of the band; envelopes of slower bands are smoothed over longer times.
    """
    found: np.ndarray = 0.5 * np.log(_smooth(power, _HALF / EDGES[number] * fps) + LEAST**2)
    return found


def speed_level(normal: Values, weight: Float[np.ndarray, " R"], fps: float) -> Float[np.ndarray, " t"]:
    """Logarithm of the weighted speed of all rows between frames, smoothed; one frame fewer."""
    power = np.mean(np.square(np.diff(normal, axis=0) * fps), axis=-1) @ np.square(weight)
    return np.asarray(0.5 * np.log(_smooth(power, _SPEED_SMOOTHING * fps) + _LEAST_SPEED**2))


def _smooth(values: np.ndarray, frames: float) -> np.ndarray:
    """Values smoothed in time by a Gaussian; before the first and after the last frame they are constant."""
    if len(values) == 0:
        return values
    return np.asarray(gaussian_filter1d(values, frames, axis=0, mode="nearest", truncate=3.0))
