"""Rotations of 3D space as matrices, quaternions, axis-angle vectors and 6D, for use under JAX.

Matrices act on column vectors; quaternions are ``wxyz``; axis-angle is the exponential map (axis times angle in
radians); 6D is the first two *columns* of the matrix, one after the other (Zhou et al. 2019, "On the Continuity of
Rotation Representations in Neural Networks"). Euler angles are in :mod:`a2g_jax.geometry.euler`.

Every function is written for one rotation and vmapped over leading axes by ``jnp.vectorize``. Where a formula has a
removable singularity both branches of the ``where`` are finite, because the gradient of the branch not taken is
multiplied by zero, and zero times infinity is NaN.
"""

from functools import partial

import jax.numpy as jnp
from jaxtyping import Array, Float
from numpy import ndarray

_vectorize = partial(partial, jnp.vectorize)


def _small(x: Array) -> float:
    """Squared length below which Taylor series are exact to working precision."""
    return float(jnp.finfo(x.dtype).eps)


def safe_norm(vector: Float[Array, " n"]) -> Float[Array, ""]:
    """Euclidean length of one vector whose gradient at zero is zero instead of NaN."""
    square = jnp.dot(vector, vector)
    # Squares underflow long before lengths do, hence the smallest normal number.
    tiny = jnp.finfo(vector.dtype).tiny
    positive = square > tiny
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, square, 1.0)), 0.0)


@_vectorize(signature="(6)->(3,3)")
def matrix_from_6d(six: Float[Array, " 6"]) -> Float[Array, "3 3"]:
    """Rotation matrix by Gram-Schmidt of the two 3-vectors in ``six``, also of zero, parallel or overflowing vectors.

    Degenerate input falls back to a fixed axis, with zero gradient through the part without information.
    Written in components because XLA fuses those into one loop; with dot products and stacks of 3-vectors the
    gradient takes three times as long.
    """
    eps = _small(six)
    ax, ay, az, bx, by, bz = six

    square = ax * ax + ay * ay + az * az
    # A length whose square overflows would leave zeros behind.
    usable = (square > eps) & (square < jnp.inf)
    inverse = 1 / jnp.sqrt(jnp.where(usable, square, 1.0))
    ax, ay, az = (jnp.where(usable, value * inverse, spare) for value, spare in ((ax, 1.0), (ay, 0.0), (az, 0.0)))

    along = ax * bx + ay * by + az * bz
    rx, ry, rz = bx - along * ax, by - along * ay, bz - along * az
    square = rx * rx + ry * ry + rz * rz
    # Relative to the vector's own length, or a tiny but clean second vector would count as parallel.
    usable = square > eps * (bx * bx + by * by + bz * bz)
    # Where the second is parallel to the first, the axis least along the first takes its place.
    least_x = (jnp.abs(ax) <= jnp.abs(ay)) & (jnp.abs(ax) <= jnp.abs(az))
    least_y = ~least_x & (jnp.abs(ay) <= jnp.abs(az))
    kx, ky = jnp.where(least_x, 1.0, 0.0), jnp.where(least_y, 1.0, 0.0)
    kz = 1.0 - kx - ky
    along = kx * ax + ky * ay + kz * az
    bx, by, bz = (
        jnp.where(usable, value, spare)
        for value, spare in ((rx, kx - along * ax), (ry, ky - along * ay), (rz, kz - along * az))
    )
    inverse = 1 / jnp.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx * inverse, by * inverse, bz * inverse
    return jnp.array([[ax, bx, ay * bz - az * by], [ay, by, az * bx - ax * bz], [az, bz, ax * by - ay * bx]])


@_vectorize(signature="(3,3)->(6)")
def matrix_to_6d(matrix: Float[Array, "3 3"]) -> Float[Array, " 6"]:
    """The first two columns of the matrix, one after the other."""
    return matrix[:, :2].T.reshape(6)


@_vectorize(signature="(4)->(3,3)")
def matrix_from_quaternion(quaternion: Float[Array, " 4"]) -> Float[Array, "3 3"]:
    """Rotation matrix of a unit quaternion (wxyz)."""
    w, x, y, z = quaternion
    return jnp.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@_vectorize(signature="(3,3)->(4)")
def quaternion_from_matrix(matrix: Float[Array, "3 3"]) -> Float[Array, " 4"]:
    """Unit quaternion (wxyz, w >= 0) of a rotation matrix, accurate at every angle.

    Each row below is four times the quaternion scaled by one of its components; the largest is well conditioned.
    """
    m = matrix
    rows = jnp.array(
        [
            [1 + m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[1, 0] + m[0, 1], 1 - m[0, 0] + m[1, 1] - m[2, 2], m[2, 1] + m[1, 2]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[2, 1] + m[1, 2], 1 - m[0, 0] - m[1, 1] + m[2, 2]],
        ]
    )
    row = rows[jnp.argmax(jnp.diagonal(rows))]
    row = row / jnp.sqrt(jnp.dot(row, row))
    return jnp.where(row[0] < 0, -row, row)


