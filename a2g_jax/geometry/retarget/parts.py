"""Joints of a rig by body part: from their names, or else from the shape of the tree."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.body_joints import common_ancestor, path_up
from a2g_jax.geometry.joint_names import named_joints, parse_name
from a2g_jax.geometry.retarget.rest import trunk_axis
from a2g_jax.geometry.retarget.topology import joints_by_shape
from a2g_jax.geometry.retarget.upper import neck_and_head
from a2g_jax.geometry.skeleton import Skeleton

#: Parts without which there is nothing to retarget.
_NEEDED = tuple(f"{side}_{part}" for side in "LR" for part in ("Shoulder", "Elbow", "Wrist"))
_LIMBS = (("Shoulder", "Elbow", "Wrist", "Collar"), ("Hip", "Knee", "Ankle", "Foot"))


def find_parts(
    skeleton: Skeleton, name: str, given: Mapping[str, str]
) -> tuple[dict[str, int], list[tuple[str, ...]] | None]:
    """Joints of a rig by part.

    Args:
        name: what errors call the rig.
        given: parts named by hand, which come before what is found.

    Returns:
        The joints, and the limbs found by topology whose left and right may be exchanged (see :func:`assign_sides`);
        None instead of these where all parts were found by name.

    Raises:
        InputError: no two arms are found, or parts that contradict the tree.
    """
    fixed = {}
    for role, joint in given.items():
        if joint not in skeleton.names:
            raise InputError(f"{name}: has no joint {joint!r} for {role}; it has {', '.join(skeleton.names)}.")
        fixed[role] = skeleton.index(joint)
    taken = set(fixed.values())
    roles = {role: joint for role, joint in named_joints(skeleton.names).items() if joint not in taken} | fixed
    if "L_Shoulder" in roles and "R_Shoulder" in roles:
        roles = neck_and_head(skeleton, roles) | roles
    unsided = None
    if missing := [role for role in _NEEDED if role not in roles]:
        shape = joints_by_shape(skeleton)
        named = [role for role in _NEEDED if role in roles and not role.endswith("Wrist")]
        # Two fingers, brows or legs of a table are a pair of branches, too.
        if shape is None or not (named or "L_Hip" in shape):
            raise InputError(
                f"{name}: no human body: no {', no '.join(missing)} found, neither by names nor by the shape of the "
                f"tree; name the joints in the usual way or give them by hand. It has "
                f"{', '.join(skeleton.names[:30])}{' ...' if skeleton.joints > 30 else ''}."
            )
        roles, unsided = _with_names(shape, roles)
    _complete(skeleton, roles)
    for side in "LR":
        _check_chain(skeleton, roles, [f"{side}_Shoulder", f"{side}_Elbow", f"{side}_Wrist"], name)
        legs = [role for part in ("Hip", "Knee", "Ankle", "Foot") if (role := f"{side}_{part}") in roles]
        _check_chain(skeleton, roles, legs, name)
    return roles, unsided


def _with_names(shape: dict[str, int], named: dict[str, int]) -> tuple[dict[str, int], list[tuple[str, ...]]]:
    """Parts by topology, corrected by names where these exist, and the limbs whose side no name gives."""
    unsided: list[tuple[str, ...]] = []
    for parts in _LIMBS:
        votes = 0
        for side, other in ("LR", "RL"):
            for part in parts:
                joint = named.get(f"{side}_{part}")
                votes += (joint is not None) * (shape.get(f"{side}_{part}") == joint)
                votes -= (joint is not None) * (shape.get(f"{other}_{part}") == joint)
        if votes < 0:
            shape = _swapped(shape, parts)
        if votes == 0 and f"L_{parts[0]}" in shape:
            unsided.append(parts)
    return shape | named, unsided


def _swapped(roles: dict[str, int], parts: tuple[str, ...]) -> dict[str, int]:
    """The roles with left and right of a limb exchanged."""
    swap = {"L": "R", "R": "L"}
    changed = {f"{swap[s]}_{part}": roles[f"{s}_{part}"] for s in "LR" for part in parts if f"{s}_{part}" in roles}
    return {role: joint for role, joint in roles.items() if role[2:] not in parts} | changed


def _complete(skeleton: Skeleton, roles: dict[str, int]) -> None:
    """Add parts that follow from others: the chest, the pelvis, collars without a usual name."""
    parents = skeleton.parents
    roles["Chest"] = common_ancestor(parents, roles["L_Shoulder"], roles["R_Shoulder"])
    if "L_Hip" in roles and "R_Hip" in roles:
        fork = common_ancestor(parents, roles["L_Hip"], roles["R_Hip"])
        low = common_ancestor(parents, fork, roles["Chest"])
        pelvis = roles.get("Pelvis")
        if pelvis is None or any(path_up(parents, roles[part], pelvis) is None for part in ("Chest", "L_Hip", "R_Hip")):
            roles["Pelvis"] = low
    elif "Pelvis" in roles and path_up(parents, roles["Chest"], roles["Pelvis"]) is None:
        del roles["Pelvis"]
    for side in "LR":
        above = path_up(parents, roles[f"{side}_Shoulder"], roles["Chest"]) or []
        if roles.get(f"{side}_Collar") not in above:
            roles.pop(f"{side}_Collar", None)
            if above:
                roles[f"{side}_Collar"] = above[-1]
    for role in ("Neck", "Head"):
        if role in roles and path_up(parents, roles[role], roles["Chest"]) is None:
            # A neck below the fork of the arms is the chest by another name.
            del roles[role]


def _check_chain(skeleton: Skeleton, roles: dict[str, int], chain: list[str], name: str) -> None:
    for upper, lower in zip(chain, chain[1:], strict=False):
        if path_up(skeleton.parents, roles[lower], roles[upper]) is None:
            names = skeleton.names[roles[lower]], skeleton.names[roles[upper]]
            raise InputError(
                f"{name}: {lower} ({names[0]}) does not hang below {upper} ({names[1]}); give both by hand."
            )


def trunk_chains(skeleton: Skeleton, roles: dict[str, int]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Spine joints from the pelvis (exclusive) to the chest, and neck joints from there to the head (exclusive).

    Adds the part ``Neck`` to ``roles`` where no name gives it.
    """
    parents, chest = skeleton.parents, roles["Chest"]
    if "Pelvis" not in roles:
        spine = [chest]
        while parents[spine[-1]] >= 0:
            spine.append(parents[spine[-1]])
    elif roles["Pelvis"] == chest:
        spine = []
    else:
        spine = [chest, *(path_up(parents, chest, roles["Pelvis"]) or [])]
    neck = []
    if "Head" in roles:
        neck = path_up(parents, roles["Head"], chest) or []
    elif "Neck" in roles:
        neck = [roles["Neck"]]
        for joint, parent in enumerate(parents):
            if parent == neck[0] and parse_name(skeleton.names[joint]).base.startswith("neck"):
                neck.insert(0, joint)
    if neck and "Neck" in roles and roles["Neck"] in neck:
        # Joints between the fork of the arms and the joint named neck are spine.
        cut = neck.index(roles["Neck"]) + 1
        neck, spine = neck[:cut], [*neck[cut:], *spine]
    elif neck:
        roles["Neck"] = neck[-1]
    return tuple(reversed(spine)), tuple(reversed(neck))


def assign_sides(
    roles: dict[str, int], unsided: list[tuple[str, ...]], places: Float[np.ndarray, "J 3"], name: str
) -> dict[str, int]:
    """Parts with left and right exchanged where needed: toes point forward, and left is up times forward.

    Args:
        unsided: limbs whose side is unknown.
        places: joint positions in the reference pose.

    Raises:
        InputError: the rig has no toes.
    """
    feet = [s for s in "LR" if f"{s}_Foot" in roles and f"{s}_Ankle" in roles]
    if not feet:
        raise InputError(
            f"{name}: no human body, or one whose left side neither joint names nor toes show; give the joints by hand."
        )
    forward = sum((places[roles[f"{s}_Foot"]] - places[roles[f"{s}_Ankle"]] for s in feet), np.zeros(3))
    left = np.cross(trunk_axis(places, roles), forward)
    for parts in unsided:
        if left @ (places[roles[f"L_{parts[0]}"]] - places[roles[f"R_{parts[0]}"]]) < 0:
            roles = _swapped(roles, parts)
    return roles
