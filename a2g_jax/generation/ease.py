"""Joints that are bent or turned too far, eased back within the bounds of a body.

Angles near a bound are compressed smoothly: those further than a few degrees inside it stay as they are, and none
passes it. A motion without findings is not touched.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.body.bounds import BodyBounds
from a2g_jax.metrics.body.check import BodyFinding, Stretch
from a2g_jax.metrics.body.figures import HINGES

#: Degrees inside a bound from which angles are compressed, and the degrees inside that none passes.
_BEGIN, _END = 17.0, 2.0
#: Body joints that are eased; legs are not, since feet that stand would move.
_ARM = ("Collar", "Shoulder", "Elbow", "Wrist")
_EASED = {"Spine1", "Spine2", "Spine3", "Neck", "Head", *(f"{side}_{part}" for side in "LR" for part in _ARM)}


def ease(
    motion: Motion, findings: Iterable[BodyFinding], bounds: BodyBounds, stretches: Iterable[Stretch] = ()
) -> Motion:
    """The motion with the joints of findings on ``bend``, ``backwards`` and ``range`` within their bounds.

    Args:
        findings: on the motion. Those on legs and on other figures remain, since they need another motion.
        stretches: frames that stay as they are.
    """
    reference = bounds.reference
    roles = {reference.skeleton.names[joint]: role for role, joint in reference.joints.items()}
    found = {(one.figure, roles[one.joint]) for one in findings if roles.get(one.joint) in _EASED}
    free = np.ones(motion.frames, bool)
    for one in stretches:
        free[max(one.first, 0) : max(one.stop, 0)] = False
    rotations = np.asarray(motion.rotations, np.float64).copy()
    for role in sorted({role for figure, role in found if figure in ("bend", "backwards")}):
        rotations[free, reference.joints[role]] = _within_flexion(motion, role, bounds)[free]
    for role in sorted({role for figure, role in found if figure == "range"}):
        joint = reference.joints[role]
        rotations[free, joint] = _within_range(rotations[free, joint], role, bounds)
    return replace(motion, rotations=rotations.astype(np.float32))


def _within_flexion(motion: Motion, role: str, bounds: BodyBounds) -> Float[np.ndarray, "T 3 3"]:
    """Rotations of a hinge turned about its axis, so that its flexion lies within the bounds."""
    number, joint = HINGES.index(role), bounds.reference.joints[role]
    flexion = bounds.reference.figures(motion)["bend"][:, number].astype(np.float64)
    wanted = _compressed(flexion, bounds.high["bend"][number])
    wanted = -_compressed(-wanted, bounds.high["backwards"][number])
    turn = Rotation.from_rotvec(np.radians(wanted - flexion)[:, None] * bounds.reference.axes[number])
    return np.asarray((turn * Rotation.from_matrix(np.asarray(motion.rotations[:, joint]))).as_matrix())


def _within_range(rotations: Float[np.ndarray, "T 3 3"], role: str, bounds: BodyBounds) -> Float[np.ndarray, "T 3 3"]:
    """Rotations of a joint turned towards its mean pose."""
    joint = bounds.reference.joints[role]
    mean = Rotation.from_matrix(bounds.reference.pose[joint])
    away = (mean.inv() * Rotation.from_matrix(rotations)).as_rotvec()
    angle = np.linalg.norm(away, axis=1)
    wanted = np.radians(_compressed(np.degrees(angle), bounds.high["range"][joint]))
    share = np.where(angle > 0.0, wanted / np.maximum(angle, 1e-9), 1.0)
    return np.asarray((mean * Rotation.from_rotvec(away * share[:, None])).as_matrix())


def _compressed(degrees: Float[np.ndarray, " T"], bound: float) -> Float[np.ndarray, " T"]:
    """Angles below the bound: the same up to 17 degrees below it, then ever less, with a continuous slope."""
    begin, width = bound - _BEGIN, _BEGIN - _END
    over: Bool[np.ndarray, " T"] = degrees > begin
    return np.where(over, begin + width * np.tanh(np.maximum(degrees - begin, 0.0) / width), degrees)
