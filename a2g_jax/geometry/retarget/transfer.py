"""Retargeting a motion from one rig to another.

With the frames of :mod:`~a2g_jax.geometry.retarget.rest`, a joint ``t`` of the target copies the pose of its partner
``s`` in the source by

    R_world_t(time) = W @ R_world_s(time) @ A_s @ A_t^T,

where ``A`` is ``R_joint_anatomy`` of either and ``W = R_targetworld_body @ R_sourceworld_body^T`` turns the source's
world into the target's (Z-up to Y-up, say). Bones keep direction and roll, because whole orientations are copied and
not only directions. Retargeting back is the inverse, exact for every matched joint. Positions follow from the hips
``h``: ``h_target = scale * W @ h_source + lift * up``, with the scale of the legs, so that feet standing still do so on
the target too, as far as the proportions of the legs agree.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.match import Match, match_rigs
from a2g_jax.geometry.retarget.poses import between, joint_places, world_rotations
from a2g_jax.geometry.retarget.rig import Rig, find_rig
from a2g_jax.geometry.skeleton import Skeleton


def retarget(motion: Motion, target: Rig | Skeleton | Match, *, source: Rig | None = None) -> Motion:
    """The motion on another skeleton, in the world of that skeleton (its vertical axis, its forward).

    Example:
        >>> import a2g_jax
        >>> motion = a2g_jax.talk(2.0, seed=1).motion
        >>> character = a2g_jax.talk(2.0, seed=2, fingers=True).motion  # or a2g_jax.read_bvh("character.bvh")
        >>> match = a2g_jax.match_rigs(a2g_jax.find_rig(motion), a2g_jax.find_rig(character))
        >>> a2g_jax.retarget(motion, match).skeleton.joints
        52

    Args:
        motion: on any humanoid rig.
        target: the target skeleton, or its rig (from :func:`~a2g_jax.geometry.retarget.find_rig`, with options of its
            own), or a match (from :func:`~a2g_jax.geometry.retarget.match_rigs`).
        source: the rig of ``motion``, if found before.

    Returns:
        Float32 motion on the target's skeleton. Lengths scale by leg length; soles keep their height above the ground.

    Raises:
        InputError: a rig is not recognised; the message names what was not found.
    """
    if isinstance(target, Match):
        match = target
    else:
        source = find_rig(motion, name="the source") if source is None else source
        target = find_rig(target, name="the target") if isinstance(target, Skeleton) else target
        match = match_rigs(source, target)
    if not motion.skeleton.same_tree(match.source.skeleton):
        raise InputError(
            "The motion and the source rig of the match have different skeletons; match the rig of this motion."
        )
    theirs = world_rotations(np.asarray(motion.rotations, np.float32), match.source.skeleton.parents)
    world = _target_world(match, theirs)
    skeleton = match.target.skeleton
    rotations = world.copy()
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            rotations[:, joint] = np.swapaxes(world[:, parent], -1, -2) @ world[:, joint]
    return replace(motion, rotations=rotations, root=_root(match, motion, theirs, world), skeleton=skeleton)


def _target_world(match: Match, world: Float[np.ndarray, "T J 3 3"]) -> Float[np.ndarray, "T K 3 3"]:
    source, target = match.source, match.target
    turn = target.world @ source.world.T
    result = np.zeros((len(world), target.skeleton.joints, 3, 3), np.float32)
    ours = [pair.target for pair in match.pairs]
    theirs = [pair.source for pair in match.pairs]
    source_to_target = (source.align[theirs] @ np.swapaxes(target.align[ours], -1, -2)).astype(np.float32)
    result[:, ours] = turn.astype(np.float32) @ (world[:, theirs] @ source_to_target)
    shares = {share.target: share for share in match.shares}
    still = target.rest if match.still is None else match.still
    matched, align, rest = set(ours), target.align.astype(np.float32), still.astype(np.float32)
    moved: set[int] = set()
    for joint, parent in enumerate(target.skeleton.parents):
        if joint in matched:
            moved.add(joint)
        elif joint in shares:
            share = shares[joint]
            above, below = (result[:, other] @ align[other] for other in (share.above, share.below))
            result[:, joint] = between(above, below, share.weight) @ align[joint].T
            moved.add(joint)
        elif parent in moved:
            result[:, joint] = result[:, parent] @ rest[joint]
            moved.add(joint)
        else:
            # No joint above is matched: upright.
            result[:, joint] = (target.world @ target.align[joint].T).astype(np.float32)
    return result


def _root(
    match: Match, motion: Motion, theirs: Float[np.ndarray, "T J 3 3"], world: Float[np.ndarray, "T K 3 3"]
) -> Float[np.ndarray, "T 3"]:
    source, target = match.source, match.target
    turn = target.world @ source.world.T
    anchors = _anchors(match)
    from_root = joint_places(theirs, np.asarray(source.skeleton.offsets), source.skeleton.parents)
    place = from_root[:, anchors[0]].mean(axis=1) + np.asarray(motion.root)
    ours = joint_places(world, np.asarray(target.skeleton.offsets), target.skeleton.parents)
    anchor = match.scale * (place @ turn.T) + match.lift * target.world[:, 1]
    return (anchor - ours[:, anchors[1]].mean(axis=1)).astype(np.float32)


def _anchors(match: Match) -> tuple[list[int], list[int]]:
    """Joints whose midpoint is retargeted: the hips, or the lowest matched joint of the trunk."""
    source, target = match.source.roles, match.target.roles
    if all(role in roles for roles in (source, target) for role in ("L_Hip", "R_Hip")):
        return [source["L_Hip"], source["R_Hip"]], [target["L_Hip"], target["R_Hip"]]
    pairs = {pair.target: pair.source for pair in match.pairs}
    trunk = [target[role] for role in ("Pelvis",) if role in target] + [*match.target.spine, target["Chest"]]
    lowest = next((joint for joint in trunk if joint in pairs), None)
    if lowest is None:
        return [source["L_Shoulder"], source["R_Shoulder"]], [target["L_Shoulder"], target["R_Shoulder"]]
    return [pairs[lowest]], [lowest]
