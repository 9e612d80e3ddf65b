"""Correspondence of the joints of two rigs."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.body_joints import path_up
from a2g_jax.geometry.joint_names import parse_name
from a2g_jax.geometry.retarget.match_table import body_frame_of, body_places, missing_parts, table
from a2g_jax.geometry.retarget.pairs import Pair, Share
from a2g_jax.geometry.retarget.rest import ankle_height
from a2g_jax.geometry.retarget.rig import Rig

#: Rigid segments: a joint between their two ends is a twist bone, which twists but does not bend.
_RIGID = {"Shoulder": "Elbow", "Elbow": "Wrist", "Hip": "Knee", "Knee": "Ankle"}
_NEXT = {**_RIGID, "Collar": "Shoulder", "Ankle": "Foot", "Wrist": "Middle1"}


@dataclass(frozen=True, eq=False)
class Match:
    """Correspondence of two rigs; :meth:`table` shows it."""

    source: Rig
    target: Rig
    pairs: tuple[Pair, ...]
    shares: tuple[Share, ...]
    scale: float
    """Target over source: leg length, or arm length where one of the two has no legs."""
    lift: float
    """Metres by which the target's hips are raised after scaling, so that its soles are where the source's are."""
    still: Float[np.ndarray, "K 3 3"] | None = None
    """Local rotations of the target's joints that nothing moves; None for those of its reference pose."""

    def table(self) -> str:
        """Text with a line for each target joint and one for the fingers of a hand: how they were matched."""
        return table(self.source, self.target, self.pairs, self.shares, self.scale, self.lift, self.bones())

    def warnings(self) -> list[str]:
        """Head, neck or hands that are not moved, a sentence each."""
        found = [f"the {what}: {text}" for what, rig in (("source", self.source), ("target", self.target))
                 for text in missing_parts(rig)]  # fmt: skip
        matched = {pair.target for pair in self.pairs}
        for role, label in (("Head", "head"), ("L_Wrist", "left hand"), ("R_Wrist", "right hand")):
            joint = self.target.roles.get(role)
            if joint is not None and joint not in matched and self.source.neck + self.source.spine:
                name = self.target.skeleton.names[joint]
                found.append(f"the target's {label} ({name}) has no match and stays at rest")
        return found

    def bones(self) -> list[tuple[str, tuple[int, int], tuple[int, int]]]:
        """Bones that both rigs have: the part, then (joint, joint below) in the source and in the target."""
        by_role = {pair.role: pair for pair in self.pairs if pair.role}
        found = []
        for role, pair in by_role.items():
            side, _, part = role.partition("_")
            below = _NEXT.get(part, f"{part[:-1]}{int(part[-1]) + 1}" if part[-1:].isdigit() else None)
            role_below = f"{side}_{below}" if part else {"Neck": "Head"}.get(role)
            if role_below in by_role:
                ends = by_role[role_below]
                start = self.source.roles.get(role, pair.source), self.target.roles.get(role, pair.target)
                found.append((role, (start[0], ends.source), (start[1], ends.target)))
        return found


def match_rigs(source: Rig, target: Rig) -> Match:
    """Match the joints of two rigs.

    Limbs, head, pelvis and fingers match by their part. Spines and necks match by order: first to first, last to last,
    the others by relative position. Twist bones of a limb match where both rigs have equally many; otherwise their
    rotation is added to that of the limb. Remaining joints match by equal names below matched joints. Target joints
    without a match are interpolated (spines, necks) or stay at rest below their parents (twist bones, fingers, leaf
    ends).

    Raises:
        InputError: the rigs have no arms in common.
    """
    pairs: dict[int, Pair] = {}
    used: set[int] = set()

    def add(target_joint: int, source_joint: int, role: str, how: str) -> None:
        if target_joint not in pairs and source_joint not in used:
            pairs[target_joint] = Pair(target_joint, source_joint, role, how)
            used.add(source_joint)

    found = "shape" if source.by_shape or target.by_shape else "name"
    for role in target.roles:
        if role not in source.roles or role in ("Chest", "Neck"):
            continue
        ours, theirs = _segment(target, role), _segment(source, role)
        if len(ours) == len(theirs):
            for at, (ours_joint, theirs_joint) in enumerate(zip(ours, theirs, strict=True)):
                add(ours_joint, theirs_joint, role if at == len(ours) - 1 else f"{role}, part {at + 1}", found)
        else:
            # The last twist bone has the rotation of the whole segment.
            add(ours[0], theirs[-1], role, found)
    shares = []
    for to, of, label, end in ((target.spine, source.spine, "Spine", -1), (target.neck, source.neck, "Neck", 0)):
        for at, (first, second) in enumerate(_counted(len(to), len(of), end)):
            add(to[first], of[second], label if label == "Neck" and at == 0 else f"{label}, {at + 1}", "order")
    _same_names(source, target, pairs, add)
    if not any(pair.role.endswith("_Elbow") for pair in pairs.values()):
        raise InputError("The two rigs have no arm in common; give the joints by hand.")
    lower = ([target.roles["Pelvis"]] if "Pelvis" in target.roles else []) + list(target.spine)
    upper = list(target.neck) + ([target.roles["Head"]] if "Head" in target.roles else [])
    for chain in (lower, upper):
        shares += _shares(chain, set(pairs))
    scale, lift = _scale(source, target)
    return Match(source, target, tuple(pairs.values()), tuple(shares), scale, lift)


