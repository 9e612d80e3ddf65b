"""A motion brought onto another skeleton, and turned to face another way."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion, resample
from a2g_jax.geometry.retarget.match import match_rigs
from a2g_jax.geometry.retarget.rig import find_rig
from a2g_jax.geometry.retarget.transfer import retarget
from a2g_jax.geometry.skeleton import Skeleton

#: Degrees by which a bone at rest may point elsewhere before a clip on the same joints is retargeted.
_SAME_REST = 1.0


def on_skeleton(motion: Motion, skeleton: Skeleton, fps: float, name: str, whole: Motion | None = None) -> Motion:
    """The rotations of a humanoid motion on another skeleton, at another rate.

    Args:
        name: of the motion, for messages.
        whole: the take that the motion is a part of, which may show the rig's reference pose; itself by default.

    Raises:
        InputError: a rig that is not recognised.
    """
    if not same_rest(motion.skeleton, skeleton):
        source = find_rig(motion if whole is None else whole, name=name)
        motion = retarget(motion, match_rigs(source, find_rig(skeleton, name="the run's skeleton")))
    # Bones of other lengths on the same joints need no retargeting: poses are rotations alone.
    return resample(replace(motion, skeleton=skeleton), fps)


def same_rest(first: Skeleton, second: Skeleton) -> bool:
    """Whether joints are the same and bones at rest point the same way, whatever their lengths."""
    if not first.same_tree(second):
        return False
    ours, theirs = (np.asarray(skeleton.offsets, np.float64)[1:] for skeleton in (first, second))
    lengths = np.linalg.norm(ours, axis=1) * np.linalg.norm(theirs, axis=1)
    bones = lengths > 1e-8
    cosine = (ours * theirs).sum(axis=1)[bones] / lengths[bones]
    return bool(np.all(cosine > np.cos(np.deg2rad(_SAME_REST))))


def face(motion: Motion, facing: Float[np.ndarray, "3 3"]) -> tuple[Motion, float]:
    """A motion turned about the vertical so that its root is, on the whole, nearest to a rotation; and the degrees.

    The angle has the least sum of squared differences of matrices in closed form: with ``A`` the sum of
    ``R_t F^T`` over frames, ``trace(Y A)`` is greatest.
    """
    moment = np.einsum("tij,kj->ik", np.asarray(motion.rotations[:, 0], np.float64), facing)
    angle = np.arctan2(moment[2, 0] - moment[0, 2], moment[0, 0] + moment[2, 2])
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    rotations, root = np.array(motion.rotations), np.asarray(motion.root)
    rotations[:, 0] = turn @ rotations[:, 0]
    turned = replace(motion, rotations=rotations, root=(root @ turn.T).astype(root.dtype))
    return turned, float(np.rad2deg(angle))
