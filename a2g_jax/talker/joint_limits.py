"""Anatomical ranges of motion, and how far a motion goes beyond them.

Sources: American Academy of Orthopaedic Surgeons, "Joint motion: method of measuring and recording" (1965), and Norkin
& White, "Measurement of joint motion" (2016), for all but these: axial rotation of a hanging upper arm (Kapandji, "The
physiology of the joints", vol. 1: 95 degrees inward, 80 outward), collarbone (Ludewig et al. 2009), side-to-side
play of knuckles (about 20 degrees either way from a spread middle position).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.talker.skeleton import FINGERS


@dataclass(frozen=True)
class Limit:
    """Normal range of one movement of one joint, degrees."""

    joint: str
    """Left joint (``L_``) or one on the midline; the right one has the same range."""
    movement: str
    """Named after its positive direction."""
    low: float
    high: float


BODY_LIMITS: tuple[Limit, ...] = (
    Limit("Spine3", "flexion", -25.0, 80.0),
    Limit("Spine3", "lateral flexion", -35.0, 35.0),
    Limit("Spine3", "rotation", -45.0, 45.0),
    Limit("Head", "flexion", -45.0, 45.0),
    Limit("Head", "lateral flexion", -45.0, 45.0),
    Limit("Head", "rotation", -60.0, 60.0),
    Limit("L_Collar", "elevation", -10.0, 40.0),
    Limit("L_Collar", "protraction", -20.0, 25.0),
    Limit("L_Shoulder", "elevation", 0.0, 180.0),
    Limit("L_Shoulder", "extension", -180.0, 60.0),
    Limit("L_Shoulder", "adduction", -180.0, 50.0),
    Limit("L_Shoulder", "internal rotation", -80.0, 95.0),
    Limit("L_Elbow", "flexion", 0.0, 150.0),
    Limit("L_Elbow", "supination", -80.0, 80.0),
    Limit("L_Wrist", "flexion", -70.0, 80.0),
    Limit("L_Wrist", "radial deviation", -30.0, 20.0),
    Limit("L_Hip", "flexion", -30.0, 120.0),
    Limit("L_Hip", "abduction", -30.0, 45.0),
    Limit("L_Hip", "external rotation", -45.0, 45.0),
    Limit("L_Knee", "flexion", 0.0, 135.0),
    Limit("L_Ankle", "dorsiflexion", -50.0, 20.0),
    Limit("L_Ankle", "inversion", -15.0, 35.0),
)
FINGER_LIMITS: tuple[Limit, ...] = (
    *(Limit(f"L_{name}1", "flexion", -45.0, 90.0) for name in FINGERS if name != "Thumb"),
    *(Limit(f"L_{name}1", "abduction", -25.0, 25.0) for name in FINGERS if name != "Thumb"),
    *(Limit(f"L_{name}2", "flexion", 0.0, 100.0) for name in FINGERS if name != "Thumb"),
    *(Limit(f"L_{name}3", "flexion", 0.0, 90.0) for name in FINGERS if name != "Thumb"),
    Limit("L_Thumb1", "opposition", -10.0, 70.0),
    Limit("L_Thumb1", "abduction", -50.0, 30.0),
    Limit("L_Thumb2", "flexion", -5.0, 50.0),
    Limit("L_Thumb3", "flexion", -20.0, 80.0),
)

Rotations = Float[np.ndarray, "T 3 3"]
Angles = Float[np.ndarray, " T"]


def joint_angles(motion: Motion) -> dict[tuple[str, str], Angles]:
    """Anatomical angles in degrees by joint and movement, for all limits whose joints the motion has.

    Args:
        motion: on the talker's skeleton, with or without fingers.
    """
    local = np.asarray(motion.rotations, dtype=np.float64)
    angles: dict[tuple[str, str], Angles] = {}
    for limit in limits_of(motion):
        key = (limit.joint, limit.movement)
        if key not in angles:
            for movement, values in _measure(limit.joint, local, motion).items():
                angles[limit.joint, movement] = np.rad2deg(values)
    return angles


def limits_of(motion: Motion) -> tuple[Limit, ...]:
    """Limits of a motion's joints on both sides; the right ones mirror the left ones."""
    both = [limit for limit in BODY_LIMITS + FINGER_LIMITS if limit.joint in motion.skeleton.names]
    right = [Limit("R_" + x.joint[2:], x.movement, x.low, x.high) for x in both if x.joint.startswith("L_")]
    return (*both, *right)


def limit_excess(motion: Motion) -> Float[np.ndarray, "T J"]:
    """Degrees by which each joint is beyond its range, the worst movement of each; 0 inside.

    Spine and neck count as wholes: their excess is that of ``Spine3`` and ``Head``.
    """
    angles = joint_angles(motion)
    excess = np.zeros((motion.frames, motion.skeleton.joints))
    for limit in limits_of(motion):
        joint = motion.skeleton.index(limit.joint)
        values = angles[limit.joint, limit.movement]
        beyond = np.maximum(np.maximum(values - limit.high, limit.low - values), 0.0)
        excess[:, joint] = np.maximum(excess[:, joint], beyond)
    return excess


