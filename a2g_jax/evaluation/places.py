"""Where the points of a pose are, whatever a corpus writes down: what distances are taken of."""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.body_joints import find_body
from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.rotation import matrix_from_6d, matrix_from_axis_angle
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton

Pose = Float[np.ndarray, "T R D"]
Points = Float[np.ndarray, "T P _"]


@dataclass(frozen=True, eq=False)
class Body:
    """What moves, and how a pose of it is written down."""

    form: Skeleton | PoseLayout
    representation: str = "6d"

    @property
    def metres(self) -> bool:
        """Whether places are metres; otherwise they are in the corpus's own unit."""
        return isinstance(self.form, Skeleton) or bool(self.representation == "directions" and self.form.lengths)

    @property
    def unit(self) -> str:
        """Of distances in a report."""
        return "cm" if self.metres else "units"

    @property
    def scale(self) -> float:
        """From places to that unit."""
        return 100.0 if self.metres else 1.0

    def rotations(self, pose: Pose) -> Float[np.ndarray, "T R 3 3"] | None:
        """Local rotations of joints; None where a pose has none."""
        if not isinstance(self.form, Skeleton):
            return None
        return np.asarray(_rotations(pose, self.representation))

    def places(self, pose: Pose) -> Points:
        """Joints in metres with the root at the origin; bones laid end to end in metres, or their directions where
        nobody says their lengths; keypoints as they are."""
        if isinstance(self.form, Skeleton):
            offsets = np.asarray(self.form.offsets, np.float32)
            return np.asarray(_positions(pose, offsets, self.form.parents, self.representation))
        if not self.metres:
            return np.asarray(pose)
        places = np.zeros((len(pose), len(self.form.names), 3), np.float32)
        for (start, end), length, way in zip(self.form.bones, self.form.lengths, np.swapaxes(pose, 0, 1), strict=True):
            places[:, end] = places[:, start] + length * way
        return places

    def wrists(self, places: Points) -> Float[np.ndarray, "T w _"]:
        """Both wrists, or every point of a body without."""
        body = find_body(self.form) if isinstance(self.form, Skeleton) else None
        if body is None:
            return places
        return places[:, [body[BODY_JOINTS.index(f"{side}_Wrist")] for side in "LR"]]

    def near(self, target: Points) -> float:
        """How near a point must come to count as correct: 20 cm (Audio2Gestures), or a fifth of the longer side of the
        box around the mean pose where there are no metres (after Speech2Gesture's alpha of 0.2)."""
        if self.metres:
            return 0.2
        mean = target.mean(axis=0)
        return float(0.2 * np.max(mean.max(axis=0) - mean.min(axis=0)))

    def reach(self) -> float | None:
        """From wrist to wrist along the bones in a T-pose, metres; None for a body whose wrists are not found."""
        body = find_body(self.form) if isinstance(self.form, Skeleton) else None
        if body is None or not isinstance(self.form, Skeleton):
            return None
        lengths, chains = np.linalg.norm(np.asarray(self.form.offsets), axis=-1), []
        for side in "LR":
            joint, chain = body[BODY_JOINTS.index(f"{side}_Wrist")], set()
            while joint >= 0:
                chain.add(joint)
                joint = self.form.parents[joint]
            chains.append(chain)
        return float(sum(lengths[joint] for joint in chains[0] ^ chains[1]))


@partial(jax.jit, static_argnums=1)
def _rotations(pose, representation):
    return matrix_from_6d(pose) if representation == "6d" else matrix_from_axis_angle(jnp.asarray(pose))


@partial(jax.jit, static_argnums=(2, 3))
def _positions(pose, offsets, parents, representation):
    return joint_positions(_rotations(pose, representation), offsets, parents)
