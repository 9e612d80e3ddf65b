"""Findings on a motion outside the bounds of a body."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.body.bounds import BodyBounds, anybody
from a2g_jax.metrics.body.figures import Reference

#: Seconds between frames outside the same bound from which they are two findings.
_APART = 0.25

#: A finding in words: joint, then value, unit and decimals.
_WORDS = {
    "finite": ("{} is not a number", "", 0),
    "turn": ("{} turns at", "degrees/s", 0),
    "range": ("{} is turned away from its mean by", "degrees", 0),
    "tilt": ("{} leans by", "degrees", 0),
    "bend": ("{} is bent by", "degrees", 0),
    "backwards": ("{} is bent backwards by", "degrees", 0),
    "sideways": ("{} is bent sideways by", "degrees", 0),
    "wrist_speed": ("{} moves at", "m/s", 2),
    "wrist_jerk": ("{} jerks with", "m/s3", 0),
    "root_speed": ("{} moves at", "m/s", 2),
    "sink": ("{} is below the floor by", "m", 2),
    "lift": ("{}: both feet are above the floor by", "m", 2),
    "slide": ("{} stands and slides within half a second by", "m", 2),
}


@dataclass(frozen=True)
class BodyFinding:
    """A stretch of frames in which one joint is outside one bound."""

    figure: str
    """As :meth:`~a2g_jax.metrics.body.figures.Reference.figures` names it; ``finite`` for NaN and infinities."""
    joint: str
    frame: int
    """The worst one."""
    seconds: float
    value: float
    bound: float
    first: int
    """First frame of the stretch, and the one after its last."""
    stop: int
    frames: int
    """Frames outside the bound in the stretch."""

    def __str__(self) -> str:
        words, unit, digits = _WORDS[self.figure]
        place = f"{self.seconds:.2f} s (frame {self.frame}): {words.format(self.joint)}"
        return place + (f" {self.value:.{digits}f} {unit}; bound {self.bound:.{digits}f}" if unit else "")

    def to_json(self) -> dict[str, Any]:
        """The finding as JSON values; NaN as null."""
        finite = lambda value: value if not isinstance(value, float) or np.isfinite(value) else None  # noqa: E731
        return {name: finite(value) for name, value in asdict(self).items()}


@dataclass(frozen=True, eq=False)
class Stretch:
    """Frames ``first`` to ``stop`` (exclusive) with bounds of their own, such as those of a pinned clip."""

    first: int
    stop: int
    bounds: BodyBounds
    fixed: bool = True
    """Whether the motion in these frames is given, so that nothing may change it."""


def check_motion(
    motion: Motion, bounds: BodyBounds | None = None, stretches: Sequence[Stretch] = ()
) -> tuple[BodyFinding, ...]:
    """Findings on frames outside bounds; none for a sound motion.

    Args:
        motion: on the skeleton of the bounds, at any frame rate.
        bounds: of a run (:attr:`~a2g_jax.training.run_config.RunConfig.body_bounds`); those of any person if None,
            measured from the motion's own mean pose.
        stretches: frames with other bounds; where several overlap, the highest one of each figure holds.

    Returns:
        The furthest outside first; speed and jerk of the wrists, which mostly follow from a joint of the arm, last.

    Raises:
        ValueError: another number of joints than that of the bounds.
    """
    broken = _not_finite(motion)
    if broken or motion.frames == 0:
        return broken
    if bounds is None:
        bounds = anybody(_own_reference(motion))
    if len(bounds.reference.pose) != motion.skeleton.joints:
        raise ValueError(f"expected {len(bounds.reference.pose)} joints; got {motion.skeleton.joints}")
    found: list[BodyFinding] = []
    for name, values in bounds.reference.figures(motion).items():
        high = np.broadcast_to(bounds.high[name], values.shape)
        if stretches:
            high = _with_stretches(high, name, stretches)
        outside = values > high
        for column in np.flatnonzero(outside.any(axis=0)):
            joint = bounds.reference.parts[name][column]
            found += _findings(name, joint, values[:, column], high[:, column], outside[:, column], motion.fps)
    return tuple(sorted(found, key=lambda one: (one.figure.startswith("wrist"), -_excess(one), one.frame)))


def frames_outside(findings: Iterable[BodyFinding], frames: int) -> int:
    """Number of frames in the stretches of findings."""
    flags = np.zeros(frames, bool)
    for finding in findings:
        flags[finding.first : finding.stop] = True
    return int(flags.sum())


def _excess(finding: BodyFinding) -> float:
    """How many times its bound a figure is, for the order of findings; bounds near zero count as one hundredth."""
    return float(finding.value / max(finding.bound, 0.01)) if np.isfinite(finding.value) else np.inf


def _own_reference(motion: Motion) -> Reference:
    mean = np.asarray(motion.rotations, np.float64).mean(axis=0)
    left, _, right = np.linalg.svd(mean)
    turned = np.sign(np.linalg.det(left @ right))
    left[..., -1] *= turned[:, None]
    reference = Reference(motion.skeleton, left @ right, 0.0)
    if not reference.feet:
        return reference
    # The floor is where the feet of the motion are lowest.
    lowest = np.percentile(motion.positions()[:, reference.feet, 1].min(axis=1), 5.0)
    return Reference(motion.skeleton, reference.pose, float(lowest - reference.soles.min()))


def _with_stretches(
    high: Float[np.ndarray, "T _"], name: str, stretches: Sequence[Stretch]
) -> Float[np.ndarray, "T _"]:
    high = high.copy()
    for one in stretches:
        rows = slice(max(one.first, 0), max(one.stop, 0))
        high[rows] = np.maximum(high[rows], one.bounds.high[name])
    return high


def _not_finite(motion: Motion) -> tuple[BodyFinding, ...]:
    bad = ~np.isfinite(np.asarray(motion.rotations)).all(axis=(-2, -1))
    if len(bad):
        bad[:, 0] |= ~np.isfinite(np.asarray(motion.root)).all(axis=-1)
    nothing = np.full(len(bad), np.nan)
    return tuple(
        finding
        for joint in np.flatnonzero(bad.any(axis=0))
        for finding in _findings("finite", motion.skeleton.names[joint], nothing, nothing, bad[:, joint], motion.fps)
    )


def _findings(
    name: str,
    joint: str,
    values: Float[np.ndarray, " T"],
    high: Float[np.ndarray, " T"],
    outside: Bool[np.ndarray, " T"],
    fps: float,
) -> list[BodyFinding]:
    """A finding for each group of frames outside a bound."""
    frames = np.flatnonzero(outside)
    groups = np.split(frames, np.flatnonzero(np.diff(frames) > max(1.0, _APART * fps)) + 1)
    found = []
    for group in groups:
        worst = int(group[np.argmax(values[group] - high[group])])
        found.append(
            BodyFinding(
                name,
                joint,
                worst,
                worst / fps,
                float(values[worst]),
                float(high[worst]),
                int(group[0]),
                int(group[-1]) + 1,
                len(group),
            )
        )
    return found
