"""Drawable hands: the fingers of the skeleton, or a relaxed hand where it ends at the wrist."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.skeleton import Skeleton

#: Knuckles of a relaxed hand and the lengths of its fingers' bones, metres: thumbward, towards the tips, and thickness.
_KNUCKLES = {
    "index": ((0.024, 0.089), (0.042, 0.025, 0.020)),
    "middle": ((0.003, 0.090), (0.046, 0.029, 0.021)),
    "ring": ((-0.017, 0.084), (0.043, 0.027, 0.020)),
    "pinky": ((-0.035, 0.075), (0.034, 0.019, 0.018)),
}
_CURL = {"index": 0.20, "middle": 0.26, "ring": 0.33, "pinky": 0.38}
"""Flexion of each joint of a relaxed finger, radians; larger towards the little finger."""
_SPLAY = {"index": 0.05, "middle": 0.0, "ring": -0.04, "pinky": -0.12}
#: Radii at the knuckle, the two joints after it and the tip, metres; the little finger is thinner.
_FINGER_RADII = (0.0098, 0.0088, 0.0079, 0.0066)
_THUMB_RADII = (0.0150, 0.0112, 0.0098, 0.0078)


@dataclass(frozen=True)
class Finger:
    """Joints of one finger from the knuckle, or of a thumb from its base."""

    joints: tuple[int, ...]
    thumb: bool
    small: bool
    """Whether it is the little finger."""


def find_fingers(skeleton: Skeleton, wrist: int, rest: Float[np.ndarray, "J 3"]) -> list[Finger]:
    """The fingers below ``wrist``; an empty list where the rig has fewer than three.

    Fingers are the chains of two joints or more that start at the wrist or at a bone of the palm. The thumb is found
    by name, otherwise it is the chain that points most away from the others.
    """
    children: dict[int, list[int]] = {}
    for joint, parent in enumerate(skeleton.parents):
        children.setdefault(parent, []).append(joint)
    chains: list[list[int]] = []
    stack = [[child] for child in children.get(wrist, [])]
    while stack:
        chain = stack.pop(0)
        below = children.get(chain[-1], [])
        if len(below) == 1:
            stack.append([*chain, below[0]])
        elif below:
            stack.extend([child] for child in below)
        elif len(chain) > 1:
            chains.append(chain)
    if len(chains) < 3:
        return []
    names = [skeleton.names[chain[-1]].lower() for chain in chains]
    directions = np.array([_unit(rest[chain[-1]] - rest[chain[0]]) for chain in chains])
    named = [index for index, name in enumerate(names) if "thumb" in name]
    thumb = named[0] if named else int(np.argmin(directions @ directions.sum(axis=0)))
    away = np.linalg.norm(rest[[chain[-1] for chain in chains]] - rest[chains[thumb][-1]], axis=1)
    small = int(np.argmax(away))
    fingers = []
    for index, chain in enumerate(chains):
        joints = [joint for joint in chain if np.linalg.norm(skeleton.offsets[joint]) > 1e-4]
        # A metacarpal comes first where it has no number, or where there are more bones than a finger has.
        palm = len(joints) > 3 and not skeleton.names[joints[0]][-1:].isdigit()
        if index != thumb and palm:
            joints = joints[1:]
        if len(joints) > 1:
            fingers.append(Finger(tuple(joints), index == thumb, index == small))
    return fingers if len(fingers) > 2 else []


def finger_radii(finger: Finger, size: float) -> list[float]:
    """Radii at the joints of a finger and at its tip, metres."""
    table = _THUMB_RADII if finger.thumb else _FINGER_RADII
    share = size * (0.85 if finger.small else 1.0)
    stations = np.linspace(0.0, 3.0, len(finger.joints) + 1)
    return [float(radius) * share for radius in np.interp(stations, range(4), table)]


def relaxed_hand(size: float, palm_side: float) -> list[tuple[Float[np.ndarray, "4 3"], list[float], bool]]:
    """Fingers of a relaxed hand: points (4, 3) along x thumbward, y to the tips, z; their radii; whether a thumb.

    Args:
        size: 1 for an adult of 1.7 m.
        palm_side: sign of z on the palm's side.
    """
    fingers = []
    for name, ((across, ahead), bones) in _KNUCKLES.items():
        bends = _CURL[name] * np.array([0.7, 1.9, 2.6])
        steps = np.array(bones)[:, None] * np.stack(
            [np.full(3, np.sin(_SPLAY[name])), np.cos(bends), palm_side * np.sin(bends)], axis=1
        )
        start = np.array([across, ahead, 0.0])
        points = np.vstack([start, start + np.cumsum(steps, axis=0)])
        finger = Finger((0, 1, 2), False, name == "pinky")
        fingers.append((points * size, finger_radii(finger, size), False))
    thumb = [(0.017, 0.022, 0.010), (0.038, 0.052, 0.020), (0.047, 0.080, 0.022), (0.050, 0.104, 0.020)]
    points = np.array(thumb) * np.array([1.0, 1.0, palm_side])
    fingers.append((points * size, finger_radii(Finger((0, 1, 2), True, False), size), True))
    return fingers


def _unit(vector: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-9 else vector
