"""Offsets of a clip from a generated motion that decay to zero beyond the clip's ends.

A clip leaves or joins a motion with the rotation by which the two differ at its end, and with the velocity and
acceleration of that difference. Beyond the end a polynomial of fifth degree continues all three and comes to rest at
zero, so that position, velocity and acceleration are continuous at both ends of a transition; the polynomial is the
path of least jerk between its ends (Flash and Hogan 1985). Frames are counted outwards from the clip's last frame.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

#: Frames of a clip that the velocity and acceleration of an offset are taken from.
NEAR = 3


@dataclass(frozen=True)
class Shape:
    """Frames of a transition."""

    frames: int
    """Until the offset is zero."""
    settle: int
    """Until its first velocity and acceleration have come to rest; no more than ``frames``."""
    held: bool = False
    """The offset stays instead of decaying, towards an end of the motion."""


def offset_vectors(
    clip: Float[np.ndarray, "n J 3 3"], motion: Float[np.ndarray, "n J 3 3"]
) -> Float[np.ndarray, "n J 3"]:
    """Rotation vectors, in the parent's axes, of the turns from a motion's rotations to a clip's.

    The first row has angles of at most half a turn, the shortest way; the others continue it.
    """
    flat = Rotation.from_matrix((clip @ np.swapaxes(motion, -1, -2)).reshape(-1, 3, 3)).as_rotvec()
    vectors: Float[np.ndarray, "n J 3"] = flat.reshape(*clip.shape[:2], 3)
    for row in range(1, len(vectors)):
        length = np.linalg.norm(vectors[row], axis=-1, keepdims=True)
        other = vectors[row] * (1.0 - 2.0 * np.pi / np.maximum(length, 1e-9))
        nearer = np.linalg.norm(other - vectors[row - 1], axis=-1) < np.linalg.norm(
            vectors[row] - vectors[row - 1], axis=-1
        )
        vectors[row] = np.where(nearer[:, None], other, vectors[row])
    return vectors


def decay(near: Float[np.ndarray, "k *d"], shape: Shape) -> Float[np.ndarray, "n *d"]:
    """The offset in the frames beyond the end of a clip.

    Args:
        near: the offset in the clip's last frame, the one before, and so on.
    """
    place = near[0]
    velocity = acceleration = np.zeros_like(place)
    if len(near) >= 3:
        # Second-order differences: the third difference across the end is that of the offset within the clip.
        velocity = 1.5 * near[0] - 2.0 * near[1] + 0.5 * near[2]
        acceleration = near[0] - 2.0 * near[1] + near[2]
    elif len(near) == 2:
        velocity = near[0] - near[1]
    time = np.arange(1, shape.frames + 1)
    u = np.minimum(time / max(shape.frames, 1), 1.0)
    stays = np.ones_like(u) if shape.held else 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    settle = float(max(shape.settle, 1))
    u = np.minimum(time / settle, 1.0)
    moves = settle * (u - u**3 * (6.0 - 8.0 * u + 3.0 * u**2))
    bends = settle**2 * 0.5 * (u**2 - u**3 * (3.0 - 3.0 * u + u**2))
    terms = ((stays, place), (moves, velocity), (bends, acceleration))
    return np.asarray(sum(np.multiply.outer(share, value) for share, value in terms))


def turned(
    rotations: Float[np.ndarray, "n J 3 3"], vectors: Float[np.ndarray, "n J 3"]
) -> Float[np.ndarray, "n J 3 3"]:
    """Rotations turned by rotation vectors in the parent's axes."""
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(rotations.shape) @ rotations
