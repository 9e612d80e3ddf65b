"""Side, part of the body, finger and bone from the joint names of rigs.

Recognises the names of BEAT, ZeroEGGS, Trinity and Mixamo (``LeftForeArm``), Talking With Hands (``b_l_forearm``), SMPL
and SMPL-X (``L_Elbow``, ``left_elbow``), Unreal (``lowerarm_l``), 3ds Max Biped (``Bip01 L Forearm``), Blender
(``forearm.L``), VRM (``J_Bip_L_LowerArm``), the 47 joints of work on BEAT (``LArm1``), MikuMikuDance (``左ひじ``), Daz
(``lShldrBend``), MakeHuman (``finger2-1.L``) and similar ones, with any prefix, case or separator.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from a2g_jax.geometry.joint_words import in_english

FINGERS = ("Index", "Middle", "Pinky", "Ring", "Thumb")
"""The five fingers in SMPL-X order."""

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+")
_SIDE = {"l": "L", "left": "L", "lt": "L", "r": "R", "right": "R", "rt": "R"}
#: Words that rigs put before (or after) every name.
_CASING = frozenset(
    ("b", "p", "j", "m", "f", "c", "cc", "avg", "bip", "mixamorig", "valvebiped", "def", "org", "mch", "jnt", "joint")
) | {"bone", "character", "base", "bind", "rig"}
_HELPER = re.compile(r"twist|roll|helper|corrective|muscle|share|bendy|scap$|pole|target|socket|prop|weapon|^ik|ik$")
_LEAF = re.compile(r"(end|nub|site|tip|null|effector|top)[0-9]*$")
_FINGER_WORDS = (
    ("Thumb", "thumb"),
    ("Index", "index"),
    ("Middle", "middle"),
    ("Middle", "mid"),
    ("Ring", "ring"),
    ("Pinky", "pinky"),
    ("Pinky", "pinkie"),
    ("Pinky", "little"),
)
_BONES = {"metacarpal": 0, "carpal": 0, "meta": 0, "proximal": 1, "intermediate": 2, "distal": 3}
_BIPED_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Pinky")

#: Names of the parts that have sides. The first name that a rig has wins; a name of two parts is that of the first
#: part without a joint ("shoulder" is the upper arm in SMPL-X, the collar elsewhere).
_SIDED: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Hip", ("upleg", "upperleg", "legupper", "thigh", "femur", "hip", "upperleg01")),
    ("Knee", ("lowerleg", "leglower", "calf", "shin", "knee", "lowleg", "tibia", "leg", "lowerleg01")),
    ("Hip", ("leg",)),
    ("Ankle", ("ankle", "foot")),
    ("Foot", ("toebase", "toe", "toes", "ball", "toe0", "toe11", "forefoot", "foot")),
    ("Shoulder", ("arm", "upperarm", "uparm", "humerus", "armupper", "shldr", "shoulder", "upperarm01")),
    ("Collar", ("clavicle", "collar", "collarbone", "shoulder", "shoulderblade", "shoulder01")),
    ("Elbow", ("forearm", "lowerarm", "armlower", "elbow", "lowarm", "radius", "lowerarm01", "arm1")),
    ("Wrist", ("wrist", "hand")),
)
_MIDDLE: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Pelvis", ("pelvis", "hips", "hip", "root")),
    ("Neck", ("neck", "neck0", "neck00", "neck01", "neck1", "necklower", "cervical")),
    ("Head", ("head", "head0", "head01")),
)
#: A running number after the name, a word before it, and how many names, and which share of them, have such parts.
_RUNNING, _FIRST = re.compile(r"_([0-9]+)$"), re.compile(r"[A-Za-z0-9]+[_: .-]")
_FEW, _NEARLY = 6, 0.9
#: Words after the name of a joint of the middle (``neck.x``, ``Head_M``), and of any (``forearm_stretch.l``).
_MIDDLE_MARKS = frozenset(("m", "x", "c", "mid", "center"))
_MARKS = frozenset(("stretch", "bend"))
#: MakeHuman numbers the fingers from the thumb, and then the bones: ``finger2-1.L``.
_NUMBERED = re.compile(r"^finger([1-5])-([0-9])")
_SIDED_NAMES = {name for _, names in _SIDED for name in names}


@dataclass(frozen=True)
class JointName:
    """A joint name split into side and rest."""

    side: str
    """``"L"``, ``"R"`` or ``""``."""
    base: str
    """The rest in lower-case letters and digits: ``"forearm"``."""

    @property
    def is_helper(self) -> bool:
        """Whether this is a twist bone or another helper that corresponds to no joint of a body."""
        return bool(_HELPER.search(self.base))

    @property
    def is_leaf(self) -> bool:
        """Whether the name marks the end of a chain."""
        return bool(_LEAF.search(self.base))

    @property
    def finger(self) -> str | None:
        """``"Index2"`` for the second bone of an index finger, 0 for the one in the palm; None for other joints."""
        if self.is_helper or self.is_leaf or not self.side or "toe" in self.base or "foot" in self.base:
            return None
        number = re.search(r"([0-9]+)$", self.base)
        for finger, word in _FINGER_WORDS:
            if word in self.base:
                for bone, index in _BONES.items():
                    if bone in self.base:
                        return f"{finger}{index}"
                return f"{finger}{int(number[1]) if number else 0}"
        if (short := re.search(r"^hand([mript])([0-9]?)$", self.base)) is not None:
            word = next(finger for finger in FINGERS if finger[0].lower() == short[1])
            return f"{word}{int(short[2] or 0)}"
        if (biped := re.search(r"finger([0-4])([0-9]?)$", self.base)) is not None:
            return f"{_BIPED_FINGERS[int(biped[1])]}{int(biped[2] or 0) + 1}"
        return None


def parse_name(name: str) -> JointName:
    """Split one joint name."""
    plain = re.split("[:|]", in_english(name))[-1]
    plain = _NUMBERED.sub(lambda found: f"{_BIPED_FINGERS[int(found[1]) - 1]}{found[2]}", plain)
    words = [word.lower() for word in _WORD.findall(plain)]
    while len(words) > 1 and words[0] in _CASING:
        words = words[1:]
        # With "Bip01" its number.
        if len(words) > 1 and words[0].isdigit():
            words = words[1:]
    while len(words) > 1 and words[-1] in _CASING and words[-1] not in ("b", "p", "m", "f", "c"):
        words = words[:-1]
    words = [word for word in words if word not in _MARKS] or words
    if len(words) > 1 and words[-1] in _MIDDLE_MARKS:
        words = words[:-1]
    for at, word in enumerate(words):
        if word in _SIDE and len(words) > 1:
            return JointName(_SIDE[word], "".join(words[:at] + words[at + 1 :]))
    base = "".join(words)
    for word, letter in (("left", "L"), ("right", "R")):
        if base != word and (base.startswith(word) or base.endswith(word)):
            return JointName(letter, base.replace(word, "", 1))
    # One letter without a separator ("lowerarmr") only where what remains is a part of the body.
    for letter, rest in ((base[-1:], base[:-1]), (base[:1], base[1:])):
        if letter in ("l", "r") and rest in _SIDED_NAMES and base not in _SIDED_NAMES:
            return JointName(letter.upper(), rest)
    return JointName("", base)


def without_common_parts(names: Sequence[str]) -> list[str]:
    """Names without what nearly all of them share: a word at the beginning (``Robot_LeftArm``), or a running number at
    the end, which some exporters add (``LeftArm_07``)."""
    plain = list(names)
    numbers = [found[1] for name in plain if (found := _RUNNING.search(name)) is not None]
    if len(numbers) >= max(_FEW, _NEARLY * len(plain)) and len(set(numbers)) == len(numbers):
        plain = [_RUNNING.sub("", name) or name for name in plain]
    words = Counter(found[0] for name in plain if (found := _FIRST.match(name)) is not None)
    for word, count in words.most_common(1):
        if count >= max(_FEW, _NEARLY * len(plain)):
            plain = [name.removeprefix(word) or name for name in plain]
    return plain


def named_joints(names: Sequence[str]) -> dict[str, int]:
    """Indices of the joints of a body by role: ``"L_Elbow"``, ``"Pelvis"``, ``"R_Index1"`` ...

    Roles are those of :data:`~a2g_jax.geometry.skeleton.BODY_JOINTS` without the spines, which are identified by
    position, and ``L_`` or ``R_`` with each finger and the number of its bone. A joint has one role at most.
    """
    parsed = [parse_name(name) for name in without_common_parts(names)]
    found: dict[str, int] = {}
    for side in "LR":
        _assign(found, f"{side}_", _SIDED, {p.base: j for j, p in _reversed(parsed) if p.side == side})
        for joint, name in _reversed(parsed):
            if name.side == side and (finger := name.finger) is not None and joint not in found.values():
                found[f"{side}_{finger}"] = joint
        if f"{side}_Thumb0" in found and f"{side}_Thumb1" in found and f"{side}_Thumb2" not in found:
            # Thumbs have no intermediate bone: metacarpal, proximal and distal.
            found[f"{side}_Thumb2"] = found.pop(f"{side}_Thumb1")
            found[f"{side}_Thumb1"] = found.pop(f"{side}_Thumb0")
    for side, other in ("LR", "RL"):
        shoulder = found.get(f"{side}_Shoulder")
        # "LeftShoulder" is a collar if the right side has a "RightShoulder" above its "RightArm".
        doubtful = f"{other}_Collar" in found and f"{side}_Collar" not in found
        if doubtful and shoulder is not None and parsed[shoulder].base == parsed[found[f"{other}_Collar"]].base:
            found[f"{side}_Collar"] = found.pop(f"{side}_Shoulder")
    _assign(found, "", _MIDDLE, {p.base: j for j, p in _reversed(parsed) if not p.side})
    return found


def _reversed(parsed: list[JointName]) -> Iterable[tuple[int, JointName]]:
    # So that in a dictionary the first joint of a name wins.
    return reversed(list(enumerate(parsed)))


def _assign(found: dict[str, int], prefix: str, parts: tuple[tuple[str, tuple[str, ...]], ...], joints: dict) -> None:
    taken: set[int] = set()
    for part, aliases in parts:
        if prefix + part in found:
            continue
        for alias in aliases:
            if alias in joints and joints[alias] not in taken:
                found[prefix + part] = joints[alias]
                taken.add(joints[alias])
                break