def _measure(joint: str, local: Float[np.ndarray, "T J 3 3"], motion: Motion) -> dict[str, Angles]:
    index = motion.skeleton.index

    def rotation(name: str) -> Rotations:
        turned = local[:, index(name)]
        if joint.startswith("R_"):
            # A right limb is measured as the left one that it mirrors.
            mirror = np.array([-1.0, 1.0, 1.0])
            turned = turned * mirror[:, None] * mirror
        return turned

    if joint == "Spine3":
        return _trunk(rotation("Spine1") @ rotation("Spine2") @ rotation("Spine3"))
    if joint == "Head":
        return _trunk(rotation("Neck") @ rotation("Head"))
    part = joint[2:]
    measure = _PARTS.get(part) or (_hinge_down if not part.endswith("1") else _knuckle)
    return measure(rotation(joint))


def _asin(value: Angles) -> Angles:
    return np.arcsin(np.clip(value, -1.0, 1.0))


def _trunk(m: Rotations) -> dict[str, Angles]:
    # R_y(yaw) R_z(roll) R_x(pitch)
    return {
        "rotation": np.arctan2(-m[:, 2, 0], m[:, 0, 0]),
        "lateral flexion": _asin(m[:, 1, 0]),
        "flexion": np.arctan2(-m[:, 1, 2], m[:, 1, 1]),
    }


def _collar(m: Rotations) -> dict[str, Angles]:
    return {"elevation": _asin(m[:, 1, 0]), "protraction": np.arctan2(m[:, 2, 0], m[:, 0, 0])}


def _shoulder(m: Rotations) -> dict[str, Angles]:
    along, bend = m[:, :, 0], m[:, :, 2]
    # The shortest turn from a hanging arm, whose elbow bends forward, takes the forward axis to `level`.
    down = np.array([0.0, -1.0, 0.0])
    cos = along @ down
    axis = np.cross(down, along)
    forward = np.array([0.0, 0.0, 1.0])
    level = cos[:, None] * forward + np.cross(axis, forward)
    level = level + (axis @ forward)[:, None] * axis / np.maximum(1.0 + cos, 1e-6)[:, None]
    # Left arm: turning inward takes the bend from forward to the right, positive about the arm's direction.
    sin = np.sum(np.cross(level, bend) * along, axis=1)
    inward = np.arctan2(sin, np.sum(level * bend, axis=1))
    return {
        "elevation": np.arccos(np.clip(cos, -1.0, 1.0)),
        "extension": _asin(-along[:, 2]),
        "adduction": _asin(-along[:, 0]),
        "internal rotation": inward,
    }


def _elbow(m: Rotations) -> dict[str, Angles]:
    # R_y(-flexion) R_x(-supination)
    return {"flexion": np.arctan2(m[:, 2, 0], m[:, 0, 0]), "supination": np.arctan2(m[:, 1, 2], m[:, 1, 1])}


def _wrist(m: Rotations) -> dict[str, Angles]:
    # R_z(-flexion) R_y(-radial deviation)
    return {"flexion": np.arctan2(-m[:, 1, 0], m[:, 0, 0]), "radial deviation": _asin(m[:, 2, 0])}


def _hip(m: Rotations) -> dict[str, Angles]:
    along = -m[:, :, 1]
    return {
        "flexion": np.arctan2(along[:, 2], -along[:, 1]),
        "abduction": _asin(along[:, 0]),
        "external rotation": np.arctan2(m[:, 0, 2], m[:, 2, 2]),
    }


def _knee(m: Rotations) -> dict[str, Angles]:
    return {"flexion": np.arctan2(m[:, 2, 1], m[:, 1, 1])}


def _ankle(m: Rotations) -> dict[str, Angles]:
    return {"dorsiflexion": np.arctan2(m[:, 1, 2], m[:, 2, 2]), "inversion": _asin(m[:, 1, 0])}


def _knuckle(m: Rotations) -> dict[str, Angles]:
    # R_y(-abduction) R_z(-flexion)
    return {"flexion": np.arctan2(-m[:, 1, 0], m[:, 1, 1]), "abduction": np.arctan2(-m[:, 0, 2], m[:, 2, 2])}


def _hinge_down(m: Rotations) -> dict[str, Angles]:
    return {"flexion": np.arctan2(-m[:, 1, 0], m[:, 0, 0])}


def _thumb_saddle(m: Rotations) -> dict[str, Angles]:
    # R_x(opposition) R_y(-abduction)
    return {"opposition": np.arctan2(m[:, 2, 1], m[:, 1, 1]), "abduction": np.arctan2(-m[:, 0, 2], m[:, 0, 0])}


def _angle(m: Rotations) -> dict[str, Angles]:
    return {"flexion": np.arccos(np.clip((np.trace(m, axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0))}


_PARTS: dict[str, Callable[[Rotations], dict[str, Angles]]] = {
    "Collar": _collar,
    "Shoulder": _shoulder,
    "Elbow": _elbow,
    "Wrist": _wrist,
    "Hip": _hip,
    "Knee": _knee,
    "Ankle": _ankle,
    "Thumb1": _thumb_saddle,
    "Thumb2": _angle,
    "Thumb3": _angle,
}
