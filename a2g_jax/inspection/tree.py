"""The body of a motion: a skeleton, as a drawn tree, or points and bones."""

from typing import Any

import numpy as np

from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.retarget.rig import Rig
from a2g_jax.geometry.skeleton import Skeleton

#: Hands with more joints below the wrist are one line.
_FOLD = 3


def skeleton_facts(skeleton: Skeleton, rig: Rig | None = None) -> dict[str, Any]:
    """Joints with parents, bone lengths in centimetres and the parts of a body."""
    part_of: dict[int, str] = {}
    facts: dict[str, Any] = {"count": skeleton.joints}
    if rig is not None:
        part_of = {joint: role for role, joint in rig.roles.items()}
        for label, chain in (("Spine", rig.spine), ("Neck", rig.neck)):
            for number, joint in enumerate(chain, start=1):
                part_of.setdefault(joint, f"{label} {number}")
        facts |= {"up": rig.up, "height (m)": round(rig.height * rig.unit_factor, 3), "found": list(rig.notes)}
        facts["parts"] = f"{len(rig.roles)} by {'shape of the tree' if rig.by_shape else 'name'}"
    lengths = 100 * np.linalg.norm(np.asarray(skeleton.offsets, np.float64), axis=1)
    ends = {joint for joint, _ in skeleton.ends}
    facts["joints"] = [
        {"name": name, "parent": parent, "bone_cm": round(float(length), 2), "part": part_of.get(joint, ""),
         "end": joint in ends}
        for joint, (name, parent, length) in enumerate(zip(skeleton.names, skeleton.parents, lengths, strict=True))
    ]  # fmt: skip
    return facts


def body_facts(body: Skeleton | PoseLayout, rig: Rig | None = None) -> dict[str, Any]:
    """The section of a report on the body: ``skeleton``, or ``points`` where poses are keypoints or directions."""
    if isinstance(body, Skeleton):
        return {"skeleton": skeleton_facts(body, rig)}
    points: dict[str, Any] = {
        "names": list(body.names),
        "bones": [f"{body.names[start]}-{body.names[end]}" for start, end in body.bones],
    }
    if body.lengths:
        points["bone lengths (cm)"] = [round(100 * length, 2) for length in body.lengths]
    return {"points": points}


def draw_tree(facts: dict[str, Any]) -> list[str]:
    """One line per joint: branch, name, bone length, part of the body; the joints below a hand share a line."""
    joints = facts["joints"]
    children: dict[int, list[int]] = {}
    for joint, entry in enumerate(joints):
        children.setdefault(entry["parent"], []).append(joint)
    rows: list[tuple[str, str, str]] = []
    stack = [(0, "", "", "")]
    while stack:
        joint, before, branch, indent = stack.pop()
        entry = joints[joint]
        length = f"{entry['bone_cm']:.1f} cm" if joint else ""
        rows.append((before + branch + entry["name"], length, entry["part"]))
        below = children.get(joint, [])
        if entry["part"] in ("L_Wrist", "R_Wrist") and (count := _count(children, joint)) > _FOLD:
            rows.append((f"{indent}└─ {count} joints of the hand", "", ""))
            continue
        for number, child in reversed(list(enumerate(below))):
            last = number == len(below) - 1
            stack.append((child, indent, "└─ " if last else "├─ ", indent + ("   " if last else "│  ")))
    width, numbers = max(len(row[0]) for row in rows), max(len(row[1]) for row in rows)
    return [f"{name.ljust(width)}  {length.rjust(numbers)}  {part}".rstrip() for name, length, part in rows]


def _count(children: dict[int, list[int]], joint: int) -> int:
    """Number of joints below one."""
    return sum(1 + _count(children, child) for child in children.get(joint, []))
