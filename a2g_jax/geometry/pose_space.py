"""The meaning of a pose's numbers: rotations of joints, directions of bones, or keypoints.

This module and :mod:`a2g_jax.geometry.pose_rows` alone compare the kinds of poses by name; all others use a
:class:`PoseSpace`.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.body_joints import find_wrists
from a2g_jax.geometry.euler import continuous_yxz
from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_kinds import WIDTHS as WIDTHS
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_rows import FROM_MATRIX, TO_MATRIX, layout_rows, rotations_from_rows
from a2g_jax.geometry.rotation import matrix_from_6d, matrix_to_6d
from a2g_jax.geometry.skeleton import Skeleton

#: Names of the rows of a pose, for messages.
_NOUNS = {
    "6d": "joints",
    "exponential": "joints",
    "euler": "joints",
    "directions": "bone directions",
    "keypoints": "keypoints",
}


@dataclass(frozen=True, eq=False)
class PoseSpace:
    """A body and the kind of numbers that its poses are written in."""

    body: Skeleton | PoseLayout
    """Rows of a pose: joints of a skeleton, or points and bones."""
    kind: str = "6d"
    """A key of :data:`WIDTHS`."""

    def __post_init__(self) -> None:
        """Refuse a kind that does not exist, and rotations without a skeleton."""
        if self.kind not in WIDTHS:
            raise InputError(f"poses: there is no kind {self.kind!r}; there are: {', '.join(WIDTHS)}.")
        if self.has_rotations != isinstance(self.body, Skeleton):
            raise ValueError(f"expected a skeleton for rotations, and a layout otherwise; got {self.kind}")

    @property
    def rows(self) -> int:
        """Rows of a pose: joints, bones or points."""
        if isinstance(self.body, Skeleton):
            return self.body.joints
        return layout_rows(self.body, self.kind)

    @property
    def width(self) -> int:
        """Values of a row."""
        return WIDTHS[self.kind]

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a pose."""
        return self.rows, self.width

    @property
    def noun(self) -> str:
        """Name of the rows, for messages."""
        return _NOUNS[self.kind]

    @property
    def has_rotations(self) -> bool:
        """Whether poses are rotations of a skeleton's joints."""
        return self.kind in FROM_MATRIX

    @property
    def unit_scale(self) -> bool:
        """Whether values are of order one by construction, so that networks may take them without normalisation."""
        return self.kind == "6d"

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton whose rotations poses are.

        Raises:
            InputError: poses are keypoints or directions.
        """
        if not isinstance(self.body, Skeleton):
            raise InputError(
                f"poses are {self.noun}, which have no skeleton; this needs --pose 6d, exponential or euler."
            )
        return self.body

    def same_as(self, other: "PoseSpace") -> bool:
        """Whether both have the same kind of poses on the same joints, points or bones, whatever their lengths."""
        if self.kind != other.kind:
            return False
        if isinstance(self.body, Skeleton) and isinstance(other.body, Skeleton):
            return self.body.same_tree(other.body)
        return self.body.names == other.body.names

    def rotations(self, pose: Float[Array, "*S R D"]) -> Float[Array, "*S R 3 3"] | None:
        """Local rotation matrices; None where poses are no rotations."""
        if not self.has_rotations:
            return None
        return TO_MATRIX[self.kind](pose)

    def from_rotations(self, rotations: Float[Array, "*S R 3 3"]) -> Float[Array, "*S R D"]:
        """Poses of local rotation matrices.

        Raises:
            InputError: poses are keypoints or directions.
        """
        if not self.has_rotations:
            raise InputError(f"poses are {self.noun}; rotations cannot be written as these.")
        return FROM_MATRIX[self.kind](rotations)

    def joint_positions(self, rotations: Float[Array, "*S R 3 3"]) -> Float[Array, "*S R 3"]:
        """Joint positions of local rotations in metres, the root at the origin."""
        return joint_positions(rotations, jnp.asarray(self.skeleton.offsets), self.skeleton.parents)

    def valid(
        self, pose: Float[Array, "*S R D"], rotations: Float[Array, "*S R 3 3"] | None = None
    ) -> Float[Array, "*S R D"]:
        """The pose that a network's raw output stands for: orthonormal 6D, directions of length 1, others as given.

        Args:
            rotations: of the pose, where they have been computed before.
        """
        if self.kind == "6d":
            return matrix_to_6d(matrix_from_6d(pose) if rotations is None else rotations)
        if self.kind == "directions":
            return pose / jnp.maximum(jnp.linalg.norm(pose, axis=-1, keepdims=True), 1e-6)
        return pose

    def continuous(
        self, pose: Float[np.ndarray, "T R D"], near: Float[np.ndarray, "R D"]
    ) -> Float[np.ndarray, "T R D"]:
        """The same poses in numbers that do not jump where the motion does not, as euler angles do at half a turn.

        Args:
            near: a pose that the first one is to be near in numbers, such as the mean of a corpus.
        """
        return continuous_yxz(pose, near) if self.kind == "euler" else pose

    @property
    def metres(self) -> bool:
        """Whether positions are metres; otherwise they are in the corpus's own unit."""
        return self.has_rotations or bool(self.kind == "directions" and self.body.lengths)  # type: ignore[union-attr]

    @property
    def unit(self) -> str:
        """Unit of distances in a report."""
        return "cm" if self.metres else "units"

    @property
    def scale(self) -> float:
        """Factor from positions to :attr:`unit`."""
        return 100.0 if self.metres else 1.0

    def read(self, pose: Float[np.ndarray, "T R D"]) -> Float[np.ndarray, "T R 3 3"] | None:
        """:meth:`rotations`, compiled, as a NumPy array."""
        return np.asarray(_rotations(jnp.asarray(pose), _Kind(self))) if self.has_rotations else None

    def write(self, rotations: Float[np.ndarray, "T R 3 3"]) -> Float[np.ndarray, "T R D"]:
        """:meth:`from_rotations`, compiled, as a NumPy array.

        Raises:
            InputError: poses are keypoints or directions.
        """
        return np.asarray(_poses(rotations, _Kind(self)))

    def positions(self, pose: Float[np.ndarray, "T R D"]) -> Float[np.ndarray, "T P _"]:
        """Positions of the points of a pose, compiled, as a NumPy array.

        Joints in metres with the root at the origin; bones laid end to end in metres, or their directions where their
        lengths are not known; keypoints as they are.
        """
        if isinstance(self.body, Skeleton):
            return np.asarray(_positions(pose, np.asarray(self.body.offsets, np.float32), _Kind(self)))
        if not self.metres:
            return np.asarray(pose)
        places = np.zeros((len(pose), len(self.body.names), 3), np.float32)
        for (start, end), length, way in zip(self.body.bones, self.body.lengths, np.swapaxes(pose, 0, 1), strict=True):
            places[:, end] = places[:, start] + length * way
        return places

    def wrist_rows(self) -> tuple[int, ...] | None:
        """Joints of the left and right wrist, also of upper bodies without legs; None where they are not found."""
        return find_wrists(self.body) if isinstance(self.body, Skeleton) else None

    def wrists(self, positions: Float[np.ndarray, "T P _"]) -> Float[np.ndarray, "T w _"]:
        """Positions of both wrists, or of every point where wrists are not found."""
        rows = self.wrist_rows()
        return positions if rows is None else positions[:, list(rows)]

    def motion(
        self, pose: Float[np.ndarray, "T R D"], fps: float, root: Float[np.ndarray, "T 3"] | None = None
    ) -> Motion:
        """A motion of the skeleton, its root at the origin if not given.

        Raises:
            InputError: poses are keypoints or directions.
        """
        skeleton = self.skeleton
        rotations = rotations_from_rows(pose, self.kind)
        return Motion(rotations, np.zeros((len(rotations), 3), np.float32) if root is None else root, skeleton, fps)

    def mean_rotations(self, mean: Float[Any, "R D"]) -> Float[np.ndarray, "R 3 3"]:
        """Rotations of one pose, such as the mean of a corpus.

        Raises:
            InputError: poses are keypoints or directions.
        """
        _ = self.skeleton
        return rotations_from_rows(np.asarray(mean)[None], self.kind)[0]


class _Kind:
    """The static part of a pose space: one compilation for all spaces of one kind on one tree."""

    def __init__(self, space: PoseSpace) -> None:
        self.space = space
        self._key = (space.kind, space.body.parents if isinstance(space.body, Skeleton) else ())

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Kind) and self._key == other._key


@partial(jax.jit, static_argnums=1)
def _rotations(pose, kind: _Kind):
    return kind.space.rotations(pose)


@partial(jax.jit, static_argnums=1)
def _poses(rotations, kind: _Kind):
    return kind.space.from_rotations(rotations)


@partial(jax.jit, static_argnums=2)
def _positions(pose, offsets, kind: _Kind):
    rotations: Any = kind.space.rotations(jnp.asarray(pose))
    return joint_positions(rotations, offsets, kind.space.skeleton.parents)
