"""Body parts from the shape of a joint tree, for rigs whose names give none.

A body is a tree with two pairs of similar branches: the legs at the pelvis and, above it, the arms at the chest, where
the neck begins as well. Within a limb, the two long bones are identified by their lengths. None of this depends on the
pose, except which side is the left one; that is left to the caller.
"""

import itertools

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.skeleton import Skeleton

#: Similar branches have equal joint counts, and lengths that differ by at most this share.
_ALIKE = 0.15
#: Upper arm over forearm, thigh over shin: human proportions (Winter 2009, Biomechanics and Motor Control, Fig. 4.1).
_ARM_RATIO, _LEG_RATIO = 1.2, 1.0


def joints_by_shape(skeleton: Skeleton) -> dict[str, int] | None:
    """Joints of a body from topology and bone lengths alone; None without two arms.

    Returns:
        Roles as :func:`~a2g_jax.geometry.joint_names.named_joints` gives them, without fingers. "L" and "R" are the
        two sides in arbitrary order.
    """
    tree = _Tree(skeleton)
    pairs = [(joint, pair) for joint in range(skeleton.joints) if (pair := tree.pair(joint)) is not None]
    found = _chest_and_legs(tree, pairs)
    if found is None:
        return None
    (chest, arms), legs = found
    roles: dict[str, int] = {}
    arm = _arm(tree, [tree.chain(child) for child in arms])
    if arm is None:
        return None
    for side, joints in zip("LR", arm, strict=True):
        roles |= {f"{side}_{part}": joint for part, joint in joints.items()}
    if legs is not None:
        pelvis, branches = legs
        roles["Pelvis"] = pelvis
        leg = _leg(tree, [tree.chain(child) for child in branches])
        if leg is None:
            return None
        for side, joints in zip("LR", leg, strict=True):
            roles |= {f"{side}_{part}": joint for part, joint in joints.items()}
    rest = [child for child in tree.children[chest] if child not in arms]
    if rest:
        roles |= _neck_and_head(tree, max(rest, key=lambda child: tree.reach[child]))
    return roles


class _Tree:
    def __init__(self, skeleton: Skeleton) -> None:
        self.parents = skeleton.parents
        self.lengths: Float[np.ndarray, " J"] = np.linalg.norm(np.asarray(skeleton.offsets, np.float64), axis=1)
        self.lengths[0] = 0.0
        self.children: list[list[int]] = [[] for _ in skeleton.parents]
        for joint, parent in enumerate(skeleton.parents[1:], start=1):
            self.children[parent].append(joint)
        self.ends = {joint: float(np.linalg.norm(end)) for joint, end in skeleton.ends}
        self.count, self.reach, self.total = (np.zeros(skeleton.joints) for _ in range(3))
        for joint in reversed(range(skeleton.joints)):
            below = self.children[joint]
            self.count[joint] = 1 + sum(self.count[child] for child in below)
            self.total[joint] = self.lengths[joint] + sum(self.total[child] for child in below)
            tip = max([self.reach[child] for child in below] + [self.ends.get(joint, 0.0)])
            self.reach[joint] = self.lengths[joint] + tip

    def pair(self, joint: int) -> tuple[int, int] | None:
        """The two largest similar branches of three joints or more below a joint, or None."""
        best = None
        for first, second in itertools.combinations(self.children[joint], 2):
            alike = self.count[first] == self.count[second] >= 3 and all(
                abs(value[first] - value[second]) <= _ALIKE * max(value[first], value[second])
                for value in (self.reach, self.total)
            )
            if alike and (best is None or self.reach[first] > self.reach[best[0]]):
                best = (first, second)
        return best

    def chain(self, joint: int) -> list[int]:
        """The joint and those below it along the longest branch, up to the fork of a hand or the end."""
        path = [joint]
        while self.children[path[-1]]:
            below = self.children[path[-1]]
            if len([child for child in below if self.reach[child] > 0.02 * self.reach[joint]]) >= 3:
                break
            path.append(max(below, key=lambda child: self.reach[child]))
        return path

    def spans(self, chain: list[int]) -> Float[np.ndarray, " n"]:
        """Distance of each joint of a chain from its first, along the bones."""
        return np.cumsum([0.0] + [self.lengths[joint] for joint in chain[1:]])


