"""Shapes of the arrays that are scored."""

import numpy as np
from jaxtyping import Float

#: Poses of one stretch, in the corpus's pose space.
Pose = Float[np.ndarray, "T R D"]
#: Positions of joints, bones' ends or keypoints.
Points = Float[np.ndarray, "T P _"]
