"""Rotations of finished motions in NumPy: the same as :mod:`a2g_jax.geometry.rotation`, without compiling anything."""

import numpy as np
from jaxtyping import Float


def matrices_from_6d(six: Float[np.ndarray, "*batch 6"]) -> Float[np.ndarray, "*batch 3 3"]:
    """As :func:`a2g_jax.geometry.rotation.matrix_from_6d` outside of compiled functions, to the last bit.

    Each operation is rounded by itself in single precision, in the same order; compiled together, some are fused, and
    the last bits are others.
    """
    six = np.asarray(six, np.float32)
    eps, one, zero = np.finfo(np.float32).eps, np.float32(1.0), np.float32(0.0)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        ax, ay, az, bx, by, bz = np.moveaxis(six, -1, 0)
        square = ax * ax + ay * ay + az * az
        usable = (square > eps) & (square < np.inf)
        inverse = one / np.sqrt(np.where(usable, square, one))
        ax, ay, az = (np.where(usable, value * inverse, spare) for value, spare in ((ax, one), (ay, zero), (az, zero)))
        along = ax * bx + ay * by + az * bz
        rx, ry, rz = bx - along * ax, by - along * ay, bz - along * az
        square = rx * rx + ry * ry + rz * rz
        usable = square > eps * (bx * bx + by * by + bz * bz)
        least_x = (np.abs(ax) <= np.abs(ay)) & (np.abs(ax) <= np.abs(az))
        least_y = ~least_x & (np.abs(ay) <= np.abs(az))
        kx, ky = np.where(least_x, one, zero), np.where(least_y, one, zero)
        kz = one - kx - ky
        along = kx * ax + ky * ay + kz * az
        bx, by, bz = (
            np.where(usable, value, spare)
            for value, spare in ((rx, kx - along * ax), (ry, ky - along * ay), (rz, kz - along * az))
        )
        inverse = one / np.sqrt(bx * bx + by * by + bz * bz)
        bx, by, bz = bx * inverse, by * inverse, bz * inverse
        cross = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    rows = [np.stack(row, axis=-1) for row in zip((ax, ay, az), (bx, by, bz), cross, strict=True)]
    return np.stack(rows, axis=-2)
