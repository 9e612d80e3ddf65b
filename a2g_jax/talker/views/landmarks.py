"""Named points of the talker in the world, from which the views are made: joints, finger tips and the face."""

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON

_FACE = {
    "Nose": (0.0, 0.25, 0.61),
    "R_Eye": (-0.18, 0.47, 0.46),
    "L_Eye": (0.18, 0.47, 0.46),
    "R_Ear": (-0.39, 0.40, 0.0),
    "L_Ear": (0.39, 0.40, 0.0),
}
"""In the frame of the head, in distances from the head joint to the crown."""


def require_fingers(motion: Motion) -> None:
    """Raise ``InputError`` unless the motion is one of the talker's with fingers."""
    if not motion.skeleton.same_tree(TALKER_HANDS_SKELETON):
        raise InputError(
            f"motion: has {motion.skeleton.joints} joints; this view shows fingers and needs the talker's"
            f" {TALKER_HANDS_SKELETON.joints}: make it with fingers=True."
        )


def landmarks(motion: Motion) -> dict[str, Float[np.ndarray, "T 3"]]:
    """Positions in the world, metres, of every joint and of further points.

    Those are, by name, ``"Nose"``, ``"R_Eye"``, ``"L_Eye"``, ``"R_Ear"``, ``"L_Ear"``, and for each joint that has an
    end site ``"<joint>_End"``: the crown (``"Head_End"``) and the finger tips (``"L_Index3_End"``).

    Args:
        motion: on the talker's skeleton, with or without fingers.

    Raises:
        InputError: the skeleton has no head with a crown.
    """
    skeleton = motion.skeleton
    ends = {skeleton.names[joint]: np.asarray(end) for joint, end in skeleton.ends}
    if "Head" not in ends:
        raise InputError("motion: has no joint 'Head' with an end site; this view needs a motion of the talker.")
    positions = np.asarray(motion.positions(), np.float64)
    turns = np.asarray(motion.world_rotations(), np.float64)
    points = {name: positions[:, joint] for joint, name in enumerate(skeleton.names)}
    for name, end in ends.items():
        points[f"{name}_End"] = points[name] + turns[:, skeleton.index(name)] @ end
    crown = float(np.linalg.norm(ends["Head"]))
    for name, place in _FACE.items():
        points[name] = points["Head"] + turns[:, skeleton.index("Head")] @ (crown * np.asarray(place))
    return points
