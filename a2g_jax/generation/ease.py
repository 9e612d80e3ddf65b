"""Joints that are bent or turned too far, eased back within the bounds of a body.

Angles near a bound are compressed smoothly: those further than a few degrees inside it stay as they are, and none
passes it. The correction is whole in the frames of a finding, fades to zero before and after them, and is zero from
the border of a stretch on that has to stay. Turns that are too fast are bridged by slower ones
(:mod:`a2g_jax.geometry.turns`). A motion without findings is not touched.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt
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
_FIGURES = {"bend": "bend", "backwards": "bend", "range": "range", "turn": "turn"}
_EASED = {"Spine1", "Spine2", "Spine3", "Neck", "Head", *(f"{side}_{part}" for side in "LR" for part in _ARM)}


def ease(
    motion: Motion, findings: Iterable[BodyFinding], bounds: BodyBounds, stretches: Iterable[Stretch] = ()
) -> Motion:
    """The motion with the joints of findings on ``bend``, ``backwards``, ``range`` and ``turn`` within their bounds.

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
    rotations = np.asarray(motion.rotations, np.float64).copy()
    for (figure, role), outside in sorted(found.items(), key=lambda item: item[0]):
        if figure == "turn":
            # Last by its name: joints that are turned too far may be eased back to either side.
            joint = reference.joints[role]
            limits = bounds.high["turn"][joint], bounds.high["range"][joint]
            rotations[:, joint] = bridged(rotations[:, joint], reference.pose[joint], *limits, motion.fps, fixed)
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
