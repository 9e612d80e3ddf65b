"""Relaxed hands: fingers that nothing moves are curled as those of a hand at rest.

Every rig shows its own hand in the reference pose: flat, spread, or half closed. The direction of each finger bone is
therefore set in the frame of the hand (:mod:`~a2g_jax.geometry.retarget.rest`), whatever it is at rest:

    t = (cos(phi) cos(sigma), -sin(phi), cos(phi) sin(sigma)),

mirrored in x for the right hand, with the flexion ``phi`` summed from the knuckle, and the spread ``sigma`` of the rig.
The bone turns there by the smallest rotation from its direction at rest, so that it keeps its roll.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.joint_names import FINGERS
from a2g_jax.geometry.retarget.match import Match
from a2g_jax.geometry.retarget.poses import shortest_turn, unit
from a2g_jax.geometry.retarget.rig import Rig

#: Flexion of each joint of a relaxed finger, degrees: more towards the little finger and in the middle joint.
_FLEXION = {"Index": (16, 22, 12), "Middle": (21, 26, 14), "Ring": (25, 28, 15), "Pinky": (26, 29, 16)}
#: Directions of the bones of a relaxed left thumb in the frame of the hand (x to the fingertips, y out of its back,
#: z to the thumb's side): beside the index finger, a little below the palm.
_THUMB = ((0.66, -0.40, 0.64), (0.80, -0.42, 0.43), (0.90, -0.38, 0.22))
#: Most spread of a finger that is kept, degrees: beyond it the rest pose is a fist or a star.
_SPREAD = 20.0
_OUT = np.array([1.0, 0.0, 0.0])
#: Direction of a thumb in the frame of its own joint's anatomy.
_THUMB_AT_REST = unit(np.array([0.65, -0.3, 0.7]))


def with_relaxed_hands(match: Match) -> Match:
    """The match with a relaxed curl of those fingers of the target that have no partner in the source."""
    still = relaxed_rotations(match.target, {pair.target for pair in match.pairs})
    return match if still is None else replace(match, still=still)


def relaxed_rotations(rig: Rig, moved: set[int] | frozenset[int] = frozenset()) -> Float[np.ndarray, "J 3 3"] | None:
    """Local rotations of the reference pose with relaxed hands; None for a rig without fingers to curl.

    Args:
        moved: joints that keep their rotation; a finger of which one is among them is left as it is.
    """
    world, parents = rig.rest_world, rig.skeleton.parents
    turned = _turned(rig, moved)
    if not turned:
        return None
    new = np.array(world)
    for joint, parent in enumerate(parents):
        if joint in turned:
            new[joint] = turned[joint]
        elif parent >= 0:
            new[joint] = new[parent] @ rig.rest[joint]
    local = new.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            local[joint] = new[parent].T @ new[joint]
    return local


def _turned(rig: Rig, moved: set[int] | frozenset[int]) -> dict[int, Float[np.ndarray, "3 3"]]:
    """Orientations in the world of the reference pose of all finger joints that are curled."""
    found: dict[int, Float[np.ndarray, "3 3"]] = {}
    for side in "LR":
        wrist = rig.roles.get(f"{side}_Wrist")
        if wrist is None:
            continue
        hand = rig.rest_world[wrist] @ rig.align[wrist]
        for finger in FINGERS:
            joints = [rig.roles.get(f"{side}_{finger}{number}") for number in (1, 2, 3)]
            if any(joint in moved for joint in joints):
                continue
            phi = 0.0
            for at, joint in enumerate(joints):
                phi += 0.0 if finger == "Thumb" else _FLEXION[finger][at]
                if joint is not None:
                    turn = _turn(rig, joint, hand, side, finger, phi, at)
                    found[joint] = hand @ turn @ hand.T @ rig.rest_world[joint]
    return found


def _turn(
    rig: Rig, joint: int, hand: Float[np.ndarray, "3 3"], side: str, finger: str, phi: float, at: int
) -> Float[np.ndarray, "3 3"]:
    """The turn of a bone from the reference pose, in the frame of the hand."""
    mirror = np.array([1.0 if side == "L" else -1.0, 1.0, 1.0])
    thumb = finger == "Thumb"
    own = (_THUMB_AT_REST if thumb else _OUT) * mirror
    bone = hand.T @ rig.rest_world[joint] @ rig.align[joint] @ own
    if thumb:
        return shortest_turn(bone, unit(np.array(_THUMB[at])) * mirror)
    left = bone * mirror
    spread = np.radians(np.clip(np.degrees(np.arctan2(left[2], max(left[0], 0.2))), -_SPREAD, _SPREAD))
    bend = np.radians(phi)
    target = np.array([np.cos(bend) * np.cos(spread), -np.sin(bend), np.cos(bend) * np.sin(spread)])
    return shortest_turn(bone, target * mirror)
