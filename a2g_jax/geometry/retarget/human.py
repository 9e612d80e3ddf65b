"""Is it a human body? Animals have arms and legs by name, too, but carry their trunk across their legs."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.joint_names import parse_name
from a2g_jax.geometry.retarget.poses import angle_between, unit
from a2g_jax.geometry.retarget.topology import joints_by_shape
from a2g_jax.geometry.skeleton import Skeleton

#: Degrees between trunk and legs in the median of a motion: standing people have up to 40, seated ones 50, four-legged
#: animals 90. With a tail, a smaller angle suffices.
_ACROSS, _ACROSS_WITH_TAIL = 65.0, 50.0
#: Height of the wrists over the ankles along the legs, as a share of their length: 0 to 0.3 for four legs, 0.6 to 1.7
#: for people. The trunk of a person on the floor with straight legs is across them, and the wrists are in between.
_FOUR_LEGS, _TWO_LEGS = 0.55, 1.15
#: Arm over leg; people have 0.68.
_ARM_TO_LEG = (0.2, 2.0)
_TAIL_JOINTS = 3


def check_human(skeleton: Skeleton, roles: Mapping[str, int], places: Float[np.ndarray, "N J 3"], name: str) -> None:
    """Raise an ``InputError`` for the motion of an animal.

    Args:
        roles: joints by part.
        places: positions of the joints in some frames.
        name: what the error calls the rig.
    """
    legs = {role: roles[role] for side in "LR" for part in ("Hip", "Knee", "Ankle")
            if (role := f"{side}_{part}") in roles}  # fmt: skip
    if len(legs) < 6:
        shape = joints_by_shape(skeleton)
        legs = {role: joint for role, joint in (shape or {}).items() if role[2:] in ("Hip", "Knee", "Ankle")}
        if len(legs) < 6 or set(legs.values()) & set(roles.values()) - {roles.get(role) for role in legs}:
            return

    def of(part: str, joints: Mapping[str, int]) -> Float[np.ndarray, "N 3"]:
        return (places[:, joints[f"L_{part}"]] + places[:, joints[f"R_{part}"]]) / 2

    hips, ankles, shoulders, wrists = of("Hip", legs), of("Ankle", legs), of("Shoulder", roles), of("Wrist", roles)
    down = unit(ankles - hips)
    leg = sum(_bones(places, legs, ("Hip", "Knee", "Ankle")))
    arm = sum(_bones(places, roles, ("Shoulder", "Elbow", "Wrist")))
    if leg < 1e-6 or arm < 1e-6:
        return
    across = float(np.median(angle_between(shoulders - hips, -down)))
    height = float(np.median(np.sum((ankles - wrists) * down, axis=-1))) / leg
    tail = _has_tail(skeleton)
    if across > (_ACROSS_WITH_TAIL if tail else _ACROSS) and not _FOUR_LEGS < height < _TWO_LEGS:
        what = "walks on four legs" if height <= _FOUR_LEGS else "has a level trunk"
        raise InputError(
            f"{name}: no human body: it {what}{' and has a tail' if tail else ''} (its trunk is at {across:.0f} degrees"
            " to its legs). Is it an animal?"
        )
    if not _ARM_TO_LEG[0] < arm / leg < _ARM_TO_LEG[1]:
        raise InputError(f"{name}: no human body: its arms are {arm / leg:.2f} times as long as its legs.")


def _bones(places: Float[np.ndarray, "N J 3"], joints: Mapping[str, int], chain: tuple[str, ...]) -> list[float]:
    """Mean lengths of the bones of a limb, of both sides."""
    lengths = []
    for start, end in zip(chain, chain[1:], strict=False):
        bones = [places[0, joints[f"{side}_{end}"]] - places[0, joints[f"{side}_{start}"]] for side in "LR"]
        lengths.append(float(np.linalg.norm(bones, axis=-1).mean()))
    return lengths


def _has_tail(skeleton: Skeleton) -> bool:
    names = [parse_name(name).base for name in skeleton.names]
    others = ("pony", "pig", "coat", "hair")
    return len([base for base in names if "tail" in base and not any(word in base for word in others)]) >= _TAIL_JOINTS
