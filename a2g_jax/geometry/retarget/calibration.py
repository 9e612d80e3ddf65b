"""Calibration poses at the start of a take: a T- or A-pose that is no part of the performance."""

import numpy as np
from jaxtyping import Bool, Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.parts import find_parts
from a2g_jax.geometry.retarget.poses import angle_between, joint_places, rotation_angle, unit, world_rotations
from a2g_jax.geometry.retarget.rest import Roles, oddness, trunk_axis

#: Longest calibration that is looked for, seconds; shortest take, in frames.
_LONGEST, _FEWEST = 5.0, 8
#: A cut turns a joint by more than the first number of degrees, and more than the second times the steps around it.
_CUT_DEGREES, _CUT_ISOLATION = 20.0, 4.0
#: Degrees from upright with straight limbs of a pose before a cut.
_STRAIGHT = 30.0
#: Degrees of arms that are spread to the sides, as in a T- or an A-pose: over the horizontal, below it, to the front or
#: back, of elbows, and between the two sides.
_ABOVE, _BELOW, _FRONT, _BENT, _UNLIKE = 20.0, 55.0, 20.0, 15.0, 12.0


def calibration_frames(motion: Motion) -> int:
    """Number of frames at the start that show a calibration pose; 0 if the take starts at once.

    Either a person stands with straight limbs, as in a T-, A- or I-pose, and then jumps into the performance; or
    straight arms are spread to both sides and then lowered, which counts as calibration, too.
    """
    if motion.frames < _FEWEST:
        return 0
    try:
        roles = find_parts(motion.skeleton, "the take", {})[0]
    except InputError:
        return 0
    some = min(motion.frames, int(_LONGEST * motion.fps) + 6)
    rotations = np.asarray(motion.rotations[:some], np.float64)
    count = _before_cut(motion, rotations, roles) or _spread_arms(motion, rotations, roles)
    return count if count < motion.frames - 1 else 0


def _before_cut(motion: Motion, rotations: Float[np.ndarray, "N J 3 3"], roles: Roles) -> int:
    joints = sorted(set(roles.values()))
    steps = rotation_angle(rotations[1:, joints], rotations[:-1, joints]).max(axis=1)
    for cut in np.flatnonzero(steps > _CUT_DEGREES).tolist():
        after = steps[cut + 1 : cut + 6]
        around = max(steps[:cut].max(initial=0.0), after.max(initial=0.0))
        if len(after) == 0 or steps[cut] <= _CUT_ISOLATION * around:
            return 0
        poses = _places(motion, rotations[[0, cut]])
        return cut + 1 if float(oddness(poses, roles).max()) <= _STRAIGHT else 0
    return 0


def _spread_arms(motion: Motion, rotations: Float[np.ndarray, "N J 3 3"], roles: Roles) -> int:
    """Frames until the arms of a T- or A-pose are lowered."""
    first = _places(motion, rotations[:1])
    if not _are_spread(first, roles)[0][0] or float(oddness(first, roles)[0]) > _STRAIGHT:
        return 0
    spread, height = _are_spread(_places(motion, rotations), roles)
    if spread.all():
        return 0
    frame = int(np.argmin(spread))
    while frame + 1 < len(height) and height[frame + 1] < height[frame] - 0.1 / motion.fps:
        frame += 1
    return frame


def _are_spread(
    places: Float[np.ndarray, "N J 3"], roles: Roles
) -> tuple[Bool[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Whether both arms are straight and spread to the sides, and the sine of their angle over the horizontal."""
    up = trunk_axis(places, roles)
    across = unit(places[:, roles["L_Shoulder"]] - places[:, roles["R_Shoulder"]])
    spread, heights = np.ones(len(places), bool), []
    for side, out in (("L", across), ("R", -across)):
        shoulder, elbow, wrist = (places[:, roles[f"{side}_{part}"]] for part in ("Shoulder", "Elbow", "Wrist"))
        upper, lower = unit(elbow - shoulder), unit(wrist - elbow)
        heights.append(np.degrees(np.arcsin(np.clip(np.sum(upper * up, axis=-1), -1, 1))))
        front = np.abs(np.sum(upper * unit(np.cross(across, up)), axis=-1))
        spread &= (heights[-1] > -_BELOW) & (heights[-1] < _ABOVE) & (np.sum(upper * out, axis=-1) > 0)
        spread &= (front < np.sin(np.radians(_FRONT))) & (angle_between(upper, lower) < _BENT)
    return spread & (np.abs(heights[0] - heights[1]) < _UNLIKE), np.sin(np.radians(np.mean(heights, axis=0)))


def _places(motion: Motion, rotations: Float[np.ndarray, "N J 3 3"]) -> Float[np.ndarray, "N J 3"]:
    world = world_rotations(rotations, motion.skeleton.parents)
    return joint_places(world, np.asarray(motion.skeleton.offsets, np.float64), motion.skeleton.parents)
