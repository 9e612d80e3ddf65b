"""A match of two rigs as text, and what it leaves out."""

from collections import Counter

import numpy as np

from a2g_jax.geometry.retarget.match import Match, Pair, body_places
from a2g_jax.geometry.retarget.poses import angle_between
from a2g_jax.geometry.retarget.rig import Rig

_Row = tuple[str, str, str, str, str, str]
#: Hands with more joints below the wrist are one row.
_FOLD = 3


def table(match: Match) -> str:
    """Text with a line for each target joint: source joints, part, how matched, angle at rest, ratio of bone lengths.

    The joints below a hand share a line.
    """
    rows: list[_Row] = [("source", "target", "part", "found by", "rest angle", "length")]
    matched_sources = {pair.source for pair in match.pairs}
    pairs = {pair.target: pair for pair in match.pairs}
    shared = {share.target: share for share in match.shares}
    hands = {joint: side for side in "LR" for joint in below_wrist(match.target, side)}
    for joint in sorted(pairs):
        if joint in hands:
            continue
        pair = pairs[joint]
        composed = _composed(match.source.skeleton.parents, pair.source, matched_sources)
        names = "+".join(match.source.skeleton.names[one] for one in composed)
        angle, ratio = _bone(match, pair)
        rows.append((names, match.target.skeleton.names[joint], pair.role, pair.how, angle, ratio))
    for side in "LR":
        if joints := [joint for joint, owner in hands.items() if owner == side]:
            rows.append(_hand_row(match, side, joints, pairs))
    for joint, name in enumerate(match.target.skeleton.names):
        if joint in shared:
            rows.append(("-", name, "", f"share {shared[joint].weight:.2f}", "", ""))
        elif joint not in pairs and joint not in hands:
            rows.append(("-", name, "", "at rest", "", ""))
    widths = [max(len(row[column]) for row in rows) for column in range(6)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    for what, rig in (("source", match.source), ("target", match.target)):
        lines.append(f"{what}: {'parts by shape; ' if rig.by_shape else ''}{'; '.join(rig.notes)}")
    lines.append(f"lengths times {match.scale:.3f}, hips raised by {100 * match.lift:.1f} cm")
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


def match_warnings(match: Match) -> list[str]:
    """Head, neck or hands that are not moved, a sentence each."""
    found = [f"the {what}: {text}" for what, rig in (("source", match.source), ("target", match.target))
             for text in missing_parts(rig)]  # fmt: skip
    matched = {pair.target for pair in match.pairs}
    for role, label in (("Head", "head"), ("L_Wrist", "left hand"), ("R_Wrist", "right hand")):
        joint = match.target.roles.get(role)
        if joint is not None and joint not in matched and match.source.neck + match.source.spine:
            found.append(f"the target's {label} ({match.target.skeleton.names[joint]}) has no match and stays at rest")
    return found


def _hand_row(match: Match, side: str, joints: list[int], pairs: dict[int, Pair]) -> _Row:
    names = match.target.skeleton.names
    found = [pairs[joint] for joint in joints if joint in pairs]
    how = [f"{kind} ({count})" for kind, count in Counter(pair.how for pair in found).items()]
    if len(found) < len(joints):
        how.append(f"at rest ({len(joints) - len(found)})")
    source = f"{len(found)} joints" if found else "-"
    wrist = names[match.target.roles[f"{side}_Wrist"]]
    return (source, f"{len(joints)} joints below {wrist}", f"{side} fingers", ", ".join(how), "", "")


def _bone(match: Match, pair: Pair) -> tuple[str, str]:
    for role, (s0, s1), (t0, t1) in match.bones():
        if role == pair.role:
            first = body_places(match.source)
            second = body_places(match.target)
            source, target = first[s1] - first[s0], second[t1] - second[t0]
            if np.linalg.norm(source) < 1e-6 or np.linalg.norm(target) < 1e-6:
                return "", ""
            ratio = np.linalg.norm(target) / np.linalg.norm(source)
            return f"{angle_between(source, target):.1f}", f"{ratio:.2f}"
    return "", ""


def _composed(parents: tuple[int, ...], joint: int, matched: set[int]) -> list[int]:
    """The joint and the unmatched ones above it, whose rotations it includes, from above."""
    joints = [joint]
    while parents[joints[0]] >= 0 and parents[joints[0]] not in matched:
        joints.insert(0, parents[joints[0]])
    return joints
