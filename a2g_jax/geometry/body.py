"""Finding the 22 body joints in a rig by the names that riggers give them."""

import re

from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton

_SIDED = {
    "Hip": ("upleg", "upperleg", "thigh", "hip", "upperleg01"),
    "Knee": ("leg", "lowerleg", "calf", "shin", "knee", "lowleg"),
    "Ankle": ("foot", "ankle"),
    "Foot": ("toebase", "toe", "toes", "ball", "forefoot"),
    "Collar": ("shoulder", "clavicle", "collar", "shoulderblade"),
    "Shoulder": ("arm", "upperarm", "uparm"),
    "Elbow": ("forearm", "lowerarm", "elbow", "lowarm"),
    "Wrist": ("hand", "wrist"),
}
_ROOTS = ("hips", "pelvis", "root", "hip")
_SMPLX = {re.sub("[^a-z0-9]", "", name.lower()): index for index, name in enumerate(BODY_JOINTS)}


def find_body(skeleton: Skeleton) -> tuple[int, ...] | None:
    """Index of each of the 22 body joints (:data:`~a2g_jax.geometry.skeleton.BODY_JOINTS`, in their order).

    Knows SMPL-X names, the Hips/Spine/LeftArm family that BEAT, ZeroEGGS, Trinity and Mixamo share, and Unreal's
    ``upperarm_l``, with any prefix (``mixamorig:``), case or separator. Spines are counted, not named: of three or more
    between pelvis and neck the first, the middle and the last are taken. None when a joint is missing or the tree
    contradicts the names.
    """
    plain = [_plain(name) for name in skeleton.names]
    found = _smplx(plain)
    if found is None:
        found = _humanoid(skeleton, plain)
    return found if found is not None and _is_body_tree(skeleton, found) else None


def _plain(name: str) -> str:
    return re.sub("[^a-z0-9]", "", re.split("[:|]", name)[-1].lower())


def _smplx(plain: list[str]) -> tuple[int, ...] | None:
    short = [re.sub("^(left|right)", lambda word: word[0][0], name) for name in plain]
    try:
        return tuple(short.index(name) for name in _SMPLX)
    except ValueError:
        return None


def _sides(plain: str) -> list[tuple[str, str]]:
    """What a name may mean: ('L' or 'R', the rest of the name). "lowerarmr" starts with an L and means R."""
    for word, letter in (("left", "L"), ("right", "R")):
        if word in plain:
            return [(letter, plain.replace(word, "", 1))]
    ways = ((plain[:1], plain[1:]), (plain[-1:], plain[:-1]))
    return [(letter.upper(), rest) for letter, rest in ways if letter in ("l", "r") and len(rest) > 1]


def _humanoid(skeleton: Skeleton, plain: list[str]) -> tuple[int, ...] | None:
    joints: dict[str, int] = {}
    sides = [_sides(name) for name in plain]
    for part, names in _SIDED.items():
        for letter in "LR":
            # Aliases are ordered: the first that exists wins, so "toebase" beats "forefoot".
            for alias in names:
                hits = [index for index, side in enumerate(sides) if (letter, alias) in side]
                if hits:
                    joints.setdefault(f"{letter}_{part}", hits[0])
                    break
    for name, aliases in (("Pelvis", _ROOTS), ("Neck", ("neck", "neck01", "neck1")), ("Head", ("head",))):
        hits = [plain.index(alias) for alias in aliases if alias in plain]
        if hits:
            joints[name] = hits[0]
    if "Pelvis" not in joints or "Neck" not in joints:
        return None
    spine = []
    joint = skeleton.parents[joints["Neck"]]
    while joint not in (-1, joints["Pelvis"]):
        spine.append(joint)
        joint = skeleton.parents[joint]
    if joint == -1 or len(spine) < 3:
        return None
    spine.reverse()
    joints["Spine1"], joints["Spine2"], joints["Spine3"] = spine[0], spine[len(spine) // 2], spine[-1]
    if set(joints) != set(BODY_JOINTS):
        return None
    return tuple(joints[name] for name in BODY_JOINTS)


def _is_body_tree(skeleton: Skeleton, joints: tuple[int, ...]) -> bool:
    """Whether each found joint hangs below the found parent."""
    if len(set(joints)) != len(joints):
        return False
    for index, parent in enumerate(BODY_PARENTS):
        if parent < 0:
            continue
        joint = skeleton.parents[joints[index]]
        while joint not in (-1, joints[parent]):
            joint = skeleton.parents[joint]
        if joint == -1:
            return False
    return True
