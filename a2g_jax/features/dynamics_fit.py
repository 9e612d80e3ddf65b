"""Gains that bring generated motion to the dynamics of recorded motion, by quantiles."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from a2g_jax.features.dynamics import (
    EDGES,
    LEAST,
    Dynamics,
    Values,
    band_change,
    envelope,
    speed_change,
    speed_level,
    split,
    with_dynamics,
)
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton

#: Motions of different lengths.
Motions = Sequence[Float[np.ndarray, "_ R D"]]
#: Shares of the frames at which distributions of levels are compared.
SHARES = np.array([0.01, 0.03, 0.06, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99])
#: Largest gain of a band and of what is below all of them, and smallest gain of the speed.
_MOST, _MOST_SLOW, _LEAST_SPEED = np.log(4.0), np.log(2.0), -np.log(10.0)
#: Steps of the fit, and the share of what is missing that each adds: bands overlap, and each row moves others.
_STEPS, _PACE = 3, 0.8
#: Steps of the fit of jerk, the first of the bands that it changes, and what is added to jerk before its logarithm,
#: m/s3.
_JERK_STEPS, _FAST, _LEAST_JERK = 3, 3, 1.0
#: Gains are half as strong, as logarithms, for so many seconds of recorded motion.
_SECONDS = 2.0
#: Least standard deviation of a value.
_STEADY = 0.01
#: Motions are filled up to multiples of so many frames where programs are compiled for their length.
_PADDED = 512


class Moved(NamedTuple):
    """What the rows of a pose move."""

    points: Float[np.ndarray, "R P"]
    """Mean over the points that each row moves; a row of zeros for one that moves none."""
    lever: Float[np.ndarray, " R"]
    """Distance of the farthest of them, metres; 1 where poses are no rotations."""
    positions: Callable[[Values], Float[np.ndarray, "T P _"]]
    """Positions of all points."""


def moved_by(space: PoseSpace) -> Moved:
    """What the values of :func:`~a2g_jax.features.dynamics.values_of` move: rotations the joints below them, others
    themselves."""
    if not space.has_rotations:
        return Moved(np.eye(space.rows), np.ones(space.rows), np.asarray)
    skeleton: Skeleton = space.skeleton
    below = np.zeros((skeleton.joints, skeleton.joints))
    places = np.array(skeleton.offsets, np.float64)
    for joint, parent in enumerate(skeleton.parents):
        places[joint] = 0.0 if parent < 0 else places[joint] + places[parent]
        while parent >= 0:
            below[parent, joint] = 1.0
            parent = skeleton.parents[parent]
    far = np.linalg.norm(places[None] - places[:, None], axis=-1)
    points = below / np.maximum(below.sum(axis=1, keepdims=True), 1.0)
    return Moved(points, np.max(far * below, axis=1), partial(_joints, PoseSpace(skeleton, "6d")))


def _joints(space: PoseSpace, values: Values) -> Float[np.ndarray, "T J 3"]:
    """Positions of joints; few lengths are compiled."""
    filled = np.pad(values, ((0, -len(values) % _PADDED), (0, 0), (0, 0)), mode="edge")
    return space.positions(np.asarray(filled, np.float32))[: len(values)]


def fit_dynamics(
    drawn: Motions, recorded: Motions, moved: Moved, fps: float, recorded_fps: float | None = None
) -> Dynamics:
    """Gains with which generated motion has the quantiles of the recorded motion's levels.

    Gains of a row follow the points that it moves, those of a hand the gains of shoulder and elbow: joints of
    generated and recorded motion share the work differently.

    Args:
        drawn: generated motions, 6D rotations or other values, of the speech of the recorded ones.
        recorded: motions of the person.
        recorded_fps: rate of the recordings before they were brought to ``fps``; None if unknown. Motions are compared
            at that rate, as what is interpolated between its frames is no motion of the person.
    """
    step, known = recorded_step(fps, recorded_fps)
    rate = fps / step
    mean, target = (np.concatenate(motions).mean(axis=0) for motions in (drawn, recorded))
    std = np.maximum(np.concatenate(recorded).std(axis=0), _STEADY)
    weight = std.mean(axis=-1) * moved.lever
    ours, theirs = ([(one - middle) / std for one in part] for part, middle in ((drawn, mean), (recorded, target)))
    slow = np.log(_spread(theirs, fps) / _spread(ours, fps))
    levels = _band_levels([np.mean(np.square(bands), axis=-1) for bands in _bands(ours, fps)], fps)
    wanted = _point_levels([one[::step] for one in recorded], moved, rate)
    wanted_speed = _quantiles([speed_level(one[::step], weight, rate)[:, None] for one in theirs])[0]
    moving = np.any(moved.points != 0.0, axis=1, keepdims=True)
    found = Dynamics(
        mean=mean,
        shift=target - mean,
        std=std,
        weight=weight,
        slow=np.clip(slow, -_MOST_SLOW, _MOST_SLOW),
        levels=levels,
        gains=np.zeros_like(levels),
        speed_levels=wanted_speed,
        speed_gains=np.zeros(len(SHARES)),
    )
    for turn in range(_STEPS):
        found = _with_speeds(found, ours, wanted_speed, fps, step, 2 if turn == 0 else 1)
        missing = wanted - _point_levels([with_dynamics(one, found, fps)[::step] for one in drawn], moved, rate)
        gains = np.clip(found.gains + _PACE * np.where(moving, missing, 0.0), -_MOST, _MOST)
        if step > 1:
            # The highest band is above what that rate can hold, and appears in the one below.
            gains[-1] = gains[-2]
        elif not known:
            # Recordings at a lower rate hold interpolation in the highest band, which is no motion of the person.
            gains[-1] = np.minimum(gains[-1], gains[-2])
        found = replace(found, gains=_monotone(levels, gains))
    seconds = sum(len(one) for one in recorded) / fps
    trust = seconds / (seconds + _SECONDS)
    if known:
        found = _with_jerk(found, drawn, recorded, moved, fps, step)
    found = replace(found, slow=trust * found.slow, gains=trust * found.gains, speed_gains=trust * found.speed_gains)
    found = replace(found, speed_levels=_speeds(found, ours, fps))
    return Dynamics.of(found.arrays())  # as precise as a stored run


def _with_jerk(found: Dynamics, drawn: Motions, recorded: Motions, moved: Moved, fps: float, step: int) -> Dynamics:
    """With gains of the fastest bands that also match the jerk of the points that each row moves.

    Bands have the person's amplitudes before that, but within a band generated motion is faster. Interpolation between
    recorded frames has a kink at each, so that this needs the rate of the recordings.
    """
    wanted = _jerk_levels([one[::step] for one in recorded], moved, fps / step)
    moving = np.any(moved.points != 0.0, axis=1, keepdims=True)
    for _ in range(_JERK_STEPS):
        own = _jerk_levels([with_dynamics(one, found, fps)[::step] for one in drawn], moved, fps / step)
        gains = found.gains.copy()
        gains[_FAST:] += _PACE * np.where(moving, wanted - own, 0.0)
        found = replace(found, gains=_monotone(found.levels, np.clip(gains, -_MOST, _MOST)))
    return found


def _jerk_levels(motions: Motions, moved: Moved, fps: float) -> Float[np.ndarray, "R shares"]:
    """Quantiles of the logarithm of the jerk of the points that each row moves."""
    powers = [
        np.sum(np.square(np.diff(np.asarray(moved.positions(one)), n=3, axis=0) * fps**3), axis=-1) @ moved.points.T
        for one in motions
        if len(one) > 3
    ]
    return np.asarray(_quantiles([0.5 * np.log(power + _LEAST_JERK**2) for power in powers]))


def recorded_step(fps: float, recorded_fps: float | None) -> tuple[int, bool]:
    """Frames from one recorded frame to the next, and whether the rate of the recordings is known and fits: a multiple
    of theirs, or below it."""
    if recorded_fps is None:
        return 1, False
    step = max(1, round(fps / recorded_fps))
    return (step, True) if recorded_fps >= fps or abs(fps / recorded_fps - step) < 0.01 else (1, False)


def _with_speeds(found: Dynamics, ours: Motions, wanted: np.ndarray, fps: float, step: int, turns: int) -> Dynamics:
    """With gains of the speed that only slow."""
    found = replace(found, speed_levels=_speeds(found, ours, fps))
    banded = [one + band_change(one, found, fps) for one in ours]
    for _ in range(turns):
        slowed = [(one + speed_change(one, found, fps))[::step] for one in banded]
        after = [speed_level(one, found.weight, fps / step)[:, None] for one in slowed]
        gains = found.speed_gains + _PACE * (wanted - _quantiles(after)[0])
        found = replace(found, speed_gains=_monotone(found.speed_levels, np.clip(gains, _LEAST_SPEED, 0.0)))
    return found


def _speeds(found: Dynamics, ours: Motions, fps: float) -> np.ndarray:
    """Quantiles of the body's speed with the gains of the bands."""
    return _quantiles([speed_level(one + band_change(one, found, fps), found.weight, fps)[:, None] for one in ours])[0]


