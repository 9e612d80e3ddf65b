"""A root path for models that predict rotations only."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS

#: The path is smoothed by a Gaussian this wide, seconds: enough to keep noise in the legs out of the whole body.
_SMOOTHING = 0.1
_ANKLES = tuple(BODY_JOINTS.index(name) for name in ("L_Ankle", "R_Ankle"))


def plant_feet(motion: Motion, mean_root: Float[np.ndarray, " 3"], mean_pose: Float[np.ndarray, "J 3 3"]) -> Motion:
    """Move the root so that the middle between the ankles stays where it is in the mean pose.

    When the hips sway over standing feet, rotations alone would swing the feet under fixed hips. Skeletons without
    recognisable ankles get the mean root position throughout.

    Args:
        mean_root: mean root position over the training data, metres; its height counts, the figure stands at x = z = 0.
        mean_pose: mean local rotations over the training data.
    """
    start = np.array([0.0, mean_root[1], 0.0], np.float32)
    body = find_body_joints(motion.skeleton)
    if body is None:
        return replace(motion, root=np.tile(start, (motion.frames, 1)))
    ankles = [body[joint] for joint in _ANKLES]
    still = Motion(mean_pose[None], start[None], motion.skeleton, motion.fps).positions()[0, ankles].mean(axis=0)
    under = replace(motion, root=np.zeros((motion.frames, 3), np.float32)).positions()[:, ankles].mean(axis=1)
    root = gaussian_filter1d(still - under, _SMOOTHING * motion.fps, axis=0, mode="nearest")
    return replace(motion, root=root.astype(np.float32))
