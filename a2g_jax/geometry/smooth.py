"""Motions without their high frequencies: shaking joints, noise of tracking."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.cutoff import CUTOFF
from a2g_jax.geometry.motion import Motion

_ORDER = 2


def smooth(motion: Motion, cutoff: float = CUTOFF, start: int = 0) -> Motion:
    """The motion with frequencies above ``cutoff`` removed; timing is unchanged.

    A Butterworth low-pass filter of second order runs forwards and backwards (zero phase; 6 dB down at the cutoff) over
    the root's path and over the unit quaternions of every joint, which are brought to the same hemisphere from frame to
    frame and normalised afterwards.

    Args:
        cutoff: frequency in Hz.
        start: number of frames at the beginning that are left as they are, such as a calibration pose.

    Raises:
        InputError: the cutoff is not between zero and half of the frame rate.
    """
    if not 0 < cutoff < motion.fps / 2:
        raise InputError(
            f"--smooth {cutoff:g}: expected a frequency below half of the frame rate, {motion.fps / 2:g} Hz here."
        )
    if motion.frames - start < 3:
        return motion
    if start > 0:
        rest = smooth(motion.clip(start, motion.frames), cutoff)
        first = motion.clip(0, start)
        both = (np.concatenate([np.asarray(one), two]) for one, two in
                ((first.rotations, rest.rotations), (first.root, rest.root)))  # fmt: skip
        rotations, root = both
        return replace(motion, rotations=rotations, root=root)
    rotations = np.asarray(motion.rotations)
    frames, joints = rotations.shape[:2]
    quaternions = Rotation.from_matrix(rotations.reshape(-1, 3, 3).astype(np.float64)).as_quat()
    quaternions = quaternions.reshape(frames, joints, 4)
    flips = np.sign(np.sum(quaternions[1:] * quaternions[:-1], axis=-1))
    flips[flips == 0] = 1.0
    quaternions[1:] *= np.cumprod(flips, axis=0)[..., None]
    turned = _low_pass(quaternions.reshape(frames, -1), motion.fps, cutoff).reshape(-1, 4)
    smoothed = Rotation.from_quat(turned).as_matrix().reshape(rotations.shape)
    root = _low_pass(np.asarray(motion.root, np.float64), motion.fps, cutoff)
    return replace(motion, rotations=smoothed.astype(np.float32), root=root.astype(np.float32))


def _low_pass(values: Float[np.ndarray, "T C"], fps: float, cutoff: float) -> Float[np.ndarray, "T C"]:
    from scipy import signal  # here, since it takes half a second

    filters = signal.butter(_ORDER, cutoff, fs=fps, output="sos")
    # Reflected about its ends, so that the first and the last pose stay where they are; long enough for the filter.
    pad = min(len(values) - 1, int(3 * fps / cutoff) + 6)
    return signal.sosfiltfilt(filters, values, axis=0, padtype="odd", padlen=pad)
