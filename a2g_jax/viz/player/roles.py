"""Which joint of a skeleton is the wrist, the knee, the chest: read from names, then from the shape of the tree."""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.skeleton import Skeleton

_FINGER = re.compile(r"thumb|index|middle|ring|pinky|little|finger|palm|carpal")
_HELPER = re.compile(r"twist|roll|end$|nub$|site$")
_SIDE_WORD = re.compile(r"(?:^|[^a-z])(left|right|l|r)(?=$|[^a-z])|^(left|right)|(left|right)$")
_SIDE_CAMEL = re.compile(r"^([lrLR])(?=[A-Z])")


@dataclass(frozen=True)
class Limb:
    """An arm (shoulder, elbow, wrist) or a leg (hip, knee, ankle) as joint indices."""

    top: int
    middle: int
    tip: int


@dataclass(frozen=True)
class Roles:
    """Joint indices of a body; what the skeleton does not have is None or missing from the mapping."""

    arms: dict[str, Limb]
    legs: dict[str, Limb]
    head: int | None
    neck: int | None
    chest: int
    pelvis: int


def find_roles(skeleton: Skeleton) -> Roles | None:
    """The roles of a skeleton that has two arms; None where the names tell nothing."""
    sides, bases = zip(*(split_name(name) for name in skeleton.names), strict=True)
    parents = skeleton.parents

    def limb(side: str, pattern: str, but: str) -> Limb | None:
        for joint in _by_depth(parents):
            if sides[joint] != side or re.search(but, bases[joint]) or not re.search(pattern, bases[joint]):
                continue
            middle = _real_parent(joint, parents, bases)
            top = _real_parent(middle, parents, bases) if middle > 0 else -1
            if top >= 0:
                return Limb(top, middle, joint)
        return None

    arms = {side: limb(side, r"wrist|hand", f"{_FINGER.pattern}|end$|nub$|site$") for side in ("left", "right")}
    legs = {side: limb(side, r"ankle|foot", r"toe|fore|end$|nub$|site$|heel") for side in ("left", "right")}
    known_arms = {side: found for side, found in arms.items() if found is not None}
    known_legs = {side: found for side, found in legs.items() if found is not None}
    if len(known_arms) < 2:
        return None
    if len(known_legs) < 2:
        known_legs = {}
    chest = _common(parents, known_arms["left"].top, known_arms["right"].top)
    pelvis = _common(parents, known_legs["left"].top, known_legs["right"].top) if known_legs else 0
    head = next((j for j in _by_depth(parents) if "head" in bases[j] and not _HELPER.search(bases[j])), None)
    if head is None:  # rigs of upper bodies may call it the last of the neck
        necks = [j for j in _by_depth(parents) if "neck" in bases[j] and not _HELPER.search(bases[j])]
        head = necks[-1] if necks else None
    neck = head
    if head is not None:
        path = ancestors(parents, head)
        if chest in path:
            neck = ([head, *path])[path.index(chest)]
    return Roles(known_arms, known_legs, head, neck, chest, pelvis)


def split_name(name: str) -> tuple[str, str]:
    """``("left", "forearm")`` of ``mixamorig:LeftForeArm``, ``forearm.L`` or ``L_ForeArm``; side "" for none."""
    name = name.rsplit(":", 1)[-1]
    camel = _SIDE_CAMEL.match(name)
    if camel:
        name = f"{camel.group(1)}_{name[1:]}"
    lower = name.lower()
    found = _SIDE_WORD.search(lower)
    side = ""
    if found:
        word = next(group for group in found.groups() if group)
        side = "left" if word[0] == "l" else "right"
        lower = lower[: found.start()] + " " + lower[found.end() :]
    return side, re.sub(r"[^a-z0-9]", "", lower)


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
    places = np.zeros_like(offsets)
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            places[joint] = places[parent] + offsets[joint]
    return places


def _by_depth(parents: tuple[int, ...]) -> list[int]:
    return sorted(range(len(parents)), key=lambda joint: (len(ancestors(parents, joint)), joint))


def _real_parent(joint: int, parents: tuple[int, ...], bases: tuple[str, ...]) -> int:
    parent = parents[joint]
    while parent > 0 and _HELPER.search(bases[parent]):
        parent = parents[parent]
    return parent


def _common(parents: tuple[int, ...], first: int, second: int) -> int:
    path = [second, *ancestors(parents, second)]
    return next(joint for joint in [first, *ancestors(parents, first)] if joint in path)
