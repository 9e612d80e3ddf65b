"""Standard skeletons with the proportions of a rig, as targets of retargeting."""

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.retarget.poses import joint_places
from a2g_jax.geometry.retarget.rig import Rig, find_rig
from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton

#: Default positions of parts that a rig lacks: the collar as a share of the way from chest to shoulder, the ball of the
#: foot from the ankle and the head from the neck as shares of the length of a leg and of the trunk.
_COLLAR, _BALL, _HEAD = 0.3, (0.0, -0.08, 0.17), (0.0, 0.2, 0.03)
#: Metres from the ball of a foot to the end site of one that has none.
_TOE = 0.05
_METACARPALS = ("Ring", "Pinky", "Index")
_CARRIERS = {"Pinky": "Ring", "Thumb": "Index"}


def body_skeleton(rig: Rig) -> Skeleton:
    """The 22 body joints with the bones of a rig: Y-up, T-pose, metres (corrected by the rig's unit).

    Spines are placed by order; a collar, a neck, a head or toes that the rig lacks are placed by proportions.

    Raises:
        InputError: the rig has no legs.
    """
    person = _Person(rig)
    places, frames = {"Pelvis": person.hips()}, {"Pelvis": person.body}
    count = len(rig.spine)
    for number in range(3):
        at = number * (count - 1) / 2
        low, high = (rig.spine[int(f(at))] if count else rig.roles["Chest"] for f in (np.floor, np.ceil))
        # Of three or more, an existing joint; of two, also their midpoint.
        whole = rig.spine[int(np.floor(at + 0.5))] if count >= 3 else None
        point = (person.places[low] + person.places[high]) / 2 if whole is None else person.places[whole]
        if count <= 1:
            chest = person.places[rig.roles["Chest"]]
            point = places["Pelvis"] + (chest - places["Pelvis"]) * (number + 1) / 3
        places[f"Spine{number + 1}"], frames[f"Spine{number + 1}"] = point, person.body
    shoulders = (person.places[rig.roles["L_Shoulder"]] + person.places[rig.roles["R_Shoulder"]]) / 2
    trunk = float(np.linalg.norm(shoulders - places["Pelvis"]))
    for role in BODY_JOINTS:
        if role not in places and role in rig.roles:
            places[role], frames[role] = person.places[rig.roles[role]], person.frames[rig.roles[role]]
    places.setdefault("Neck", shoulders)
    places.setdefault("Head", places["Neck"] + trunk * person.body @ np.array(_HEAD))
    for side in "LR":
        shoulder, ankle = places[f"{side}_Shoulder"], places[f"{side}_Ankle"]
        places.setdefault(f"{side}_Collar", places["Spine3"] + _COLLAR * (shoulder - places["Spine3"]))
        leg = float(np.linalg.norm(places[f"{side}_Hip"] - ankle))
        places.setdefault(f"{side}_Foot", ankle + leg * frames[f"{side}_Ankle"] @ np.array(_BALL))
    offsets = np.zeros((len(BODY_JOINTS), 3))
    for joint, (role, parent) in enumerate(zip(BODY_JOINTS, BODY_PARENTS, strict=True)):
        if parent >= 0:
            above = BODY_JOINTS[parent]
            offsets[joint] = frames.get(above, person.body).T @ (places[role] - places[above])
    ends = []
    for role in ("L_Foot", "R_Foot", "Head", "L_Wrist", "R_Wrist"):
        if role in rig.roles and (tip := person.tip(rig.roles[role])) is not None:
            ends.append((BODY_JOINTS.index(role), tip))
    factor = rig.unit_factor
    ends = list(_scaled(ends, factor))
    for foot in (BODY_JOINTS.index("L_Foot"), BODY_JOINTS.index("R_Foot")):
        if foot not in [joint for joint, _ in ends]:
            # Level, so that it does not lower the sole: a writer would add one along the bone from the ankle.
            ends.append((foot, (0.0, 0.0, _TOE)))
    return Skeleton((offsets * factor).astype(np.float32), BODY_JOINTS, BODY_PARENTS, tuple(sorted(ends)))