@_vectorize(signature="(3)->(4)")
def quaternion_from_axis_angle(vector: Float[Array, " 3"]) -> Float[Array, " 4"]:
    """Exponential map from axis times angle (radians) to a unit quaternion."""
    square = jnp.dot(vector, vector)
    small = square < _small(vector)
    angle = jnp.sqrt(jnp.where(small, 1.0, square))
    scale = jnp.where(small, 0.5 - square / 48, jnp.sin(angle / 2) / angle)
    w = jnp.where(small, 1 - square / 8, jnp.cos(angle / 2))
    return jnp.concatenate([w[None], scale * vector])


@_vectorize(signature="(4)->(3)")
def axis_angle_from_quaternion(quaternion: Float[Array, " 4"]) -> Float[Array, " 3"]:
    """Logarithm of a unit quaternion: axis times angle, the angle in 0 to pi radians."""
    quaternion = jnp.where(quaternion[0] < 0, -quaternion, quaternion)
    w, imaginary = quaternion[0], quaternion[1:]
    square = jnp.dot(imaginary, imaginary)
    small = square < _small(quaternion)
    length = jnp.sqrt(jnp.where(small, 1.0, square))
    # Near the identity w is close to 1; elsewhere the divisor only has to stay away from zero.
    safe_w = jnp.where(small, w, 1.0)
    scale = jnp.where(small, 2 / safe_w - 2 * square / (3 * safe_w**3), 2 * jnp.arctan2(length, w) / length)
    return scale * imaginary


def matrix_from_axis_angle(vector: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3 3"]:
    """Exponential map from axis times angle (radians) to a matrix."""
    return matrix_from_quaternion(quaternion_from_axis_angle(vector))


def axis_angle_from_matrix(matrix: Float[Array, "*batch 3 3"]) -> Float[Array, "*batch 3"]:
    """Logarithm map of a rotation matrix, the angle in 0 to pi radians."""
    return axis_angle_from_quaternion(quaternion_from_matrix(matrix))


@_vectorize(signature="(3,3),(3,3)->()")
def geodesic_distance(first: Float[Array, "3 3"], second: Float[Array, "3 3"]) -> Float[Array, ""]:
    """Angle in radians of the rotation between two rotations (Audio2Gestures, Eq. 2), in 0 to pi.

    The paper's arccos of the trace has an infinite gradient at equal rotations. The arctangent of sine and cosine
    has the same value and a gradient of at most about 1; at exactly 0 and 180 degrees, where the angle has a kink,
    the gradient is zero.
    """
    between = first.T @ second
    skew = jnp.array([between[2, 1] - between[1, 2], between[0, 2] - between[2, 0], between[1, 0] - between[0, 1]])
    return jnp.arctan2(safe_norm(skew) / 2, (jnp.trace(between) - 1) / 2)


@_vectorize(signature="(4),(4),()->(4)")
def slerp(start: Float[Array, " 4"], end: Float[Array, " 4"], weight: Float[Array | ndarray, ""]) -> Float[Array, " 4"]:
    """Spherical interpolation of unit quaternions along the shorter arc, ``weight`` 0 (start) to 1 (end)."""
    dot = jnp.dot(start, end)
    end = jnp.where(dot < 0, -end, end)
    # The angle between them from its sine and cosine: arccos loses half the digits near zero.
    across = safe_norm(end - jnp.abs(dot) * start)
    angle = jnp.arctan2(across, jnp.abs(dot))
    near = angle < jnp.sqrt(_small(start))
    safe = jnp.where(near, 1.0, angle)
    low = jnp.where(near, 1 - weight, jnp.sin((1 - weight) * safe) / jnp.sin(safe))
    high = jnp.where(near, weight, jnp.sin(weight * safe) / jnp.sin(safe))
    mixed = low * start + high * end
    return mixed / jnp.sqrt(jnp.dot(mixed, mixed))


def matrix_from_yxz(angles: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3 3"]:
    """``Ry(a) Rx(b) Rz(c)`` of angles a, b, c in radians.

    On a skeleton whose T-pose lies along x and has no rotations, these are an elbow's flexion and the forearm's twist,
    and a third angle that no elbow has: the rotations of a joint with two degrees of freedom are a plane.
    """
    (ca, cb, cc), (sa, sb, sc) = (jnp.moveaxis(f(angles), -1, 0) for f in (jnp.cos, jnp.sin))
    rows = (
        (ca * cc + sa * sb * sc, sa * sb * cc - ca * sc, sa * cb),
        (cb * sc, cb * cc, -sb),
        (ca * sb * sc - sa * cc, sa * sc + ca * sb * cc, ca * cb),
    )
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)


def yxz_from_matrix(matrix: Float[Array, "*batch 3 3"]) -> Float[Array, "*batch 3"]:
    """Inverse of :func:`matrix_from_yxz`: b within a quarter turn, a and c within half a turn."""
    first = jnp.arctan2(matrix[..., 0, 2], matrix[..., 2, 2])
    middle = jnp.arctan2(-matrix[..., 1, 2], jnp.hypot(matrix[..., 1, 0], matrix[..., 1, 1]))
    return jnp.stack([first, middle, jnp.arctan2(matrix[..., 1, 0], matrix[..., 1, 1])], axis=-1)
