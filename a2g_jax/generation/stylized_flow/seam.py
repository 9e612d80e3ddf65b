"""The beginning of a motion that continues a clip."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.generation.pins.offsets import Shape, decay, offset_vectors, turned
from a2g_jax.generation.seed_bounds import PASSAGE
from a2g_jax.geometry.motion import Motion

#: Seconds in which the difference of the speeds of a clip and the motion passes.
_SETTLING = 0.5


def continued(rotations: Float[np.ndarray, "T J 3 3"], clip: Motion) -> Float[np.ndarray, "T J 3 3"]:
    """Rotations that begin one frame after the clip's last pose, with its velocity.

    A flow continues seed poses with a change of a few centimetres: its first poses are drawn, and those of a spline are
    fitted to frames on both sides. A clip outside of the training range differs from its seed poses, too. Both
    differences decay over the first second and a half; the motion is continued backwards by its own first velocity to
    measure them.

    Args:
        clip: on the same skeleton, at the same rate.
    """
    if clip.frames < 2 or len(rotations) < 2:
        return rotations
    shape = (-1, 3, 3)
    first = Rotation.from_matrix(np.asarray(rotations[0], np.float64).reshape(shape))
    step = Rotation.from_matrix(np.asarray(rotations[1], np.float64).reshape(shape)) * first.inv()
    back = [Rotation.from_rotvec(-count * step.as_rotvec()) * first for count in (1, 2)]
    motion = np.stack([one.as_matrix() for one in back])
    offsets = offset_vectors(np.asarray(clip.rotations[-2:], np.float64)[::-1], motion)
    passage = decay(offsets, Shape(round(PASSAGE * clip.fps), round(_SETTLING * clip.fps)))[: len(rotations)]
    begun = turned(np.asarray(rotations[: len(passage)], np.float64), passage)
    return np.concatenate([begun.astype(np.float32), rotations[len(passage) :]])