def upper_body_skeleton(rig: Rig) -> Skeleton:
    """BEAT's 47 upper-body joints with the bones of a rig: names and order of BEAT's files, Y-up, T-pose, metres.

    ``Spine``, the root, is the rig's chest. Palm joints that the rig lacks are at the wrist, without rotation.

    Raises:
        InputError: the rig has no fingers, or an arm without a collar.
    """
    person = _Person(rig)
    rows = [("Spine", "", "Chest"), ("Neck", "Spine", "Neck"), ("Neck1", "Neck", "Head")]
    for side, word in (("R", "Right"), ("L", "Left")):
        above = "Spine"
        for name, part in (("Shoulder", "Collar"), ("Arm", "Shoulder"), ("ForeArm", "Elbow"), ("Hand", "Wrist")):
            rows.append((word + name, above, f"{side}_{part}"))
            above = word + name
        for finger in ("Middle", "Ring", "Pinky", "Index", "Thumb"):
            above = f"{word}Hand{_CARRIERS.get(finger, '')}"
            if finger in _METACARPALS:
                rows.append((f"{word}Hand{finger}", above, f"{side}_{finger}0"))
                above = f"{word}Hand{finger}"
            for number in (1, 2, 3):
                rows.append((f"{word}Hand{finger}{number}", above, f"{side}_{finger}{number}"))
                above = rows[-1][0]
    missing = [part for _, _, part in rows if part not in rig.roles and not part.endswith("0")]
    if missing:
        raise InputError(f"The rig lacks joints of BEAT's 47: {', '.join(missing)}. Use the 22 body joints instead.")
    joints = [rig.roles.get(part, rig.roles[f"{part[:1]}_Wrist"] if part.endswith("0") else -1) for _, _, part in rows]
    names = tuple(name for name, _, _ in rows)
    parents = tuple(names.index(above) if above else -1 for _, above, _ in rows)
    offsets = np.zeros((len(rows), 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            bone = person.places[joints[joint]] - person.places[joints[parent]]
            offsets[joint] = person.frames[joints[parent]].T @ bone
    ends = [(names.index("Neck1"), tip)] if (tip := person.tip(rig.roles["Head"])) is not None else []
    for name, _, part in rows:
        if part[-1:] == "3" and (tip := person.tip(rig.roles[part])) is not None:
            ends.append((names.index(name), tip))
    factor = rig.unit_factor
    return Skeleton((offsets * factor).astype(np.float32), names, parents, _scaled(sorted(ends), factor))


def upper_body_rig(rig: Rig) -> Rig:
    """:func:`upper_body_skeleton` as a target of retargeting.

    Its last joint, ``Neck1``, moves as the second neck joint of a rig that has two, as in BEAT, where the head does not
    turn against it; otherwise as the head.

    Raises:
        InputError: as of :func:`upper_body_skeleton`.
    """
    skeleton = upper_body_skeleton(rig)
    nods = len(rig.neck) < 2 and "Head" in rig.roles
    return find_rig(skeleton, name="the upper body", joints={"Head": "Neck1"} if nods else None)


class _Person:
    """A rig in its reference pose: positions and anatomical frames."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        world, parents = rig.rest_world, rig.skeleton.parents
        self.places = joint_places(world, np.asarray(rig.skeleton.offsets, np.float64), parents)
        self.world = world
        self.frames: Float[np.ndarray, "J 3 3"] = world @ rig.align
        self.body = self.frames[rig.roles["Chest"]]

    def hips(self) -> Float[np.ndarray, "3"]:
        """Position of the pelvis; the midpoint of the hips where no joint lies between them and the spine."""
        roles = self.rig.roles
        missing = [f"{s}_{p}" for s in "LR" for p in ("Hip", "Knee", "Ankle") if f"{s}_{p}" not in roles]
        if missing:
            raise InputError(f"The rig lacks {', '.join(missing)}: it gives no full body; give the joints by hand.")
        if roles.get("Pelvis", roles["Chest"]) != roles["Chest"]:
            return self.places[roles["Pelvis"]]
        return (self.places[roles["L_Hip"]] + self.places[roles["R_Hip"]]) / 2

    def tip(self, joint: int) -> tuple[float, float, float] | None:
        """Position of the farthest point below a joint, in its anatomical frame."""
        skeleton, below = self.rig.skeleton, {joint}
        points = []
        for other, parent in enumerate(skeleton.parents):
            if parent in below:
                below.add(other)
                points.append(self.places[other])
        points += [self.places[j] + self.world[j] @ np.asarray(end) for j, end in skeleton.ends if j in below]
        bones = [self.frames[joint].T @ (point - self.places[joint]) for point in points]
        far = max(bones, key=lambda bone: float(np.linalg.norm(bone)), default=np.zeros(3))
        x, y, z = far.tolist()
        return (x, y, z) if np.linalg.norm(far) > 1e-4 else None


def _scaled(ends, factor: float) -> tuple[tuple[int, tuple[float, float, float]], ...]:
    return tuple((joint, (x * factor, y * factor, z * factor)) for joint, (x, y, z) in ends)
