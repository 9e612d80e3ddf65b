"""Turns faster than a body can make, such as flips of tracked or generated hands, bridged by smooth ones."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle

#: Fastest turn of a limb that gestures, degrees/s; see :mod:`a2g_jax.metrics.body.bounds`.
FASTEST = 1800.0
#: Degrees from the mean pose from which a joint beside a turn is not where a body can have it.
FAR = 150.0
#: Seconds between fast turns that are bridged together, and by which a bridge reaches beyond them at most.
_APART, _REACH = 0.25, 0.5
#: Share of the fastest turn that a bridge may have, and that it may begin and end with.
_CALM, _BORDER = 0.9, 0.4


def bridge_turns(motion: Motion, fastest: float = FASTEST) -> tuple[Motion, Mapping[str, int]]:
    """The motion without turns of joints above ``fastest``, and by joint the number of frames that changed.

    A motion without such turns is returned as it is.

    Args:
        fastest: degrees/s.
    """
    rotations = np.asarray(motion.rotations)
    if motion.frames < 2:
        return motion, {}
    fast = _steps(rotations) * motion.fps > fastest
    joints = [int(joint) for joint in np.flatnonzero(fast.any(axis=0))]
    changed: dict[str, int] = {}
    found = rotations.copy()
    for joint in joints:
        own = rotations[:, joint].astype(np.float64)
        other = bridged(own, Rotation.from_matrix(own).mean().as_matrix(), fastest, FAR, motion.fps)
        frames = np.any(other != own, axis=(1, 2))
        if frames.any():
            found[frames, joint] = other[frames]
            changed[motion.skeleton.names[joint]] = int(frames.sum())
    return (replace(motion, rotations=found) if changed else motion), changed


def bridged(
    rotations: Float[np.ndarray, "T 3 3"],
    mean: Float[np.ndarray, "3 3"],
    fastest: float,
    far: float,
    fps: float,
    fixed: Bool[np.ndarray, " T"] | None = None,
    near: Bool[np.ndarray, " T"] | None = None,
) -> Float[np.ndarray, "T 3 3"]:
    """Rotations of one joint whose turns above ``fastest`` are replaced by a path between the frames around them.

    The path is a cubic spline of rotation vectors relative to the mean pose, so that it comes no further from that pose
    than its ends. It is widened, up to half a second on either side, until it turns more slowly than ``fastest``.

    Args:
        mean: the joint's mean pose.
        fastest: degrees/s.
        far: degrees from the mean pose: frames beyond it that adjoin a turn are replaced, too.
        fixed: frames that must stay; a turn at one of them does.
        near: frames at which turns are replaced; all if None.
    """
    found = np.array(rotations, np.float64)
    fast = _steps(found) * fps > fastest
    if near is not None:
        fast &= near[1:]
    if not fast.any():
        return found
    middle = Rotation.from_matrix(mean)
    stays = np.zeros(len(found), bool) if fixed is None else fixed
    away = np.degrees((middle.inv() * Rotation.from_matrix(found)).magnitude()) > far
    reach = round(_REACH * fps)
    for first, last in _groups(fast, max(1, round(_APART * fps))):
        first, last = _past(away, first, -1), _past(away, last, 1)
        best, slowest = found, np.inf
        for wider in range(reach + 1):
            left, right = first - wider, last + wider
            if stays[max(left + 1, 0) : max(right, 0)].any():
                break
            tried = _path(found, middle, left, right, fastest / fps)
            around = slice(max(left - 1, 0), right + 2)
            speed = float(_steps(tried[around]).max(initial=0.0)) * fps
            if speed < slowest:
                best, slowest = tried, speed
            if speed <= _CALM * fastest or (left < 0 and right >= len(found)):
                break
        found = best
    return found


def _path(
    rotations: Float[np.ndarray, "T 3 3"], middle: Rotation, left: int, right: int, fastest: float
) -> Float[np.ndarray, "T 3 3"]:
    """Rotations with a spline between the frames ``left`` and ``right``; held where one of them does not exist.

    Args:
        fastest: degrees a frame.
    """
    found, count = rotations.copy(), len(rotations)
    if left < 0 and right >= count:
        return found
    if left < 0 or right >= count:
        rows = slice(0, right) if left < 0 else slice(left + 1, count)
        found[rows] = rotations[right if left < 0 else left]
        return found
    places = [(middle.inv() * Rotation.from_matrix(rotations[at])).as_rotvec() for at in (left, right)]
    speeds = []
    for at, place, sign in ((left, places[0], -1), (right, places[1], 1)):
        beside = (middle.inv() * Rotation.from_matrix(rotations[min(max(at + sign, 0), count - 1)])).as_rotvec()
        speed = sign * (beside - place)
        speeds.append(speed * min(1.0, np.radians(_BORDER * fastest) / max(float(np.linalg.norm(speed)), 1e-9)))
    spline = CubicHermiteSpline([left, right], places, speeds)
    found[left + 1 : right] = (middle * Rotation.from_rotvec(spline(np.arange(left + 1, right)))).as_matrix()
    return found


def _steps(rotations: Float[np.ndarray, "T *joints 3 3"]) -> Float[np.ndarray, "t *joints"]:
    """Degrees between consecutive frames."""
    return rotation_angle(rotations[1:], rotations[:-1])


def _groups(fast: Bool[np.ndarray, " t"], apart: int) -> list[tuple[int, int]]:
    """The frame before and the frame after each group of fast steps."""
    steps = np.flatnonzero(fast)
    groups = np.split(steps, np.flatnonzero(np.diff(steps) > apart) + 1)
    return [(int(group[0]), int(group[-1]) + 1) for group in groups]


def _past(away: Bool[np.ndarray, " T"], frame: int, step: int) -> int:
    """The nearest frame from ``frame`` on in a direction that is not far away; one outside of the motion if all are."""
    while 0 <= frame < len(away) and away[frame]:
        frame += step
    return frame
