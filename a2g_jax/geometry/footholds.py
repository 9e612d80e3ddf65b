"""Standing feet that stay where they are: the legs of a motion reach for fixed footholds.

Rotations of a generated motion are a little wrong in every joint between two feet, so that both cannot stand still
whatever the root does. A foot stands between two steps, and its foothold is its mean place and orientation meanwhile.
Hips and knees reach it by two-bone inverse kinematics, and the ankle keeps the foot's orientation; at a step the foot
moves over to its own path within a fifth of a second.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation, gaussian_filter1d, minimum_filter1d
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import world_rotations
from a2g_jax.geometry.skeleton import BODY_JOINTS

#: A foot steps while it moves faster than this along the floor, m/s, or is higher than this above its lowest, metres.
_STEP_SPEED, _STEP_HEIGHT = 0.4, 0.05
#: Width of the Gaussian for that speed, of that for the change between foothold and step, and of that for the height of
#: the pelvis, seconds. The second is cut off at three widths.
_SMOOTHING, _CHANGE, _LOWERING = 0.05, 0.07, 0.2
#: Longest reach of a leg, in lengths of the stretched leg: the knee's angle jumps at 1.
_REACH = 0.999
#: Iterations of the knee's angle; the first is exact for a knee that bends in one plane.
_ITERATIONS = 4


#: Metres by which hips are lowered at most.
_LOWEST = 0.05


class Leg(NamedTuple):
    """Joints of a leg."""

    hip: int
    knee: int
    ankle: int
    toe: int


#: Where an ankle goes and how it is turned.
Goal = tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3 3"]]


def lock_feet(motion: Motion) -> Motion:
    """The motion with standing feet fixed to footholds; unchanged on skeletons without legs of hip, knee and ankle.

    The root is lowered where a leg would be too short for its foothold.
    """
    legs = find_legs(motion)
    if not legs or motion.frames < 2:
        return motion
    places, world = motion.positions().astype(np.float64), _leg_orientations(motion, legs)
    goals = {leg: _goal(places[:, leg.ankle], world[:, leg.ankle], motion.fps) for leg in legs}
    return _reach_goals(motion, places, world, goals, None)


def reach_goals(motion: Motion, goals: Mapping[Leg, Goal], lowering: Float[np.ndarray, " T"] | None = None) -> Motion:
    """The motion with ankles at their goals, by hips and knees; the root is lowered where a leg would be too short.

    Args:
        goals: for each leg, where its ankle goes and how it is turned in the world.
        lowering: share of that lowering in each frame; 1 by default.
    """
    return _reach_goals(
        motion, motion.positions().astype(np.float64), _leg_orientations(motion, goals), goals, lowering
    )


def _leg_orientations(motion: Motion, legs: Iterable[Leg]) -> Float[np.ndarray, "T J 3 3"]:
    """World orientations of the joints of legs and of all above them; NaN for the other joints."""
    joints = [joint for leg in legs for joint in (leg.hip, leg.knee, leg.ankle)]
    return world_rotations(np.asarray(motion.rotations, np.float64), motion.skeleton.parents, joints)


def _reach_goals(
    motion: Motion,
    places: Float[np.ndarray, "T J 3"],
    world: Float[np.ndarray, "T J 3 3"],
    goals: Mapping[Leg, Goal],
    lowering: Float[np.ndarray, " T"] | None,
) -> Motion:
    lower = np.zeros(motion.frames)
    for leg, (target, _) in goals.items():
        lower = np.maximum(lower, _too_far(places[:, leg.hip], target, _REACH * _length(motion, leg)))
    lower = _smooth_above(lower, motion.fps)
    if lowering is not None:
        lower = lower * lowering
    return bend_legs(motion, places, world, goals, lower)


def too_far(
    motion: Motion, leg: Leg, hip: Float[np.ndarray, "T 3"], target: Float[np.ndarray, "T 3"]
) -> Float[np.ndarray, " T"]:
    """Metres by which a hip has to be lower for the leg to reach its target; 0 where it does, 5 cm at most."""
    return _too_far(hip, target, _REACH * _length(motion, leg))


def knee_axis(motion: Motion, leg: Leg) -> Float[np.ndarray, "3"]:
    """Axis about which the knee of a leg bends in a motion, in the frame of the hip joint."""
    world = _leg_orientations(motion, [leg])
    offsets = np.asarray(motion.skeleton.offsets, np.float64)
    thigh, shin = world[:, leg.hip] @ offsets[leg.knee], world[:, leg.knee] @ offsets[leg.ankle]
    return _bend_axis(motion, world, leg, thigh, shin)


def bend_legs(
    motion: Motion,
    places: Float[np.ndarray, "T J 3"],
    world: Float[np.ndarray, "T J 3 3"],
    goals: Mapping[Leg, Goal],
    lower: Float[np.ndarray, " T"],
    axes: Mapping[Leg, Float[np.ndarray, "3"]] | None = None,
) -> Motion:
    """The motion with its root lowered and ankles at their goals.

    Args:
        places: of the joints of the motion.
        world: their orientations.
        lower: metres.
        axes: of knees, see :func:`knee_axis`; by default those of this motion.
    """
    rotations = np.asarray(motion.rotations, np.float64).copy()
    for leg, (target, orientation) in goals.items():
        hip = places[:, leg.hip].copy()
        hip[:, 1] -= lower
        _reach(motion, rotations, world, leg, hip, target, orientation, None if axes is None else axes[leg])
    root = np.asarray(motion.root, np.float64).copy()
    root[:, 1] -= lower
    return replace(motion, rotations=rotations.astype(np.float32), root=root.astype(np.float32))


def find_legs(motion: Motion) -> list[Leg]:
    """Both legs, where hip, knee and ankle follow one another; else none."""
    body = find_body_joints(motion.skeleton)
    if body is None:
        return []
    parents = motion.skeleton.parents
    legs = [
        Leg(*(body[BODY_JOINTS.index(f"{side}_{part}")] for part in ("Hip", "Knee", "Ankle", "Foot"))) for side in "LR"
    ]
    chained = all(parents[leg.ankle] == leg.knee and parents[leg.knee] == leg.hip for leg in legs)
    return legs if chained and all(_length(motion, leg) > 0.0 for leg in legs) else []


def _bones(motion: Motion, leg: Leg) -> tuple[float, float]:
    offsets = np.asarray(motion.skeleton.offsets, np.float64)
    return float(np.linalg.norm(offsets[leg.knee])), float(np.linalg.norm(offsets[leg.ankle]))


def _length(motion: Motion, leg: Leg) -> float:
    return sum(_bones(motion, leg))


def _goal(
    place: Float[np.ndarray, "T 3"], world: Float[np.ndarray, "T 3 3"], fps: float
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3 3"]]:
    """Where an ankle goes and how it is turned: its foothold while the foot stands, its own path in a step."""
    stands = ~steps(place, fps)
    target, turned, own = place.copy(), np.zeros_like(place), Rotation.from_matrix(world)
    back = own.inv()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stands, [False]]).astype(int)))
    for first, stop in edges.reshape(-1, 2):
        # Each foothold has a weight of its own, so that a short step passes from one to the next without a jump. They
        # sum to 1 or less: between two stands lies more than twice the reach of a weight.
        only = np.zeros(len(place), bool)
        only[first:stop] = True
        share = _weights(only, fps)[:, None]
        foothold, turn = place[first:stop].mean(axis=0), own[first:stop].mean()
        target += share * (foothold - place)
        turned += share * (turn * back).as_rotvec()
    return target, (Rotation.from_rotvec(turned) * own).as_matrix()


def steps(place: Float[np.ndarray, "T 3"], fps: float) -> Bool[np.ndarray, " T"]:
    """Frames in which a foot (the path of its ankle) steps, with the time that the change to a foothold takes."""
    speed = np.linalg.norm(np.gradient(gaussian_filter1d(place[:, [0, 2]], _SMOOTHING * fps, axis=0), axis=0), axis=-1)
    moves = (speed * fps > _STEP_SPEED) | (place[:, 1] > np.percentile(place[:, 1], 5) + _STEP_HEIGHT)
    if not moves.any():
        return moves
    reach = _reach_frames(fps)
    return binary_dilation(moves, np.ones(2 * reach + 1, bool))


def _reach_frames(fps: float) -> int:
    return max(1, round(3 * _CHANGE * fps))


def _weights(stands: Bool[np.ndarray, " T"], fps: float) -> Float[np.ndarray, " T"]:
    """Weight of the foothold: exactly 1 while the foot stands, smooth in between."""
    reach = _reach_frames(fps)
    wider = binary_dilation(stands, np.ones(2 * reach + 1, bool))
    smooth = gaussian_filter1d(wider.astype(np.float64), _CHANGE * fps, mode="nearest", radius=reach)
    return np.where(stands, 1.0, smooth)


def _too_far(hip: Float[np.ndarray, "T 3"], target: Float[np.ndarray, "T 3"], reach: float) -> Float[np.ndarray, " T"]:
    """Metres by which a hip has to be lower for the leg to reach its target; 0 where it does, 5 cm at most."""
    across = np.linalg.norm((target - hip)[:, [0, 2]], axis=-1)
    most = np.sqrt(np.maximum(reach**2 - across**2, 0.0))
    # A foot that creeps for seconds has a mean place that no leg reaches; its leg is stretched instead.
    return np.clip(hip[:, 1] - target[:, 1] - most, 0.0, _LOWEST)


def _smooth_above(values: Float[np.ndarray, " T"], fps: float) -> Float[np.ndarray, " T"]:
    """A smooth curve that is nowhere below the values."""
    if not values.any():
        return values
    radius = max(1, round(2 * _LOWERING * fps))
    highest = -minimum_filter1d(-values, 2 * radius + 1, mode="nearest")
    return gaussian_filter1d(highest, _LOWERING * fps, mode="nearest", radius=radius)


def _reach(
    motion: Motion,
    rotations: Float[np.ndarray, "T J 3 3"],
    world: Float[np.ndarray, "T J 3 3"],
    leg: Leg,
    hip: Float[np.ndarray, "T 3"],
    target: Float[np.ndarray, "T 3"],
    orientation: Float[np.ndarray, "T 3 3"],
    bend_axis: Float[np.ndarray, "3"] | None = None,
) -> None:
    """Write the leg's local rotations that put its ankle on the target with that orientation."""
    offsets = np.asarray(motion.skeleton.offsets, np.float64)
    thigh, shin = world[:, leg.hip] @ offsets[leg.knee], world[:, leg.knee] @ offsets[leg.ankle]
    if bend_axis is None:
        bend_axis = _bend_axis(motion, world, leg, thigh, shin)
    axis = np.einsum("tij,j->ti", world[:, leg.hip], bend_axis)
    distance = np.linalg.norm(target - hip, axis=-1)
    upper, lower = _bones(motion, leg)
    distance = np.clip(distance, abs(upper - lower) + 1e-4, _REACH * (upper + lower))
    # A knee that is bent backwards is bent as far forwards first: from there on, flexion has no sign.
    signed = np.arctan2(np.sum(np.cross(thigh, shin) * axis, axis=-1), np.sum(thigh * shin, axis=-1))
    bend = np.where(signed < 0.0, -2.0 * signed, 0.0)
    bent = Rotation.from_rotvec(bend[:, None] * axis).apply(shin)
    for _ in range(_ITERATIONS):
        # The knee's flexion that gives this distance, by the law of cosines, less that of the shin as it is.
        now = np.linalg.norm(thigh + bent, axis=-1)
        bend += _flexion(distance, upper, lower) - _flexion(now, upper, lower)
        bent = Rotation.from_rotvec(bend[:, None] * axis).apply(shin)
    turn = _shortest(thigh + bent, target - hip)
    above = world[:, leg.hip] @ np.swapaxes(rotations[:, leg.hip], -1, -2)
    new_hip = turn @ world[:, leg.hip]
    new_knee = turn @ Rotation.from_rotvec(bend[:, None] * axis).as_matrix() @ world[:, leg.knee]
    rotations[:, leg.hip] = np.swapaxes(above, -1, -2) @ new_hip
    rotations[:, leg.knee] = np.swapaxes(new_hip, -1, -2) @ new_knee
    rotations[:, leg.ankle] = np.swapaxes(new_knee, -1, -2) @ orientation


