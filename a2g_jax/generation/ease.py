"""Joints that are bent or turned too far, eased back within the bounds of a body.

Angles near a bound are compressed smoothly: those further than a few degrees inside it stay as they are, and none
passes it. The correction is whole in the frames of a finding, fades to zero before and after them, and is zero from
the border of a stretch on that has to stay. Turns that are too fast are bridged by slower ones
(:mod:`a2g_jax.geometry.turns`), and arms whose wrists are too fast are smoothed in time. A motion without findings is
not touched.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt, gaussian_filter1d
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.turns import bridged
from a2g_jax.metrics.body.bounds import BodyBounds
from a2g_jax.metrics.body.check import BodyFinding, Stretch

#: Degrees inside a bound from which angles are compressed, and the degrees inside that none passes.
_BEGIN, _END = 17.0, 2.0
#: Seconds around a finding over which the correction is whole, and over which it then fades; before and after a stretch
#: that stays, it rises from zero within the latter.
_WHOLE, _FADE = 0.25, 0.5
#: Body joints that are eased; legs are not, since feet that stand would move.
_ARM = ("Collar", "Shoulder", "Elbow", "Wrist")
#: What is done about each figure, in the order of these names.
_FIGURES = {"bend": "bend", "backwards": "bend", "range": "range", "turn": "turn"}
_FIGURES |= dict.fromkeys(("wrist_speed", "wrist_jerk"), "wrist")
#: Joints that are smoothed where a wrist is too fast, the standard deviations of the smoothing in seconds, of which the
#: first that suffices is used, and the share of the bounds that suffices.
_CHAIN, _SMOOTHING, _CALM = ("Collar", "Shoulder", "Elbow"), (0.03, 0.05, 0.08, 0.12, 0.2), 0.97
_EASED = {"Spine1", "Spine2", "Spine3", "Neck", "Head", *(f"{side}_{part}" for side in "LR" for part in _ARM)}


def ease(
    motion: Motion, findings: Iterable[BodyFinding], bounds: BodyBounds, stretches: Iterable[Stretch] = ()
) -> Motion:
    """The motion with joints eased back for the findings on ``bend``, ``backwards``, ``range``, ``turn`` and wrists.

    Args:
        findings: on the motion. Those on legs and on other figures remain, since they need another motion; so do frames
            too near a stretch for the correction to rise in between.
        stretches: frames that stay as they are, where they are fixed.
    """
    reference = bounds.reference
    roles = {reference.skeleton.names[joint]: role for role, joint in reference.joints.items()}
    fixed = np.zeros(motion.frames, bool)
    for stretch in stretches:
        if not stretch.fixed:
            continue
        fixed[max(stretch.first, 0) : max(stretch.stop, 0)] = True
    found: dict[tuple[str, str], Bool[np.ndarray, " T"]] = {}
    for one in findings:
        role, figure = roles.get(one.joint), _FIGURES.get(one.figure)
        if role in _EASED and figure is not None:
            found.setdefault((figure, role), np.zeros(motion.frames, bool))[one.first : one.stop] = True
            if figure == "range":
                # Joints that are turned too far may be eased back to either side, with a jump between the two.
                found.setdefault(("turn", role), np.zeros(motion.frames, bool))[one.first : one.stop] = True
    rotations = np.asarray(motion.rotations, np.float64).copy()
    for (figure, role), outside in sorted(found.items(), key=lambda item: item[0]):
        if figure == "wrist":
            rotations = _calmer(replace(motion, rotations=rotations), role, bounds, outside & ~fixed, fixed)
            continue
        if figure == "turn":
            joint = reference.joints[role]
            limits = bounds.high["turn"][joint], bounds.high["range"][joint]
            near = _weight(outside, np.zeros_like(fixed), motion.fps) > 0.0
            rotations[:, joint] = bridged(rotations[:, joint], reference.pose[joint], *limits, motion.fps, fixed, near)
            continue
        weight = _weight(outside & ~fixed, fixed, motion.fps)
        rows = weight > 0.0
        joint = reference.joints[role]
        if figure == "bend":
            eased = _within_flexion(np.asarray(motion.rotations), role, bounds, weight)
        else:
            eased = _within_range(rotations[:, joint], role, bounds, weight)
        rotations[rows, joint] = eased[rows]
    return replace(motion, rotations=rotations.astype(np.float32))


def within_bounds(rotations: Float[np.ndarray, "T J 3 3"], bounds: BodyBounds) -> Float[np.ndarray, "T J 3 3"]:
    """Local rotations whose spine, arms and head lie within the bounds in every frame.

    Each frame is a function of itself alone, so that this also works on motion whose later frames do not exist yet.
    """
    reference = bounds.reference
    eased = np.asarray(rotations, np.float64).copy()
    whole = np.ones(len(eased))
    for role in sorted(_EASED & reference.joints.keys()):
        joint = reference.joints[role]
        if role in reference.hinges:
            eased[:, joint] = _within_flexion(eased, role, bounds, whole)
        eased[:, joint] = _within_range(eased[:, joint], role, bounds, whole)
    return eased


def _calmer(
    motion: Motion, role: str, bounds: BodyBounds, outside: Bool[np.ndarray, " T"], fixed: Bool[np.ndarray, " T"]
) -> Float[np.ndarray, "T J 3 3"]:
    """Rotations with the arm of a wrist smoothed in time, no more than needed for its speed and jerk."""
    reference, found = bounds.reference, np.asarray(motion.rotations)
    weight = _weight(outside, fixed, motion.fps)
    rows = np.flatnonzero(weight)
    if not len(rows):
        return found
    column = reference.wrists.index(role)
    joints = [reference.joints[name] for part in _CHAIN if (name := f"{role[:2]}{part}") in reference.joints]
    around = slice(max(int(rows[0]) - 3, 0), int(rows[-1]) + 4)
    for seconds in _SMOOTHING:
        found = np.array(motion.rotations)
        for joint in joints:
            own = Rotation.from_matrix(found[:, joint])
            values = own.as_quat()
            values[1:] *= np.cumprod(np.where(np.sum(values[1:] * values[:-1], axis=1) < 0.0, -1.0, 1.0))[:, None]
            calm = Rotation.from_quat(gaussian_filter1d(values, seconds * motion.fps, axis=0, mode="nearest"))
            change = Rotation.from_rotvec(weight[:, None] * (own.inv() * calm).as_rotvec())
            found[rows, joint] = (own * change).as_matrix()[rows]
        figures = reference.figures(replace(motion.clip(around.start, around.stop), rotations=found[around]))
        shares = [figures[name][:, column].max() / bounds.high[name][column] for name in ("wrist_speed", "wrist_jerk")]
        if max(shares) <= _CALM:
            break
    return found


def _weight(outside: Bool[np.ndarray, " T"], fixed: Bool[np.ndarray, " T"], fps: float) -> Float[np.ndarray, " T"]:
    """Weight of the correction in each frame: 1 around frames outside, 0 in fixed ones, with a continuous slope."""
    if not outside.any():
        return np.zeros(len(outside))
    near = 1.0 - _smooth((_distance(outside) / fps - _WHOLE) / _FADE)
    return near * _smooth(_distance(fixed) / fps / _FADE) if fixed.any() else near


def _distance(flags: Bool[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """Frames to the nearest flag, of which there is at least one."""
    return np.asarray(distance_transform_edt(~flags))


def _smooth(u: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    u = np.clip(u, 0.0, 1.0)
    return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u**2))


def _within_flexion(
    rotations: Float[np.ndarray, "T J 3 3"], role: str, bounds: BodyBounds, weight: Float[np.ndarray, " T"]
) -> Float[np.ndarray, "T 3 3"]:
    """Rotations of a hinge turned about its axis, so that its flexion lies within the bounds where the weight is 1."""
    number, joint = bounds.reference.hinges.index(role), bounds.reference.joints[role]
    flexion = bounds.reference.hinge_figures(rotations)["bend"][:, number].astype(np.float64)
    wanted = _compressed(flexion, bounds.high["bend"][number])
    wanted = -_compressed(-wanted, bounds.high["backwards"][number])
    turn = Rotation.from_rotvec(np.radians(weight * (wanted - flexion))[:, None] * bounds.reference.axes[number])
    return np.asarray((turn * Rotation.from_matrix(rotations[:, joint])).as_matrix())


def _within_range(
    rotations: Float[np.ndarray, "T 3 3"], role: str, bounds: BodyBounds, weight: Float[np.ndarray, " T"]
) -> Float[np.ndarray, "T 3 3"]:
    """Rotations of a joint turned towards its mean pose."""
    joint = bounds.reference.joints[role]
    mean = Rotation.from_matrix(bounds.reference.pose[joint])
    away = (mean.inv() * Rotation.from_matrix(rotations)).as_rotvec()
    angle = np.linalg.norm(away, axis=1)
    wanted = np.radians(_compressed(np.degrees(angle), bounds.high["range"][joint]))
    share = np.where(angle > 0.0, wanted / np.maximum(angle, 1e-9), 1.0)
    return np.asarray((mean * Rotation.from_rotvec(away * (1.0 + weight * (share - 1.0))[:, None])).as_matrix())


def _compressed(degrees: Float[np.ndarray, " T"], bound: float) -> Float[np.ndarray, " T"]:
    """Angles below the bound: the same up to 17 degrees below it, then ever less, with a continuous slope."""
    begin, width = bound - _BEGIN, _BEGIN - _END
    over: Bool[np.ndarray, " T"] = degrees > begin
    return np.where(over, begin + width * np.tanh(np.maximum(degrees - begin, 0.0) / width), degrees)
