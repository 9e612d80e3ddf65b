"""Two-bone inverse kinematics of arms and legs, vectorised over frames, without singular poses."""

import numpy as np
from jaxtyping import Float

from a2g_jax.talker.paths import softplus

Vectors = Float[np.ndarray, "T 3"]
Rotations = Float[np.ndarray, "T 3 3"]
Angles = Float[np.ndarray, " T"]

_SHORTEST, _LONGEST = 0.38, 0.992
"""Reach as a share of the limb's length: elbow flexion between about 14 and 135 degrees."""


_TWIST = np.deg2rad(79.0)
"""Most supination and pronation."""


def turn(axis: int, angle: Angles) -> Rotations:
    """Rotation matrices about x (0), y (1) or z (2) by ``angle`` in radians."""
    cos, sin = np.cos(angle), np.sin(angle)
    matrix = np.zeros((len(angle), 3, 3))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix[:, axis, axis] = 1.0
    matrix[:, first, first] = matrix[:, second, second] = cos
    matrix[:, first, second] = -sin
    matrix[:, second, first] = sin
    return matrix


def yaw_roll_pitch(yaw: Angles, roll: Angles, pitch: Angles) -> Rotations:
    """``R_y(yaw) R_z(roll) R_x(pitch)``: turn left, lean right, lean forward (radians)."""
    return turn(1, yaw) @ turn(2, roll) @ turn(0, pitch)


def rotate(rotations: Rotations, vectors: np.ndarray) -> Vectors:
    """Rotate one vector for all frames, or one a frame."""
    return np.einsum("tij,tj->ti", rotations, np.broadcast_to(vectors, (len(rotations), 3)))


def _unit(vectors: Vectors) -> Vectors:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def soft_reach(reach: Angles, length: float) -> Angles:
    """Limit a limb's reach smoothly, so that a target out of reach is approached without a jump."""
    reach = _SHORTEST * length + softplus(reach - _SHORTEST * length, 0.03)
    return _LONGEST * length - softplus(_LONGEST * length - reach, 0.010)


def bend(
    start: Vectors, end: Vectors, pole: Vectors, lengths: tuple[float, float], limit: bool
) -> tuple[Vectors, Vectors, Angles]:
    """Bend a limb of two bones so that it leads from ``start`` to ``end``.

    ``pole`` is the direction in which the middle joint points; it must not be parallel to the limb. With ``limit`` the
    reach goes through :func:`soft_reach`; without, the end must be within reach and is met exactly.

    Returns:
        Unit direction of the upper bone; unit vector across it in the limb's plane, on the side to which the lower
        bone bends; flexion in radians (0 = straight).
    """
    to_end = end - start
    reach = np.linalg.norm(to_end, axis=1)
    along = to_end / reach[:, None]
    upper, lower = lengths
    if limit:
        reach = soft_reach(reach, upper + lower)
    across = _unit(pole - np.sum(pole * along, axis=1, keepdims=True) * along)
    cos_start = (upper**2 + reach**2 - lower**2) / (2.0 * upper * reach)
    sin_start = np.sqrt(1.0 - cos_start**2)
    flexion = np.pi - np.arccos((upper**2 + lower**2 - reach**2) / (2.0 * upper * lower))
    c, s = cos_start[:, None], sin_start[:, None]
    return c * along + s * across, s * along - c * across, flexion


def arm_rotations(
    shoulder: Vectors,
    wrist: Vectors,
    pole: Vectors,
    lengths: tuple[float, float],
    side: float,
    hand: Float[np.ndarray, "T 3"],
) -> tuple[Rotations, Rotations, Rotations]:
    """Pose one arm.

    Args:
        shoulder, wrist: positions in the world, metres.
        pole: direction in which the elbow points, in the world.
        lengths: upper arm and forearm, metres.
        side: +1 left, -1 right.
        hand: supination of the forearm (0 = thumb up where the forearm is level, positive = palm up), palmar flexion
            and radial deviation of the wrist, radians.

    Returns:
        World rotation of the upper arm; local rotations of elbow (hinge, then forearm twist) and wrist.
    """
    upper, inner, flexion = bend(shoulder, wrist, pole, lengths, limit=True)
    # At rest the arm lies along side * x and the elbow bends toward +z, about y.
    x = side * upper
    world = np.stack([x, np.cross(inner, x), inner], axis=2)
    supination, palmar, radial = hand.T
    hinge = turn(1, -side * flexion)
    # "Thumb up" is a direction in the world, wherever the elbow points; a hanging forearm has none.
    up = (world @ hinge)[:, 1, :]
    upright = np.arctan2(up[:, 1], np.sqrt(up[:, 2] ** 2 + 0.04) + 0.25)
    elbow = hinge @ turn(0, -_limit(supination + upright, _TWIST))
    return world, elbow, turn(2, -side * palmar) @ turn(1, -side * radial)


def _limit(angle: Angles, most: float) -> Angles:
    """Keep angles softly between ``-most`` and ``most``."""
    angle = most - softplus(most - angle, 0.12)
    return softplus(angle + most, 0.12) - most


def leg_rotations(
    hip: Vectors, ankle: Vectors, forward: Vectors, lengths: tuple[float, float]
) -> tuple[Rotations, Rotations]:
    """Pose one leg: world rotation of the thigh, local rotation of the knee (a hinge about x)."""
    thigh, inner, flexion = bend(hip, ankle, forward, lengths, limit=False)
    y, z = -thigh, -inner
    return np.stack([np.cross(y, z), y, z], axis=2), turn(0, flexion)
