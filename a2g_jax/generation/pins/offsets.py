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
#: Acceleration from which a joint shakes, radians (or metres) per frame squared; talk at 30 fps has up to 0.17. Its
#: mean velocity is continued then.
SHAKES = 0.22


@dataclass(frozen=True)
class Shape:
    """Frames of a transition."""

    frames: int
    """Until the offset is zero."""
    settle: int
    """Until its first velocity and acceleration have come to rest; no more than ``frames`` unless it is held."""
    held: bool = False
    """The offset stays instead of decaying, towards an end of the motion."""
    order: int = 2
    """Highest derivative that is continuous at the clip's end: 2 the acceleration, 1 a mean velocity, 0 neither; in
    a recording that shakes there, acceleration and velocity are noise."""


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
    place, (velocity, acceleration) = near[0], derivatives(near, shape.order)
    time = np.arange(1, shape.frames + 1)
    stays = np.ones(shape.frames) if shape.held else _fall(time, shape.frames)[0]
    _, moves, bends = _fall(time, shape.settle)
    terms = ((stays, place), (moves, velocity), (bends, acceleration))
    return np.asarray(sum(np.multiply.outer(share, value) for share, value in terms))


def bridge(
    near: Float[np.ndarray, "k *d"], far: Float[np.ndarray, "m *d"], frames: int, order: int
) -> Float[np.ndarray, "n *d"]:
    """The path from the end of a clip to where a motion is some frames later, with the velocity of either there.

    Args:
        near: the clip relative to the end of the path, in its last frame, the one before, and so on.
        far: the motion relative to the end of the path, where it is zero, in the last frame of the path, the one
            beyond, and so on.
    """
    time = np.arange(1, frames + 1)
    first, last = derivatives(near, order), derivatives(far, order)
    stays, moves, bends = _fall(time, frames)
    _, back_moves, back_bends = _fall(frames - time, frames)
    terms = ((stays, near[0]), (moves, first[0]), (bends, first[1]), (back_moves, last[0]), (back_bends, last[1]))
    return np.asarray(sum(np.multiply.outer(share, value) for share, value in terms))


def derivatives(
    near: Float[np.ndarray, "k *d"], order: int = 2
) -> tuple[Float[np.ndarray, "*d"], Float[np.ndarray, "*d"]]:
    """Velocity and acceleration per frame, outwards, at the first of values that are counted inwards."""
    nothing = np.zeros_like(near[0])
    if len(near) < 2 or order == 0:
        return nothing, nothing
    if len(near) == 2 or order == 1:
        return (near[0] - near[-1]) / (len(near) - 1), nothing
    # Of second order: the third difference across the end is that of the values within.
    velocity, acceleration = 1.5 * near[0] - 2.0 * near[1] + 0.5 * near[2], near[0] - 2.0 * near[1] + near[2]
    shakes = np.linalg.norm(acceleration, axis=-1, keepdims=True) > SHAKES
    return np.where(shakes, 0.5 * (near[0] - near[2]), velocity), np.where(shakes, 0.0, acceleration)


def _fall(time: np.ndarray, frames: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Polynomials of fifth degree with value, velocity or acceleration 1 at time 0, and all else 0 there and later."""
    length = float(max(frames, 1))
    u = np.minimum(time / length, 1.0)
    value = 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    velocity = length * (u - u**3 * (6.0 - 8.0 * u + 3.0 * u**2))
    acceleration = 0.5 * length**2 * (u**2 - u**3 * (3.0 - 3.0 * u + u**2))
    return value, velocity, acceleration


def turned(
    rotations: Float[np.ndarray, "n J 3 3"], vectors: Float[np.ndarray, "n J 3"]
) -> Float[np.ndarray, "n J 3 3"]:
    """Rotations turned by rotation vectors in the parent's axes."""
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(rotations.shape) @ rotations
