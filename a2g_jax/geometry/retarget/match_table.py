"""A match of two rigs as text, and what it leaves out."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.retarget.pairs import Pair, Share
from a2g_jax.geometry.retarget.poses import angle_between, joint_places
from a2g_jax.geometry.retarget.rig import Rig

#: A part with (joint, joint below) in the source and in the target.
Bone = tuple[str, tuple[int, int], tuple[int, int]]
_Row = tuple[str, str, str, str, str, str]
#: Hands with more joints below the wrist are one row.
_FOLD = 3


def table(
    source: Rig,
    target: Rig,
    matched: Sequence[Pair],
    shares: Sequence[Share],
    scale: float,
    lift: float,
    bones: Sequence[Bone],
) -> str:
    """Text with a line for each target joint: source joints, part, how matched, angle at rest, ratio of bone lengths.

    The joints below a hand share a line.
    """
    rows: list[_Row] = [("source", "target", "part", "found by", "rest angle", "length")]
    matched_sources = {pair.source for pair in matched}
    pairs = {pair.target: pair for pair in matched}
    shared = {share.target: share for share in shares}
    hands = {joint: side for side in "LR" for joint in below_wrist(target, side)}
    for joint in sorted(pairs):
        if joint in hands:
            continue
        pair = pairs[joint]
        composed = _composed(source.skeleton.parents, pair.source, matched_sources)
        names = "+".join(source.skeleton.names[one] for one in composed)
        angle, ratio = _bone(source, target, bones, pair)
        rows.append((names, target.skeleton.names[joint], pair.role, pair.how, angle, ratio))
    for side in "LR":
        if joints := [joint for joint, owner in hands.items() if owner == side]:
            rows.append(_hand_row(target, side, joints, pairs))
    for joint, name in enumerate(target.skeleton.names):
        if joint in shared:
            rows.append(("-", name, "", f"share {shared[joint].weight:.2f}", "", ""))
        elif joint not in pairs and joint not in hands:
            rows.append(("-", name, "", "at rest", "", ""))
    widths = [max(len(row[column]) for row in rows) for column in range(6)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    for what, rig in (("source", source), ("target", target)):
        lines.append(f"{what}: {'parts by shape; ' if rig.by_shape else ''}{'; '.join(rig.notes)}")
    lines.append(f"lengths times {scale:.3f}, hips raised by {100 * lift:.1f} cm")
    return "\n".join(lines)


def below_wrist(rig: Rig, side: str) -> list[int]:
    """Joints below a hand; none if there are only a few."""
    inside, wrist = {rig.roles[f"{side}_Wrist"]}, rig.roles[f"{side}_Wrist"]
    for joint, parent in enumerate(rig.skeleton.parents):
        if parent in inside:
            inside.add(joint)
    return sorted(inside - {wrist}) if len(inside) > _FOLD + 1 else []


def missing_parts(rig: Rig) -> list[str]:
    """Neck and head where they are not found, a sentence each."""
    if "Head" in rig.roles:
        return []
    if not rig.neck:
        return ["no neck and no head are found in it, so both stay at rest"]
    last = rig.neck[-1]
    unknown = [name for name, parent in zip(rig.skeleton.names, rig.skeleton.parents, strict=True) if parent == last]
    if not unknown or len(rig.neck) > 1:
        return []
    return [f"no head is found above {rig.skeleton.names[last]} (which has {', '.join(unknown[:3])})"]


def _hand_row(target: Rig, side: str, joints: list[int], pairs: dict[int, Pair]) -> _Row:
    names = target.skeleton.names
    found = [pairs[joint] for joint in joints if joint in pairs]
    how = [f"{kind} ({count})" for kind, count in Counter(pair.how for pair in found).items()]
    if len(found) < len(joints):
        how.append(f"at rest ({len(joints) - len(found)})")
    source = f"{len(found)} joints" if found else "-"
    wrist = names[target.roles[f"{side}_Wrist"]]
    return (source, f"{len(joints)} joints below {wrist}", f"{side} fingers", ", ".join(how), "", "")


def _bone(source: Rig, target: Rig, bones: Sequence[Bone], pair: Pair) -> tuple[str, str]:
    for role, (s0, s1), (t0, t1) in bones:
        if role == pair.role:
            first, second = body_places(source), body_places(target)
            theirs, ours = first[s1] - first[s0], second[t1] - second[t0]
            if np.linalg.norm(theirs) < 1e-6 or np.linalg.norm(ours) < 1e-6:
                return "", ""
            return f"{angle_between(theirs, ours):.1f}", f"{np.linalg.norm(ours) / np.linalg.norm(theirs):.2f}"
    return "", ""


def _composed(parents: tuple[int, ...], joint: int, matched: set[int]) -> list[int]:
    """The joint and the unmatched ones above it, whose rotations it includes, from above."""
    joints = [joint]
    while parents[joints[0]] >= 0 and parents[joints[0]] not in matched:
        joints.insert(0, parents[joints[0]])
    return joints


def body_frame_of(rig: Rig) -> Float[np.ndarray, "3 3"]:
    """``R_rest_body``, which is the anatomical frame of any joint of the trunk at rest."""
    chest = rig.roles["Chest"]
    return rig.rest_world[chest] @ rig.align[chest]


def body_places(rig: Rig) -> Float[np.ndarray, "J 3"]:
    """Positions in the reference pose, in the body frame."""
    offsets = np.asarray(rig.skeleton.offsets, np.float64)
    return joint_places(rig.rest_world, offsets, rig.skeleton.parents) @ body_frame_of(rig)
