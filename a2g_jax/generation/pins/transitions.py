"""How long the transitions around pinned clips last: as short as speed and jerk of the hands allow."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from a2g_jax.generation.pins.offsets import NEAR, Shape, bridge, decay, offset_vectors, turned
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.metrics.hands import hand_jerk, hand_speeds, local_places

#: Lengths of a transition that are tried, seconds; times in which velocities come to rest.
LENGTHS = (0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.25, 1.6, 2.0)
SETTLE = (0.25, 0.5, 2.0)
#: Share of the limits from which a longer transition is tried: one at the limits is abrupt.
_COMFORT = 0.7
#: Weight of all ratios beside the largest.
_OTHERS = 0.3
#: Ratio of costs at which the shorter of two transitions is taken.
_ALIKE = 1.05


class Limits(NamedTuple):
    """Limits on hands and joints in a transition."""

    jerk: float
    """m/s3"""
    speed: float
    """m/s"""
    turn: float
    """Of any joint, degrees per second."""


class Seam(NamedTuple):
    """One end of a pinned clip."""

    edge: int
    """Last frame of the motion that belongs to the clip, on this side."""
    step: int
    """1 for a transition that follows the clip, -1 for one before it."""
    room: int
    """Frames that the transition may take, up to a neighbour or an end of the motion."""
    free: bool
    """Whether an end of the motion, not another clip, bounds the room."""


@dataclass(frozen=True, eq=False)
class Transition:
    """Offsets of rotations and of the root in the frames beyond a clip's end."""

    seam: Seam
    shape: Shape
    rotations: Float[np.ndarray, "n J 3"]
    root: Float[np.ndarray, "n 3"]

    @property
    def frames(self) -> np.ndarray:
        """Frames of the motion that it changes, outwards."""
        return self.seam.edge + self.seam.step * np.arange(1, len(self.root) + 1)


def plan(
    plain: Motion, clip: Motion, first: int, seam: Seam, limits: Limits, length: float | None = None, least: float = 0.0
) -> Transition:
    """The shortest transition well within the limits, or else the one that comes nearest.

    Towards an end of the motion that is too near, the offset stays: the motion begins or ends beside where it would.

    Args:
        plain: the motion without the clip.
        clip: the clip where it stands in the motion; its root is that of the result.
        first: first frame of the clip.
        length: seconds; None to choose.
        least: shortest length to choose.
    """
    tried: list[tuple[float, Transition]] = []
    for found in _candidates(plain, clip, first, seam, length, least):
        ratios = _ratios(plain, clip, first, found, limits)
        if max(ratios) <= _COMFORT:
            return found
        # The others count too: a clip that shakes at its end has the same largest ratio in every transition.
        tried.append((max(ratios) + _OTHERS * sum(ratios), found))
    lowest = min(cost for cost, _ in tried)
    return next(found for cost, found in tried if cost <= _ALIKE * lowest)


def _candidates(
    plain: Motion, clip: Motion, first: int, seam: Seam, length: float | None, least: float
) -> Iterator[Transition]:
    """Transitions, the most faithful first: onto the moving motion, straight to where it is later, with less exact
    velocities."""
    inside = seam.edge - seam.step * np.arange(min(NEAR, clip.frames))
    rotations, root = (np.asarray(values, np.float64) for values in (plain.rotations, plain.root))
    turns, places = np.asarray(clip.rotations, np.float64)[inside - first], np.asarray(clip.root)[inside - first]
    near, root_near = offset_vectors(turns, rotations[inside]), places - root[inside]
    shapes = list(_shapes(seam, plain.fps, length, least))
    for order in (2, 1, 0):
        for one in shapes:
            shape = replace(one, order=order)
            yield Transition(seam, shape, decay(near, shape), decay(root_near, shape))
        for count in dict.fromkeys(shape.frames for shape in shapes if shape.frames > 1 and not shape.held):
            end = seam.edge + seam.step * count
            beyond = end + seam.step * np.arange(NEAR)
            beyond = beyond[(beyond >= 0) & (beyond < plain.frames)]
            target = np.broadcast_to(rotations[end], (NEAR, *rotations[end].shape))
            path = bridge(
                offset_vectors(turns, target[: len(turns)]),
                offset_vectors(rotations[beyond], target[: len(beyond)]),
                count,
                order,
            )
            frames = seam.edge + seam.step * np.arange(1, count + 1)
            there = turned(np.broadcast_to(rotations[end], (*path.shape[:2], 3, 3)), path)
            along = root[end] + bridge(places - root[end], root[beyond] - root[end], count, order)
            yield Transition(
                seam, Shape(count, count, order=order), offset_vectors(there, rotations[frames]), along - root[frames]
            )


def _shapes(seam: Seam, fps: float, length: float | None, least: float) -> Iterator[Shape]:
    if seam.room == 0:
        yield Shape(0, 0)
        return
    seconds = tuple(value for value in LENGTHS if value >= least) if length is None else (length,)
    frames = sorted({min(max(1, round(value * fps)), seam.room) for value in seconds})
    for count in frames:
        for settle in sorted({min(max(1, round(value * fps)), count) for value in SETTLE}):
            yield Shape(count, settle)
    if seam.free and seam.room < round(max(seconds) * fps):
        for value in SETTLE:
            yield Shape(seam.room, max(1, round(value * fps)), held=True)


def _ratios(plain: Motion, clip: Motion, first: int, found: Transition, limits: Limits) -> list[float]:
    """Jerk and speed of the hands and turns of joints over their limits, in the transition and the frames around it."""
    seam = found.seam
    reach = seam.edge + seam.step * (len(found.root) + NEAR)
    low, high = sorted((seam.edge - seam.step * (NEAR - 1), reach))
    low, high = max(low, 0), min(high + 1, plain.frames)
    rotations = np.asarray(plain.rotations, np.float64)[low:high].copy()
    rows = found.frames - low
    rotations[rows] = turned(rotations[rows], found.rotations)
    for frame in range(max(low, first), min(high, first + clip.frames)):
        rotations[frame - low] = clip.rotations[frame - first]
    part = replace(plain, rotations=rotations.astype(np.float32), root=np.zeros((high - low, 3), np.float32))
    places = local_places(part)
    return [
        float(hand_jerk(places, part.skeleton, part.fps).max(initial=0.0)) / limits.jerk,
        float(hand_speeds(places, part.skeleton, part.fps).max(initial=0.0)) / limits.speed,
        float(rotation_angle(rotations[1:], rotations[:-1]).max(initial=0.0)) * part.fps / limits.turn,
    ]