def _segment(rig: Rig, role: str) -> list[int]:
    """The joint of a part and the twist bones between it and the next part."""
    side, _, part = role.partition("_")
    joint = rig.roles[role]
    below = rig.roles.get(f"{side}_{_RIGID.get(part)}")
    if below is None:
        return [joint]
    return [joint, *reversed(path_up(rig.skeleton.parents, below, joint) or [])]


def _counted(ours: int, theirs: int, single: int) -> list[tuple[int, int]]:
    """Pairs of indices into two chains, ends to ends; a chain of one is paired with index ``single`` of the other."""
    few, many = min(ours, theirs), max(ours, theirs)
    if few == 0:
        return []
    if few == 1:
        places = [(0, many - 1 if single == -1 else 0)]
    else:
        places = [(at, math.floor(at * (many - 1) / (few - 1) + 0.5)) for at in range(few)]
    return places if ours <= theirs else [(second, first) for first, second in places]


def _same_names(source: Rig, target: Rig, pairs: dict[int, Pair], add) -> None:
    names = [parse_name(name) for name in source.skeleton.names]
    where = {(name.side, name.base): joint for joint, name in reversed(list(enumerate(names)))}
    for joint, name in enumerate(target.skeleton.names):
        parsed = parse_name(name)
        other = where.get((parsed.side, parsed.base))
        if joint in pairs or other is None:
            continue
        ours = _matched_above(target.skeleton.parents, joint, set(pairs))
        theirs = _matched_above(source.skeleton.parents, other, {pair.source for pair in pairs.values()})
        if ours is not None and theirs is not None and pairs[ours].source == theirs:
            add(joint, other, "", "same name")


def _matched_above(parents: tuple[int, ...], joint: int, matched: set[int]) -> int | None:
    joint = parents[joint]
    while joint >= 0 and joint not in matched:
        joint = parents[joint]
    return joint if joint >= 0 else None


def _shares(chain: list[int], matched: set[int]) -> list[Share]:
    shares = []
    anchors = [at for at, joint in enumerate(chain) if joint in matched]
    for above, below in zip(anchors, anchors[1:], strict=False):
        for at in range(above + 1, below):
            weight = (at - above) / (below - above)
            shares.append(Share(chain[at], chain[above], chain[below], weight))
    return shares


def _scale(source: Rig, target: Rig) -> tuple[float, float]:
    rigs, parts = (source, target), ("Hip", "Knee", "Ankle")
    legs = all(f"{side}_{part}" in rig.roles for rig in rigs for side in "LR" for part in parts)
    parts = parts if legs else ("Shoulder", "Elbow", "Wrist")
    lengths = []
    for rig in rigs:
        places = body_places(rig)
        joints = [[rig.roles[f"{side}_{part}"] for part in parts] for side in "LR"]
        bones = [(a, b) for row in joints for a, b in zip(row, row[1:], strict=False)]
        lengths.append(sum(np.linalg.norm(places[b] - places[a]) for a, b in bones))
    if min(lengths) < 1e-9:
        raise InputError("A rig has limbs of zero length; its file has no offsets. Use a rig with bones.")
    scale = float(lengths[1] / lengths[0])
    if not legs:
        return scale, 0.0
    heights = [
        ankle_height(rig.skeleton, body_places(rig), body_frame_of(rig).T @ rig.rest_world, rig.roles) for rig in rigs
    ]
    return scale, heights[1] - scale * heights[0]
