"""Mirroring: the same motion with left and right exchanged.

With ``F`` the reflection of the world across the person's plane of symmetry through the origin, ``K = diag(-1, 1, 1)``
the same in a body frame, ``m(j)`` the partner of joint ``j`` on the other side (itself in the middle of the body) and
``A`` the constant ``R_joint_anatomy`` of :mod:`a2g_jax.geometry.retarget.rest`,

    R_world_j(mirrored) = F @ R_world_m(j) @ A_m(j) @ K @ A_j^T.

Two reflections make a rotation, and mirroring twice gives the motion back, whatever the local axes of the two sides.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.joint_names import parse_name
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import world_rotations
from a2g_jax.geometry.retarget.rig import Rig, find_rig
from a2g_jax.geometry.skeleton import Skeleton

#: The mirror in a body frame, K.
FLIP = np.diag([-1.0, 1.0, 1.0])


def mirror(motion: Motion, rig: Rig | None = None, *, keep_skeleton: bool = True) -> Motion:
    """The mirrored motion: left and right exchanged, the root path reflected across the plane through the origin.

    Args:
        motion: on any humanoid rig.
        rig: that rig, if found before.
        keep_skeleton: keep the same skeleton: orientations are mirrored exactly, positions as far as both sides have
            equal bones. False mirrors the skeleton too, and positions exactly.

    Raises:
        InputError: the rig is not recognised, or a joint has no partner on the other side.
    """
    rig = find_rig(motion, name="the motion") if rig is None else rig
    if not motion.skeleton.same_tree(rig.skeleton):
        raise InputError(
            "The motion and the rig to mirror it with have different skeletons; find the rig in this motion."
        )
    partner = list(mirror_pairs(rig))
    across = rig.world[:, 0]
    reflect = np.eye(3) - 2 * np.outer(across, across)
    parents, align = rig.skeleton.parents, rig.align
    onto = (align[partner] @ FLIP @ np.swapaxes(align, -1, -2)).astype(np.float32)
    world = world_rotations(np.asarray(motion.rotations, np.float32), parents)
    world = reflect.astype(np.float32) @ (world[:, partner] @ onto)
    rotations = world.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            rotations[:, joint] = np.swapaxes(world[:, parent], -1, -2) @ world[:, joint]
    root = (np.asarray(motion.root, np.float64) @ reflect).astype(np.float32)
    skeleton = motion.skeleton if keep_skeleton else _mirrored_skeleton(motion.skeleton, rig, partner)
    return replace(motion, rotations=rotations, root=root, skeleton=skeleton)


def mirror_pairs(rig: Rig) -> tuple[int, ...]:
    """The joint on the other side of every joint, itself in the middle.

    By part, then by name, then by the positions of the children of paired joints.

    Raises:
        InputError: a joint has no partner; the message names it.
    """
    skeleton, count = rig.skeleton, rig.skeleton.joints
    swap = {"L": "R", "R": "L"}
    partner = [-1] * count
    for role, joint in rig.roles.items():
        opposite = swap[role[0]] + role[1:] if role[:2] in ("L_", "R_") else role
        if opposite in rig.roles:
            partner[joint] = rig.roles[opposite]
    for middle in (*rig.spine, *rig.neck, 0):
        partner[middle] = middle
    names = [parse_name(name) for name in skeleton.names]
    where = {(name.side, name.base): joint for joint, name in reversed(list(enumerate(names)))}
    offsets = np.asarray(skeleton.offsets, np.float64)
    for joint, parent in enumerate(skeleton.parents):
        if partner[joint] >= 0:
            continue
        other = where.get((swap.get(names[joint].side, ""), names[joint].base), -1)
        if rig.by_shape or other < 0 or skeleton.parents[other] != partner[parent]:
            other = _opposite(rig, offsets, joint, partner)
        if other < 0:
            raise InputError(
                f"Joint {skeleton.names[joint]} has no partner on the other side; the rig cannot be mirrored."
            )
        partner[joint] = other
    for joint, parent in enumerate(skeleton.parents):
        wrong = partner[partner[joint]] != joint
        if wrong or (parent >= 0 and partner[parent] != skeleton.parents[partner[joint]]):
            raise InputError(
                f"Joint {skeleton.names[joint]} and {skeleton.names[partner[joint]]} on the other side hang from "
                "joints that are not partners; the rig cannot be mirrored."
            )
    return tuple(partner)


def _opposite(rig: Rig, offsets: Float[np.ndarray, "J 3"], joint: int, partner: list[int]) -> int:
    """The child of the parent's partner that is nearest to the mirror image of a joint."""
    parents = rig.skeleton.parents
    above = parents[joint]
    other = partner[above]
    image = rig.align[other] @ FLIP @ rig.align[above].T @ offsets[joint]
    taken = {near for near in partner if near >= 0}
    children = [child for child, parent in enumerate(parents) if parent == other and child not in taken]
    return min(children, key=lambda child: float(np.linalg.norm(offsets[child] - image)), default=-1)


def _mirrored_skeleton(skeleton: Skeleton, rig: Rig, partner: list[int]) -> Skeleton:
    align, offsets = rig.align, np.asarray(skeleton.offsets, np.float64)
    result = offsets.copy()
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            result[joint] = align[parent] @ FLIP @ align[partner[parent]].T @ offsets[partner[joint]]
    ends = []
    for owner, end in skeleton.ends:
        joint = partner[owner]
        x, y, z = (align[joint] @ FLIP @ align[owner].T @ np.asarray(end)).tolist()
        ends.append((joint, (x, y, z)))
    return replace(skeleton, offsets=result.astype(np.float32), ends=tuple(sorted(ends)))
