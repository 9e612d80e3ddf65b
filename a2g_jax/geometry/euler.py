"""Intrinsic Euler angles in degrees, in the order of their letters: ``"ZXY"`` is ``R = Rz @ Rx @ Ry``."""

import numpy as np
from jaxtyping import Bool, Float

#: Below this cosine of the middle angle the rounding of float32 rotations leaves the first angle undefined.
_LOCK = 1e-6


def euler_matrices(degrees: Float[np.ndarray, "*batch A"], order: str) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation matrices of Euler angles.

    Args:
        degrees: one angle for each letter of ``order``.
        order: any number of the letters ``XYZ``.
    """
    angles = np.radians(degrees)
    cosines, sines = np.cos(angles)[..., None], np.sin(angles)[..., None]
    matrices = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3)).copy()
    for at, axis in enumerate(order):
        # Multiplying by a rotation about one axis from the right mixes the two columns of the others.
        i, j = ("XYZ".index(axis) + 1) % 3, ("XYZ".index(axis) + 2) % 3
        cosine, sine = cosines[..., at, :], sines[..., at, :]
        left, right = matrices[..., i], matrices[..., j]
        matrices[..., i], matrices[..., j] = left * cosine + right * sine, right * cosine - left * sine
    return matrices


def continuous_euler(rotations: Float[np.ndarray, "T J 3 3"], order: str) -> Float[np.ndarray, "T J 3"]:
    """Euler angles without jumps: in each frame the angles nearest to those of the frame before.

    Every rotation has two triples, ``(a, b, c)`` and ``(a + 180, 180 - b, c + 180)``, each up to whole turns. Frame 0
    takes the triple whose middle angle is within 90 degrees, every later frame the one nearest to its predecessor's.

    Args:
        order: a permutation of ``XYZ``.
    """
    first = _triples(np.asarray(rotations, np.float64), order)
    second = np.stack([first[..., 0] + 180, 180 - first[..., 1], first[..., 2] + 180], axis=-1)
    result = np.empty_like(first)
    result[0] = last = first[0]
    for frame in range(1, len(first)):
        near = first[frame] + 360 * np.round((last - first[frame]) / 360)
        other = second[frame] + 360 * np.round((last - second[frame]) / 360)
        nearer = np.abs(other - last).sum(axis=-1) < np.abs(near - last).sum(axis=-1)
        result[frame] = last = np.where(nearer[:, None], other, near)
    return result


def _triples(rotations: Float[np.ndarray, "T J 3 3"], order: str) -> Float[np.ndarray, "T J 3"]:
    i, j, k = ("XYZ".index(axis) for axis in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    # From R = Ri(a) Rj(b) Rk(c): row i is (cos b cos c, -sign cos b sin c, sign sin b) in columns i, j, k, and column
    # k is (sign sin b, -sign sin a cos b, cos a cos b) in rows i, j, k.
    width = np.hypot(rotations[..., i, i], rotations[..., i, j])
    first = np.arctan2(-sign * rotations[..., j, k], rotations[..., k, k])
    first = _hold(first, width > _LOCK)
    middle = np.arctan2(sign * rotations[..., i, k], width)
    # The last angle from Ri(a)^T R = Rj(b) Rk(c), whose row j is (sign sin c, cos c) in columns i, j. That stays
    # accurate near gimbal lock, where it compensates for any first angle.
    cosine, sine = np.cos(first), sign * np.sin(first)
    row_i = cosine * rotations[..., j, i] + sine * rotations[..., k, i]
    row_j = cosine * rotations[..., j, j] + sine * rotations[..., k, j]
    last = np.arctan2(sign * row_i, row_j)
    return np.degrees(np.stack([first, middle, last], axis=-1))


def _hold(angles: Float[np.ndarray, "T J"], defined: Bool[np.ndarray, "T J"]) -> Float[np.ndarray, "T J"]:
    # An undefined angle takes the value of the last frame that defines it, or of the first one that does.
    frames = np.arange(len(angles))[:, None]
    source = np.maximum.accumulate(np.where(defined, frames, -1), axis=0)
    source = np.where(source < 0, np.argmax(defined, axis=0)[None], source)
    held = np.take_along_axis(angles, source, axis=0)
    return np.where(defined.any(axis=0, keepdims=True), held, 0.0)


def continuous_yxz(
    angles: Float[np.ndarray, "T *rows 3"], near: Float[np.ndarray, "*rows 3"]
) -> Float[np.ndarray, "T *rows 3"]:
    """The same rotations with angles that do not jump over time.

    ``(a, b, c)`` and ``(a + pi, pi - b, c + pi)`` are the same rotation, and so are angles that differ by full turns.
    In each frame the set nearest to that of the frame before is taken.

    Args:
        near: angles that those of the first frame are to be near, such as the mean of a corpus.
    """
    turn = 2.0 * np.pi
    before, found = np.asarray(near, np.float64), np.array(angles, np.float64)
    for frame in found:
        other = np.stack([frame[..., 0] + np.pi, np.pi - frame[..., 1], frame[..., 2] + np.pi], axis=-1)
        first, second = (one + turn * np.round((before - one) / turn) for one in (frame, other))
        nearer = np.abs(first - before).sum(axis=-1) <= np.abs(second - before).sum(axis=-1)
        frame[...] = before = np.where(nearer[..., None], first, second)
    return found.astype(np.float32)
