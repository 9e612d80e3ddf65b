"""The joints that a figure is drawn from: the limbs that retargeting moves, and the head, the chest and the pelvis."""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.retarget.rig import find_rig
from a2g_jax.geometry.skeleton import Skeleton

_FINGER = re.compile(r"thumb|index|middle|ring|pinky|little|finger|palm|carpal")
_SIDES = {"L": "left", "R": "right"}


@dataclass(frozen=True)
class Limb:
    """An arm (shoulder, elbow, wrist) or a leg (hip, knee, ankle) as joint indices."""

    top: int
    middle: int
    tip: int


@dataclass(frozen=True)
class Roles:
    """Joint indices of a figure; parts that the skeleton lacks are None or missing from the mapping."""

    arms: dict[str, Limb]
    legs: dict[str, Limb]
    head: int | None
    neck: int | None
    """The lowest joint of the neck."""
    chest: int
    """The joint that both arms descend from."""
    pelvis: int


def find_roles(skeleton: Skeleton) -> Roles | None:
    """The roles of a skeleton as :func:`~a2g_jax.geometry.retarget.find_rig` finds them; None without two arms."""
    try:
        # Only the sides of nameless limbs depend on the reference pose; the zero pose is always there.
        rig = find_rig(skeleton, rest="zero")
    except InputError:
        return None
    joints = rig.roles

    def limbs(parts: tuple[str, str, str]) -> dict[str, Limb]:
        found = {}
        for letter, side in _SIDES.items():
            names = [f"{letter}_{part}" for part in parts]
            if all(name in joints for name in names):
                found[side] = Limb(*(joints[name] for name in names))
        return found if len(found) == 2 else {}

    # Rigs of upper bodies may have a neck and no head.
    head = joints.get("Head", rig.neck[-1] if rig.neck else None)
    neck, chest = head, joints["Chest"]
    if head is not None:
        path = [head, *ancestors(skeleton.parents, head)]
        if chest in path[1:]:
            neck = path[path.index(chest) - 1]
    return Roles(
        limbs(("Shoulder", "Elbow", "Wrist")),
        limbs(("Hip", "Knee", "Ankle")),
        head,
        neck,
        chest,
        joints.get("Pelvis", 0),
    )


def is_finger(name: str) -> bool:
    """Whether a joint's name is that of a finger or a bone of the palm."""
    return bool(_FINGER.search(name.lower()))


def ancestors(parents: tuple[int, ...], joint: int) -> list[int]:
    """Parent, grandparent and so on, up to the root."""
    found = []
    while parents[joint] >= 0:
        joint = parents[joint]
        found.append(joint)
    return found


def rest_positions(skeleton: Skeleton) -> Float[np.ndarray, "J 3"]:
    """Joint positions of the rest pose with the root at the origin, metres."""
    offsets = np.asarray(skeleton.offsets, np.float64)
    positions = np.zeros_like(offsets)
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            positions[joint] = positions[parent] + offsets[joint]
    return positions