def _point_levels(motions: Motions, moved: Moved, fps: float) -> Float[np.ndarray, "bands R shares"]:
    """Quantiles of the envelopes of the points that each row moves."""
    places = [np.asarray(moved.positions(one)) for one in motions]
    return _band_levels([np.sum(np.square(bands), axis=-1) @ moved.points.T for bands in _bands(places, fps)], fps)


def _bands(motions: Sequence[np.ndarray], fps: float) -> list[np.ndarray]:
    """All bands of each motion, (bands, T, ...)."""
    return [np.stack(split(one, fps)[1]) for one in motions]


def _band_levels(powers: Sequence[Float[np.ndarray, "bands _ R"]], fps: float) -> Float[np.ndarray, "bands R shares"]:
    """Quantiles of the envelopes of motions, from the power of their bands."""
    return np.stack(
        [_quantiles([envelope(power[number], number, fps) for power in powers]) for number in range(len(EDGES))]
    )


def _quantiles(parts: Sequence[Float[np.ndarray, "_ N"]]) -> Float[np.ndarray, "N shares"]:
    return np.asarray(np.quantile(np.concatenate(parts), SHARES, axis=0).T)


def _spread(motions: Motions, fps: float) -> Float[np.ndarray, " R"]:
    """Standard deviation of the slow part within motions."""
    slow = [split(one, fps)[0] for one in motions]
    return np.sqrt(np.mean([one.var(axis=0).mean(axis=-1) for one in slow], axis=0)) + LEAST


def _monotone(levels: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """Gains with which a stronger movement stays the stronger one."""
    return np.asarray(np.maximum.accumulate(levels + gains, axis=-1) - levels)
