"""Motion from SMPL-X parameters, on the talker's skeleton.

SMPL-X (Pavlakos et al. 2019, "Expressive Body Capture") may not be redistributed, so its joints at rest, which depend
on the shape ``betas``, are not available: bones are those of the talker's average adult
(:data:`~a2g_jax.talker.skeleton.TALKER_HANDS_SKELETON`), which has SMPL-X's joints, order, tree and T-pose. Rotations
are therefore exact and positions approximate; ``betas`` are ignored.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.untrusted import check_read
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON, TALKER_SKELETON

#: Joints of the body, of jaw and eyes, and of both hands.
BODY, FACE, HANDS = slice(0, 22), slice(22, 25), slice(25, 55)
#: The pelvis at rest from the model's origin, which lies at the chest: about this, metres, for an average shape. A
#: posed body is ``R (x - pelvis) + pelvis + trans`` (README of the smplx package), so the pelvis is at pelvis + trans.
PELVIS_AT_REST = (0.0, -0.35, 0.0)
#: Longest rotation vector, radians: several turns are a sign of degrees.
_LARGEST_TURN = 4.0 * np.pi
#: Largest distance from the origin, metres: larger ones are a sign of another unit.
_FARTHEST = 1000.0


def smplx_motion(
    rotations: Float[np.ndarray, "T J 3"], translation: Float[np.ndarray, "T 3"], fps: float, place: str
) -> Motion:
    """Motion of the 22 body joints, or of those and the 30 finger joints.

    Args:
        rotations: rotation vectors, radians, of 22 or 52 joints in SMPL-X's order without jaw and eyes.
        translation: the model's ``trans``, metres, in a world with y up.
        place: for error messages.

    Raises:
        InputError: no frames, numbers that are not finite, or angles or positions in other units.
    """
    if len(rotations) == 0:
        raise InputError(f"{place}: holds no frames; leave this recording out.")
    for name, values in (("pose", rotations), ("translation", translation)):
        finite = np.isfinite(values).reshape(len(values), -1).all(axis=1)
        if not finite.all():
            raise InputError(f"{place}, frame {np.argmin(finite)}: NaN or infinity in the {name}; leave it out.")
    far = np.abs(translation).max(axis=1)
    if far.max() > _FARTHEST:
        raise InputError(
            f"{place}, frame {np.argmax(far)}: the translation is {far.max():.4g}; expected metres, up to {_FARTHEST}."
        )
    with np.errstate(over="ignore"):
        angles = np.linalg.norm(rotations, axis=-1)
    if angles.max() > _LARGEST_TURN:
        frame = int(np.argmax(angles.max(axis=1)))
        raise InputError(
            f"{place}, frame {frame}: a joint turns by {angles.max():.1f}; expected rotation vectors in radians."
        )
    matrices = Rotation.from_rotvec(np.asarray(rotations, np.float64).reshape(-1, 3)).as_matrix()
    return Motion(
        rotations=matrices.reshape(*rotations.shape[:2], 3, 3).astype(np.float32),
        root=(np.asarray(translation, np.float64) + PELVIS_AT_REST).astype(np.float32),
        skeleton=TALKER_SKELETON if rotations.shape[1] == BODY.stop else TALKER_HANDS_SKELETON,
        fps=fps,
    )


def float_array(value: object, shapes: tuple[tuple[int, ...], ...], place: str) -> Float[np.ndarray, "T ..."]:
    """``value``, an array or a list of rows, as float64 numbers of ``(T, *shape)`` with the first of the shapes.

    Args:
        shapes: allowed shapes of a row.
        place: for error messages.

    Raises:
        InputError: not numbers, or of another shape.
    """
    check_read(value)
    try:
        array = np.asarray(value) if isinstance(value, np.ndarray | list | tuple) else None
    except ValueError:  # rows of unequal length
        array = None
    if array is not None and array.dtype.kind in "fiu" and array.ndim > 0 and array.shape[1:] in shapes:
        return array.astype(np.float64).reshape(len(array), *shapes[0])
    wanted = " or ".join("(T" + "".join(f", {size}" for size in shape) + ")" for shape in shapes)
    got = type(value).__name__ if array is None else f"{array.dtype} of shape {array.shape}"
    raise InputError(f"{place}: expected numbers of shape {wanted}; got {got}.")
