"""Wrist targets in the world: they move with the chest and stay clear of the torso and of each other."""

import numpy as np
from jaxtyping import Float

from a2g_jax.talker.ik import Rotations, Vectors, rotate
from a2g_jax.talker.paths import softplus
from a2g_jax.talker.skeleton import HAND, TORSO_HALF_AXES

_CLEARANCE = 0.085
"""Least lateral distance between the wrists, metres: hands fold over each other but never change sides."""


_HANDS_APART = 0.045
"""Least distance between the middle lines of the hands, metres: two hands' thickness."""
_NEARNESS = 0.025
"""Width of the smooth minimum over distances, metres."""
_HAND_POINTS = (0.1, 0.55, 1.0)
"""Points of a hand that are kept clear, as shares of its length."""


def wrist_targets(
    controls: dict[str, Float[np.ndarray, "T 9"]], chest: Vectors, pelvis: Vectors, neck: Vectors, facing: Rotations
) -> dict[str, Vectors]:
    """World positions for both wrists from the arms' controls.

    Args:
        controls: channels of :mod:`a2g_jax.talker.hand_shapes`, by hand.
        chest, pelvis, neck: joint positions in the world.
        facing: upright axes that turn with the chest: those of the gesture space.
    """
    local = {}
    for hand, side in (("left", 1.0), ("right", -1.0)):
        local[hand] = controls[hand][:, :3] * np.array([side, 1.0, 1.0])
    gap = local["left"][:, 0] - local["right"][:, 0]
    apart = 0.5 * (_CLEARANCE + softplus(gap - _CLEARANCE, 0.03) - gap)
    local["left"][:, 0] += apart
    local["right"][:, 0] -= apart
    return {hand: outside_torso(chest + rotate(facing, place), pelvis, neck, facing) for hand, place in local.items()}


def clear_hands(
    hands: dict[str, tuple[Vectors, Rotations]], pelvis: Vectors, neck: Vectors, facing: Rotations, over: float
) -> dict[str, Vectors]:
    """Displacements of both wrists that keep palms and fingers clear of the torso and of each other.

    Args:
        hands: wrist position and the hand's axes in the world, by hand.
        pelvis, neck, facing: as in :func:`wrist_targets`.
        over: which hand lies over the other where they meet: +1 the left one, -1 the right one.
    """
    points, change = {}, {}
    for hand, side in (("left", 1.0), ("right", -1.0)):
        wrist, palm = hands[hand]
        points[hand] = [wrist + rotate(palm, np.array([side * share * HAND, 0.0, 0.0])) for share in _HAND_POINTS]
        pushes = [outside_torso(point, pelvis, neck, facing, 0.2) - point for point in points[hand][1:]]
        sizes = [np.linalg.norm(push, axis=1, keepdims=True) for push in pushes]
        total = sum(size * push for size, push in zip(sizes, pushes, strict=True))
        change[hand] = total / (sum(sizes) + 2e-3)
    gaps = np.stack([left - right for left in points["left"] for right in points["right"]])
    distances = np.linalg.norm(gaps, axis=2)
    nearest = distances.min(axis=0)
    nearness = np.exp((nearest - distances) / _NEARNESS)
    # The smooth minimum is never more than the least distance.
    distance = nearest - _NEARNESS * np.log(np.sum(nearness, axis=0))
    weights = nearness / np.sum(nearness, axis=0)
    # Along the line between them; where they cross, one hand passes over the other. Directions change smoothly.
    away = np.einsum("pt,pti->ti", weights, gaps) + rotate(facing, np.array([0.01, 0.025 * over, 0.06 * over]))
    away /= np.sqrt(np.sum(away**2, axis=1, keepdims=True) + 0.03**2)
    push = 0.6 * softplus(_HANDS_APART - distance, 0.042)[:, None] * away
    return {"left": change["left"] + push, "right": change["right"] - push}


def torso_distance(points: Vectors, pelvis: Vectors, neck: Vectors, facing: Rotations) -> tuple:
    """Horizontal offset of points from the torso's middle line, in half axes of the torso, and that line's point."""
    share = (points[:, 1] - pelvis[:, 1]) / (neck[:, 1] - pelvis[:, 1])
    middle = pelvis + share[:, None] * (neck - pelvis)
    offset = rotate(np.swapaxes(facing, 1, 2), points - middle)
    offset[:, 1] = 0.0
    return offset / np.array([TORSO_HALF_AXES[0], 1.0, TORSO_HALF_AXES[1]]), middle


def outside_torso(points: Vectors, pelvis: Vectors, neck: Vectors, facing: Rotations, width: float = 0.06) -> Vectors:
    """Push points out of the torso's elliptic capsule, straight away from its middle line.

    The push sets in smoothly over ``width``, in half axes of the torso.
    """
    scaled, _ = torso_distance(points, pelvis, neck, facing)
    depth = np.linalg.norm(scaled, axis=1)
    pushed = 1.0 + softplus(depth - 1.0, width)
    change = scaled * (pushed / np.maximum(depth, 1e-3) - 1.0)[:, None]
    change *= np.array([TORSO_HALF_AXES[0], 0.0, TORSO_HALF_AXES[1]])
    return points + rotate(facing, change)