def _flexion(distance: Float[np.ndarray, " T"], upper: float, lower: float) -> Float[np.ndarray, " T"]:
    """Angle of a knee, 0 when stretched, for a distance from hip to ankle."""
    return np.arccos(np.clip((distance**2 - upper**2 - lower**2) / (2 * upper * lower), -1.0, 1.0))


def _bend_axis(
    motion: Motion,
    world: Float[np.ndarray, "T J 3 3"],
    leg: Leg,
    thigh: Float[np.ndarray, "T 3"],
    shin: Float[np.ndarray, "T 3"],
) -> Float[np.ndarray, "3"]:
    """Axis about which the knee bends, in the frame of the hip joint: a knee that is nearly stretched has none of its
    own, so it is that of the whole motion, or across the foot for a leg that never bends. Frames in which the knee is
    bent backwards, as those of some recordings are, do not count: it would be bent further that way."""
    toe = world[:, leg.ankle] @ np.asarray(motion.skeleton.offsets, np.float64)[leg.toe]
    across = np.cross(toe, thigh)
    cross = np.cross(thigh, shin)
    forwards = np.sum(across * cross, axis=-1, keepdims=True) >= 0.0
    local = np.einsum("tji,tj->ti", world[:, leg.hip], np.where(forwards, cross, 0.0)).mean(axis=0)
    if np.linalg.norm(local) < 1e-3 * np.prod(_bones(motion, leg)):
        local = world[0, leg.hip].T @ across[0]
    length = np.linalg.norm(local)
    return local / length if length > 0 else np.array([1.0, 0.0, 0.0])


def _shortest(start: Float[np.ndarray, "T 3"], end: Float[np.ndarray, "T 3"]) -> Float[np.ndarray, "T 3 3"]:
    """The shortest rotations from one direction to another."""
    a, b = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (start, end))
    cross = np.cross(a, b)
    sine, cosine = np.linalg.norm(cross, axis=-1), np.sum(a * b, axis=-1)
    angle = np.arctan2(sine, cosine)
    return Rotation.from_rotvec(cross * (angle / np.maximum(sine, 1e-12))[:, None]).as_matrix()
