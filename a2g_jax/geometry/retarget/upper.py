"""Neck and head of rigs that name them as spines, such as Rigify's ``DEF-spine.004`` to ``DEF-spine.006``."""

import re
from collections.abc import Mapping

import numpy as np

from a2g_jax.geometry.body_joints import common_ancestor
from a2g_jax.geometry.joint_names import parse_name
from a2g_jax.geometry.skeleton import Skeleton


def neck_and_head(skeleton: Skeleton, roles: Mapping[str, int]) -> dict[str, int]:
    """``Neck`` and ``Head`` above the fork of the arms, where none has the name and the spine continues there.

    Empty elsewhere. Of two or more such joints the last is the head, and the others are the neck.

    Args:
        roles: joints by part, with both shoulders.
    """
    if "Head" in roles or "Neck" in roles:
        return {}
    parents, parsed = skeleton.parents, [parse_name(name) for name in skeleton.names]
    chest = common_ancestor(parents, roles["L_Shoulder"], roles["R_Shoulder"])
    arms = {_child(parents, roles[f"{side}_Shoulder"], chest) for side in "LR"}
    stem = _stem(parsed[chest].base)

    def continues(joint: int) -> bool:
        name = parsed[joint]
        return not (name.side or name.is_helper or name.is_leaf) and _stem(name.base) == stem

    below = [joint for joint, parent in enumerate(parents) if parent == chest and joint not in arms]
    below = [joint for joint in below if continues(joint)]
    if not below or not stem:
        return {}
    reach = _reach(skeleton)
    chain = [max(below, key=lambda joint: reach[joint])]
    while same := [joint for joint, parent in enumerate(parents) if parent == chain[-1] and continues(joint)]:
        chain.append(same[0])
    return {"Head": chain[-1]} if len(chain) == 1 else {"Head": chain[-1], "Neck": chain[0]}


def _stem(base: str) -> str:
    return re.sub(r"[0-9]+$", "", base)


def _reach(skeleton: Skeleton) -> list[float]:
    lengths = np.linalg.norm(np.asarray(skeleton.offsets, np.float64), axis=1)
    tips = {joint: float(np.linalg.norm(end)) for joint, end in skeleton.ends}
    reach = [tips.get(joint, 0.0) for joint in range(skeleton.joints)]
    for joint in range(skeleton.joints - 1, 0, -1):
        parent = skeleton.parents[joint]
        reach[parent] = max(reach[parent], reach[joint] + float(lengths[joint]))
    return [tip + float(length) for tip, length in zip(reach, lengths, strict=True)]


def _child(parents: tuple[int, ...], joint: int, above: int) -> int:
    """The child of ``above`` whose branch holds a joint; -1 if it does not hang below."""
    while joint >= 0 and parents[joint] != above:
        joint = parents[joint]
    return joint
