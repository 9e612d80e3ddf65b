"""Motion of a skeleton: joint rotations and a root path over time."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import jax
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.geometry.kinematics import global_rotations, joint_positions
from a2g_jax.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, slerp
from a2g_jax.geometry.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Motion:
    """T frames of a moving skeleton; a pytree whose ``fps`` is static."""

    rotations: Float[Array | np.ndarray, "T J 3 3"]
    """Local rotation matrices (parent from joint); those of the root are its orientation in the world."""
    root: Float[Array | np.ndarray, "T 3"]
    """Position of the root joint in the world, metres."""
    skeleton: Skeleton
    fps: float

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return int(self.rotations.shape[0])

    @property
    def seconds(self) -> float:
        """Length: frames / fps."""
        return self.frames / self.fps

    def positions(self) -> Float[np.ndarray, "T J 3"]:
        """World positions of every joint, metres."""
        offsets = np.asarray(self.skeleton.offsets, np.float32)
        local = _in_chunks(lambda r: _positions(r, offsets, self.skeleton.parents), np.asarray(self.rotations))
        return local + np.asarray(self.root)[:, None]

    def world_rotations(self) -> Float[np.ndarray, "T J 3 3"]:
        """Orientation of every joint in the world."""
        return _in_chunks(lambda r: _world_rotations(r, self.skeleton.parents), np.asarray(self.rotations))

    def clip(self, start: int, stop: int) -> "Motion":
        """Frames ``start`` to ``stop`` (exclusive)."""
        return replace(self, rotations=self.rotations[start:stop], root=self.root[start:stop])


jax.tree_util.register_dataclass(Motion, data_fields=["rotations", "root", "skeleton"], meta_fields=["fps"])

_positions = jax.jit(joint_positions, static_argnums=2)


@partial(jax.jit, static_argnums=1)
def _world_rotations(rotations: Array, parents: tuple[int, ...]) -> Array:
    return jax.vmap(lambda frame: global_rotations(frame, parents))(rotations)


#: Frames per call of a compiled kernel, so that a new length of motion needs no compilation.
_CHUNK = 512


def _in_chunks(kernel: Callable[..., Array], *arrays: np.ndarray) -> np.ndarray:
    """A per-frame kernel over any number of frames, in calls of one fixed shape."""
    frames = len(arrays[0])
    parts = []
    for start in range(0, frames, _CHUNK):
        rows = np.minimum(np.arange(start, start + _CHUNK), frames - 1)
        parts.append(np.asarray(kernel(*(array[rows] for array in arrays)))[: frames - start])
    if not parts:
        rows = np.asarray(kernel(*(np.zeros((1, *array.shape[1:]), array.dtype) for array in arrays)))
        return rows[:0]
    return np.concatenate(parts)


def resample(motion: Motion, fps: float, frames: int | None = None) -> Motion:
    """The same motion at another frame rate: slerp for rotations, linear for the root, at exact timestamps.

    Frame k of the result is the input at time ``k / fps``; frame k of the input is at ``k / motion.fps``. Beyond its
    last frame, that frame is repeated.

    Args:
        frames: length of the result; by default ``round(motion.seconds * fps)``.
    """
    if motion.frames == 0:
        raise ValueError("Expected at least one frame; got an empty motion.")
    if frames is None:
        frames = max(1, round(motion.seconds * fps))
    if fps == motion.fps and frames == motion.frames:
        return motion
    where = np.minimum(np.arange(frames) * (motion.fps / fps), motion.frames - 1)
    low = np.minimum(np.floor(where).astype(np.int64), max(motion.frames - 2, 0))
    high = np.minimum(low + 1, motion.frames - 1)
    weight = (where - low).astype(np.float32)
    matrices = np.asarray(motion.rotations)
    rotations = _in_chunks(_slerp_matrices, matrices[low], matrices[high], weight)
    old_root = np.asarray(motion.root)
    root = old_root[low] * (1 - weight)[:, None] + old_root[high] * weight[:, None]
    return replace(motion, rotations=rotations, root=root.astype(np.float32), fps=float(fps))


@jax.jit
def _slerp_matrices(start, end, weight):
    one = lambda a, b, w: matrix_from_quaternion(  # noqa: E731
        slerp(quaternion_from_matrix(a), quaternion_from_matrix(b), w)
    )
    return jax.vmap(jax.vmap(one, (0, 0, None)))(start, end, weight)
