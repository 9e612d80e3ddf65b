"""Keeping some joints of a motion: the others are folded into those that stay."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton

Matrices = Float[np.ndarray, "... 3 3"]


def select_joints(motion: Motion, joints: Sequence[int]) -> Motion:
    """The motion of a subset of joints, whose orientations in the world stay exactly what they were.

    A dropped joint between two kept ones passes its rotation on to the lower one; its bone keeps its mean direction,
    so positions below it can differ a little (for the second neck joint of BEAT by millimetres). Names stay those of
    the rig, so the result animates it. The farthest dropped joint below each kept leaf (finger tip, top of the head)
    becomes its end site.

    Args:
        joints: indices of the joints to keep: first the one that becomes the root, then joints below it, each after
            its parent in the new tree.
    """
    skeleton = motion.skeleton
    kept = {joint: new for new, joint in enumerate(joints)}
    if not joints or len(kept) != len(joints):
        raise ValueError(f"Expected distinct joints with the root first; got {list(joints)}.")
    rotations = np.asarray(motion.rotations)
    offsets = np.asarray(skeleton.offsets)
    orientation, place = _in_world(motion, joints[0])
    parents, new_offsets, new_rotations = [-1], [offsets[joints[0]]], [orientation]
    for joint in joints[1:]:
        chain = _chain_to_kept(skeleton, joint, kept)
        rotation = rotations[:, joint]
        offset = offsets[joint]
        for dropped in chain[1:-1]:
            offset = offsets[dropped] + _mean_rotation(rotations[:, dropped]) @ offset
            rotation = rotations[:, dropped] @ rotation
        parents.append(kept[chain[-1]])
        new_offsets.append(offset)
        new_rotations.append(rotation)
    selected = Skeleton(
        offsets=np.stack(new_offsets).astype(np.float32),
        names=tuple(skeleton.names[joint] for joint in joints),
        parents=tuple(parents),
        ends=_ends(skeleton, joints),
    )
    return replace(motion, rotations=np.stack(new_rotations, axis=1), root=place, skeleton=selected)


def _in_world(motion: Motion, joint: int) -> tuple[Float[np.ndarray, "T 3 3"], Float[np.ndarray, "T 3"]]:
    """Orientation and position of one joint in the world."""
    skeleton = motion.skeleton
    path = []
    while joint > 0:
        path.append(joint)
        joint = skeleton.parents[joint]
    orientation, place = np.asarray(motion.rotations)[:, 0], np.asarray(motion.root)
    for below in reversed(path):
        place = place + orientation @ np.asarray(skeleton.offsets)[below]
        orientation = orientation @ np.asarray(motion.rotations)[:, below]
    return orientation, place


def _chain_to_kept(skeleton: Skeleton, joint: int, kept: dict[int, int]) -> list[int]:
    """The joint, the dropped joints above it, and the first kept one."""
    chain = [joint, skeleton.parents[joint]]
    while chain[-1] >= 0 and chain[-1] not in kept:
        chain.append(skeleton.parents[chain[-1]])
    if chain[-1] < 0 or kept[chain[-1]] >= kept[joint]:
        raise ValueError(
            f"Expected the root first and parents before children; {skeleton.names[joint]} is out of order."
        )
    return chain


def _mean_rotation(rotations: Float[np.ndarray, "T 3 3"]) -> Float[np.ndarray, "3 3"]:
    """Chordal mean: the rotation nearest to the average matrix."""
    u, _, vt = np.linalg.svd(rotations.mean(axis=0))
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def _ends(skeleton: Skeleton, joints: Sequence[int]) -> tuple[tuple[int, tuple[float, float, float]], ...]:
    """For every kept joint without kept children, the farthest point of the rig below it, at rest."""
    offsets = np.asarray(skeleton.offsets, np.float64)
    kept = {joint: new for new, joint in enumerate(joints)}
    owner, place = list(range(skeleton.joints)), np.zeros((skeleton.joints, 3))
    for joint in range(skeleton.joints):
        if joint not in kept and joint > 0:
            parent = skeleton.parents[joint]
            owner[joint], place[joint] = owner[parent], place[parent] + offsets[joint]
    inner = {owner[skeleton.parents[joint]] for joint in joints[1:]}
    points = [(owner[joint], place[joint]) for joint in range(skeleton.joints)]
    points += [(owner[joint], place[joint] + np.asarray(end)) for joint, end in skeleton.ends]
    far: dict[int, np.ndarray] = {}
    for joint, point in points:
        if (
            joint in kept
            and joint not in inner
            and np.linalg.norm(point) > np.linalg.norm(far.get(joint, np.zeros(3))) + 1e-9
        ):
            far[joint] = point
    return tuple((kept[joint], (float(p[0]), float(p[1]), float(p[2]))) for joint, p in sorted(far.items()))
