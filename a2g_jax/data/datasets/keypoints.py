"""Keypoints of videos in the format of Speech2Gesture and PATS: 49 of 52, relative to the neck."""

import numpy as np
from jaxtyping import Float

from a2g_jax.data.datasets.gaps import bridge_gaps
from a2g_jax.errors import InputError

#: Nose and both eyes of 52 points, which both data sets drop (``delete_face_keypoints``, ``joint_subset``).
_FACE = (7, 8, 9)
#: Largest distance of a keypoint from the neck, pixels.
_FARTHEST = 1e5


def relative_keypoints(points: Float[np.ndarray, "T P 2"], fps: float, place: str) -> Float[np.ndarray, "T 49 2"]:
    """The 49 points of 49, or of 52 with nose and eyes as points 7, 8 and 9, relative to point 0; float32.

    Gaps (NaN) are bridged for up to half a second (:func:`~a2g_jax.data.datasets.gaps.bridge_gaps`).

    Args:
        points: pixels.
        place: for error messages.

    Raises:
        InputError: a longer gap, or a point far outside of any image.
    """
    if points.shape[1] == 49 + len(_FACE):
        points = np.delete(points, _FACE, axis=1)
    points = bridge_gaps(points, fps, place)
    points = points - points[:, :1]
    far = np.abs(points).max(axis=(1, 2))
    if far.max() > _FARTHEST:
        raise InputError(
            f"{place}, frame {np.argmax(far)}: a keypoint is {far.max():.4g} from the neck; expected pixels."
        )
    return points.astype(np.float32)