def _chest_and_legs(tree: _Tree, pairs):
    """Of all joints with similar branches, the parent of the arms and, above it, that of the legs."""

    def above(joint: int, other: int) -> bool:
        while other > joint:
            other = tree.parents[other]
        return other == joint

    longest = max((tree.reach[pair[0]] for _, pair in pairs), default=0.0)
    # Fingers, eyes and toes are short: limbs have at least half the reach of the longest limb.
    limbs = [(joint, pair) for joint, pair in pairs if tree.reach[pair[0]] >= 0.45 * longest]
    for first, second in itertools.permutations(limbs, 2):
        within = any(above(child, second[0]) for child in first[1])
        if first[0] != second[0] and above(first[0], second[0]) and not within:
            return second, first
    return (limbs[0], None) if len(limbs) == 1 else None


def _two_bones(tree: _Tree, chains: list[list[int]], ratio: float, least_tail: int) -> tuple[int, int, int] | None:
    """Indices in a chain of the joints above, between and below its two long bones, the same on both sides."""
    count = min(len(chain) for chain in chains)
    spans = [tree.spans(chain) for chain in chains]
    best, choice = np.inf, None
    for top, middle, tip in itertools.combinations(range(count - least_tail), 3):
        cost = 0.0
        for span in spans:
            upper, lower, whole = span[middle] - span[top], span[tip] - span[middle], span[-1]
            if min(upper, lower) < 0.2 * whole:
                cost = np.inf
                break
            cost += abs(np.log(upper / lower / ratio)) + 1.5 * (1 - (upper + lower) / whole)
        if cost < best - 1e-9:
            best, choice = cost, (top, middle, tip)
    return choice


def _arm(tree: _Tree, chains: list[list[int]]) -> list[dict[str, int]] | None:
    count = min(len(chain) for chain in chains)
    # The first joint is the collar wherever the arm has more than three.
    chains = [chain[:count] for chain in chains]
    fork = [len(tree.children[chain[-1]]) >= 3 for chain in chains]
    first = 1 if count > 3 else 0
    places = _two_bones(tree, [chain[first:] for chain in chains], _ARM_RATIO, 0)
    if places is None:
        return None
    top, middle, tip = (place + first for place in places)
    if all(fork):
        tip = count - 1
    arms = []
    for chain in chains:
        arm = {"Shoulder": chain[top], "Elbow": chain[middle], "Wrist": chain[tip]}
        if top > 0:
            arm["Collar"] = chain[0]
        arms.append(arm)
    return arms


def _leg(tree: _Tree, chains: list[list[int]]) -> list[dict[str, int]] | None:
    places = _two_bones(tree, chains, _LEG_RATIO, 0)
    if places is None:
        return None
    legs = []
    for chain in chains:
        leg = dict(zip(("Hip", "Knee", "Ankle"), (chain[place] for place in places), strict=True))
        toe = next((joint for joint in chain[places[2] + 1 :] if tree.lengths[joint] > 1e-4), None)
        if toe is not None:
            leg["Foot"] = toe
        legs.append(leg)
    return legs


def _neck_and_head(tree: _Tree, joint: int) -> dict[str, int]:
    chain = tree.chain(joint)
    last = chain[-1]
    # A leaf without length marks the top of the head; eyes and a jaw are children of the head.
    if len(chain) >= 3 and not tree.children[last] and tree.ends.get(last, 0.0) < 1e-4:
        chain = chain[:-1]
    if len(chain) == 1:
        return {"Head": chain[0]}
    return {"Neck": chain[0], "Head": chain[-1]}
