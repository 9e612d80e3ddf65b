"""The talker's skeleton: an adult of 1.70 m with the 22 SMPL-X body joints, in metres."""

import numpy as np

from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton

UPPER_ARM = 0.272
"""Shoulder to elbow, metres."""
FOREARM = 0.238
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
    "L_Collar": (0.042, 0.122, 0.0),
    "L_Shoulder": (0.130, 0.020, -0.004),
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

Wrist to wrist 1.364 m, finger tips 1.73 m apart stretched: an adult's proportions. (The 1.2064 m of the
Audio2Gestures papers is the length by which they scale position errors, not that of a person.)
The head's end is the crown (1.70 m), the wrists' ends are finger tips, the feet's ends are toes.
"""

FINGERS = ("Index", "Middle", "Pinky", "Ring", "Thumb")
"""SMPL-X order of the fingers of a hand."""

_FINGER_CHAINS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "Index": ((0.090, -0.002, 0.024), (0.042, -0.001, 0.002), (0.025, 0.0, 0.0), (0.021, 0.0, 0.0)),
    "Middle": ((0.089, 0.002, 0.002), (0.046, -0.001, 0.0), (0.029, 0.0, 0.0), (0.022, 0.0, 0.0)),
    "Pinky": ((0.076, -0.005, -0.037), (0.034, -0.001, -0.003), (0.019, 0.0, -0.001), (0.019, 0.0, 0.0)),
    "Ring": ((0.084, 0.0, -0.018), (0.043, -0.001, -0.001), (0.027, 0.0, 0.0), (0.022, 0.0, 0.0)),
    "Thumb": ((0.024, -0.012, 0.020), (0.030, -0.011, 0.028), (0.024, -0.007, 0.021), (0.020, -0.004, 0.016)),
}
"""Left hand at rest, palm down, thumb forward: knuckle from wrist, then the three bones; metres."""


def _hands_skeleton() -> Skeleton:
    names, parents = list(BODY_JOINTS), list(BODY_PARENTS)
    offsets = [np.asarray(offset) for offset in TALKER_SKELETON.offsets]
    ends = [end for end in TALKER_SKELETON.ends if "Wrist" not in BODY_JOINTS[end[0]]]
    for letter, side in (("L", 1.0), ("R", -1.0)):
        for finger in FINGERS:
            chain = [(side * x, y, z) for x, y, z in _FINGER_CHAINS[finger]]
            for number in (1, 2, 3):
                parents.append(BODY_JOINTS.index(f"{letter}_Wrist") if number == 1 else len(names) - 1)
                names.append(f"{letter}_{finger}{number}")
                offsets.append(np.array(chain[number - 1]))
            ends.append((len(names) - 1, chain[3]))
    return Skeleton(np.array(offsets, dtype=np.float32), tuple(names), tuple(parents), tuple(ends))


TALKER_HANDS_SKELETON = _hands_skeleton()
"""The same skeleton with 15 finger joints a hand, in SMPL-X order: 52 joints, T-pose, palms down, finger tips as ends.

A stretched hand is 0.185 m long, 10.9 % of the height (Winter 2009: 10.8 %).
"""
