"""The root of a motion from its rotations."""

from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.footholds import lock_feet
from a2g_jax.geometry.ground import plant_feet
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton


def planted(
    rotations: Float[np.ndarray, "T J 3 3"], skeleton: Skeleton, fps: float, root: Any, mean_pose: Any
) -> Motion:
    """The motion of local rotations, with a root that plants the feet as in the mean pose, and legs that keep standing
    feet where they are.

    Args:
        root: (3,), mean position of the root in the training data.
        mean_pose: (J, 3, 3), local rotations.
    """
    still = Motion(rotations, np.zeros((len(rotations), 3), np.float32), skeleton, fps)
    return lock_feet(plant_feet(still, np.asarray(root), mean_pose))
