"""Wrist targets in the world: carried by the chest, kept out of the torso and clear of each other."""

import numpy as np
from jaxtyping import Float

from a2g_jax.data.talker.body import TORSO_HALF_AXES
from a2g_jax.data.talker.ik import Vectors, rotate, turn
from a2g_jax.data.talker.paths import softplus

_CLEARANCE = 0.085
"""Least lateral distance between the wrists, metres: hands fold over each other but never change sides."""


def wrist_targets(
    controls: dict[str, Float[np.ndarray, "T 9"]], chest: Vectors, pelvis: Vectors, neck: Vectors, yaw: np.ndarray
) -> dict[str, Vectors]:
    """World positions for both wrists from the arms' controls.

    Args:
        controls: channels of :mod:`a2g_jax.data.talker.hand_shapes`, by hand.
        chest, pelvis, neck: joint positions in the world.
        yaw: where the chest faces, radians; the gesture space turns with it but stays upright.
    """
    local = {}
    for hand, side in (("left", 1.0), ("right", -1.0)):
        local[hand] = controls[hand][:, :3] * np.array([side, 1.0, 1.0])
    gap = local["left"][:, 0] - local["right"][:, 0]
    apart = 0.5 * (_CLEARANCE + softplus(gap - _CLEARANCE, 0.03) - gap)
    local["left"][:, 0] += apart
    local["right"][:, 0] -= apart
    facing = turn(1, yaw)
    return {hand: outside_torso(chest + rotate(facing, place), pelvis, neck, facing) for hand, place in local.items()}


def torso_distance(points: Vectors, pelvis: Vectors, neck: Vectors, facing: Float[np.ndarray, "T 3 3"]) -> tuple:
    """Horizontal offset of points from the torso's middle line, in half axes of the torso, and that line's point."""
    share = (points[:, 1] - pelvis[:, 1]) / (neck[:, 1] - pelvis[:, 1])
    middle = pelvis + share[:, None] * (neck - pelvis)
    offset = rotate(np.swapaxes(facing, 1, 2), points - middle)
    offset[:, 1] = 0.0
    return offset / np.array([TORSO_HALF_AXES[0], 1.0, TORSO_HALF_AXES[1]]), middle


def outside_torso(points: Vectors, pelvis: Vectors, neck: Vectors, facing: Float[np.ndarray, "T 3 3"]) -> Vectors:
    """Push points out of the torso's elliptic capsule, smoothly and straight away from its middle line."""
    scaled, _ = torso_distance(points, pelvis, neck, facing)
    depth = np.linalg.norm(scaled, axis=1)
    pushed = 1.0 + softplus(depth - 1.0, 0.06)
    change = scaled * (pushed / np.maximum(depth, 1e-3) - 1.0)[:, None]
    change *= np.array([TORSO_HALF_AXES[0], 0.0, TORSO_HALF_AXES[1]])
    return points + rotate(facing, change)
