"""The body that moves: an adult of 1.70 m on the 22 SMPL-X body joints, in metres."""

import numpy as np

from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton

UPPER_ARM = 0.248
"""Shoulder to elbow, metres."""
FOREARM = 0.2102
"""Elbow to wrist, metres."""
THIGH = 0.395
"""Hip to knee, metres."""
SHIN = 0.385
"""Knee to ankle, metres."""
HAND = 0.165
"""Wrist to finger tip of a relaxed hand, metres."""
ANKLE_HEIGHT = 0.080
"""Ankle above the ground, metres."""
HIP_OFFSET = (0.088, -0.070, 0.0)
"""Left hip from the pelvis; the right one is its mirror image."""
PELVIS_HEIGHT = ANKLE_HEIGHT + SHIN + THIGH - HIP_OFFSET[1]
"""Pelvis above the ground with straight legs, metres: 0.93."""
TORSO_HALF_AXES = (0.155, 0.115)
"""Half width and half depth, metres, of the upright elliptic capsule around the line from pelvis to neck.

Wrists stay outside it.
"""

_LEFT_OFFSETS: dict[str, tuple[float, float, float]] = {
    "Spine1": (0.0, 0.115, -0.012),
    "Spine2": (0.0, 0.130, 0.004),
    "Spine3": (0.0, 0.055, 0.004),
    "Neck": (0.0, 0.205, -0.010),
    "Head": (0.0, 0.085, 0.022),
    "L_Hip": HIP_OFFSET,
    "L_Knee": (0.0, -THIGH, 0.0),
    "L_Ankle": (0.0, -SHIN, 0.0),
    "L_Foot": (0.0, -0.060, 0.130),
    "L_Collar": (0.040, 0.120, 0.0),
    "L_Shoulder": (0.105, 0.022, -0.004),
    "L_Elbow": (UPPER_ARM, 0.0, 0.0),
    "L_Wrist": (FOREARM, 0.0, 0.0),
}


def _offset(name: str) -> tuple[float, float, float]:
    if name.startswith("R_"):
        x, y, z = _LEFT_OFFSETS["L_" + name[2:]]
        return -x, y, z
    return _LEFT_OFFSETS.get(name, (0.0, 0.0, 0.0))


def _ends() -> tuple[tuple[int, tuple[float, float, float]], ...]:
    tips = {
        "Head": (0.0, 0.180, 0.020),
        "L_Foot": (0.0, -0.020, 0.065),
        "R_Foot": (0.0, -0.020, 0.065),
        "L_Wrist": (HAND, 0.0, 0.0),
        "R_Wrist": (-HAND, 0.0, 0.0),
    }
    return tuple((BODY_JOINTS.index(name), tip) for name, tip in tips.items())


TALKER_SKELETON = Skeleton(
    offsets=np.array([_offset(name) for name in BODY_JOINTS], dtype=np.float32),
    names=BODY_JOINTS,
    parents=BODY_PARENTS,
    ends=_ends(),
)
"""Rest skeleton, T-pose along +-X, feet on y = 0 when the pelvis is at :data:`PELVIS_HEIGHT`.

Wrist to wrist 1.2064 m, the reference length by which the Audio2Gestures papers scale position errors.
The head's end is the crown (1.70 m), the wrists' ends are finger tips, the feet's ends are toes.
"""
