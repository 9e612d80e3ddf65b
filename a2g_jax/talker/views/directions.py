"""View in the format of the TED data sets: unit directions of bones, at 15 frames per second.

Two layouts. ``TED`` (Yoon et al. 2020, "Speech Gesture Generation from the Trimodal Context"): 10 joints, 9 bones, 27
values. ``TED_EXPRESSIVE`` (Liu et al. 2022, "Learning Hierarchical Cross-Modal Association for Co-Speech Gesture
Generation"): 43 joints with fingers, 42 bones, 126 values. Both have y down and a right-handed frame. In TED the
speaker's left is -x and z points forward, out of the chest; in TED-Expressive, which keeps the camera's axes, the left
is +x and z points away from the camera, into the chest.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion, resample
from a2g_jax.talker.views.landmarks import landmarks, require_fingers


@dataclass(frozen=True)
class BoneLayout:
    """Joints, the bones between them in the order of the data, and the axes."""

    points: tuple[str, ...]
    """The talker's landmark at each joint."""
    bones: tuple[tuple[int, int], ...]
    """Start and end joint; a joint is the end of a bone before it is the start of another."""
    lengths: tuple[float, ...]
    """Lengths of the bones that the data set's authors use to draw poses, metres."""
    axes: tuple[float, float, float]
    """Signs of the talker's x (left), y (up) and z (forward) in the data."""

    @property
    def fingers(self) -> bool:
        """Whether there are fingers among the joints."""
        return any("Index" in point for point in self.points)


TED = BoneLayout(
    points=(
        "Spine2", "Neck", "Nose", "Head_End", "L_Shoulder", "L_Elbow", "L_Wrist", "R_Shoulder", "R_Elbow", "R_Wrist",
    ),
    bones=((0, 1), (1, 2), (2, 3), (1, 4), (4, 5), (5, 6), (1, 7), (7, 8), (8, 9)),
    lengths=(0.26, 0.18, 0.14, 0.22, 0.36, 0.33, 0.22, 0.36, 0.33),
    axes=(-1.0, -1.0, 1.0),
)  # fmt: skip
"""9 bones: spine to neck, nose and crown; left shoulder, arm and forearm; right shoulder, arm and forearm."""


def _expressive() -> BoneLayout:
    points = ["Spine2", "Neck"]
    points += [f"{side}_{joint}" for joint in ("Shoulder", "Elbow", "Wrist") for side in "LR"]
    bones, lengths = [(0, 1), (1, 2), (1, 3)], [0.26, 0.22, 0.22]
    hand = {
        "Index": (0.137, 0.044, 0.031),
        "Middle": (0.144, 0.042, 0.033),
        "Pinky": (0.127, 0.027, 0.026),
        "Ring": (0.134, 0.039, 0.033),
        "Thumb": (0.068, 0.042, 0.036),
    }
    for side, shoulder in (("L", 2), ("R", 3)):
        wrist = shoulder + 4
        bones += [(shoulder, shoulder + 2), (shoulder + 2, wrist)]
        lengths += [0.36, 0.33]
        for finger, sizes in hand.items():
            for number, size in enumerate(sizes, start=1):
                bones.append((wrist if number == 1 else len(points) - 1, len(points)))
                points.append(f"{side}_{finger}{number}")
                lengths.append(size)
    nose = len(points)
    points += ["Nose", "R_Eye", "L_Eye", "R_Ear", "L_Ear"]
    bones += [(1, nose), (nose, nose + 1), (nose, nose + 2), (nose + 1, nose + 3), (nose + 2, nose + 4)]
    lengths += [0.18, 0.14, 0.14, 0.15, 0.15]
    return BoneLayout(tuple(points), tuple(bones), tuple(lengths), (1.0, -1.0, -1.0))


TED_EXPRESSIVE = _expressive()
"""42 bones: spine to neck, both shoulders; left arm, forearm and five fingers of three bones (index, middle, little,
ring, thumb); the same on the right; nose, eyes and ears."""


def view_positions(motion: Motion, layout: BoneLayout, fps: float = 15.0) -> Float[np.ndarray, "T P 3"]:
    """Joints of the layout in the data set's axes, metres; frame k shows time ``k / fps``.

    Raises:
        InputError: the layout has fingers and the motion has none.
    """
    if layout.fingers:
        require_fingers(motion)
    points = landmarks(resample(motion, fps))
    return np.stack([points[name] for name in layout.points], axis=1) * np.asarray(layout.axes)


def bone_lengths(positions: Float[np.ndarray, "T P 3"], layout: BoneLayout) -> Float[np.ndarray, "T B"]:
    """Length of every bone, in the unit of the positions."""
    return np.linalg.norm(_bones(positions, layout), axis=-1)


def directions_from_positions(positions: Float[np.ndarray, "T P 3"], layout: BoneLayout) -> Float[np.ndarray, "T V"]:
    """Unit vector along every bone, one after the other; a bone without length gives zeros."""
    bones = _bones(positions, layout)
    length = np.linalg.norm(bones, axis=-1, keepdims=True)
    return (bones / np.where(length > 0.0, length, 1.0)).reshape(len(positions), -1)


def directions(motion: Motion, layout: BoneLayout, fps: float = 15.0) -> Float[np.ndarray, "T V"]:
    """The view: 27 (:data:`TED`) or 126 (:data:`TED_EXPRESSIVE`) values a frame.

    The loaders of both data sets subtract the mean over their training set; this view does not.

    Args:
        motion: of the talker; with fingers for TED-Expressive.

    Raises:
        InputError: the layout has fingers and the motion has none.
    """
    return directions_from_positions(view_positions(motion, layout, fps), layout)


def positions_from_directions(
    values: Float[np.ndarray, "T V"],
    layout: BoneLayout,
    lengths: Float[np.ndarray, "*frames B"] | None = None,
    start: Float[np.ndarray, "*frames 3"] | None = None,
) -> Float[np.ndarray, "T P 3"]:
    """Joints at the ends of the bones: the inverse of :func:`directions_from_positions`.

    Args:
        lengths: of the bones, constant or for each frame; by default those of the data set's authors.
        start: where joint 0 is; by default at the origin.
    """
    vectors = values.reshape(len(values), len(layout.bones), 3)
    sizes = np.asarray(layout.lengths) if lengths is None else lengths
    vectors = vectors * sizes[..., None]
    positions = np.zeros((len(values), len(layout.points), 3))
    positions[:, 0] = 0.0 if start is None else start
    for bone, (above, joint) in enumerate(layout.bones):
        positions[:, joint] = positions[:, above] + vectors[:, bone]
    return positions


def _bones(positions: Float[np.ndarray, "T P 3"], layout: BoneLayout) -> Float[np.ndarray, "T B 3"]:
    above, joint = np.array(layout.bones).T
    return positions[:, joint] - positions[:, above]
