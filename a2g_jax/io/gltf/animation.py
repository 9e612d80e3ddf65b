"""A motion as an animation of the nodes of a GLB file."""

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import world_rotations
from a2g_jax.io.gltf.buffers import Buffer

#: A track whose values differ by no more than this is written as one key.
_STILL = 1e-7


def continuous_quaternions(rotations: Float[np.ndarray, "T 3 3"]) -> Float[np.ndarray, "T 4"]:
    """Unit quaternions (x, y, z, w) of rotations, each with the sign that is nearer to the one before.

    Players interpolate components, and take the long way round between neighbours of opposite signs.
    """
    found = Rotation.from_matrix(np.asarray(rotations, np.float64)).as_quat()
    flips = np.sum(found[1:] * found[:-1], axis=1) < 0
    signs = np.concatenate([[1.0], np.where(np.cumsum(flips) % 2 == 1, -1.0, 1.0)])
    start = -1.0 if found[0, 3] < 0 else 1.0
    return found * (start * signs)[:, None]


class Animation:
    """Tracks of nodes, with linear interpolation."""

    def __init__(self, buffer: Buffer, frames: int, fps: float) -> None:
        self._buffer = buffer
        self._channels: list[dict[str, Any]] = []
        self._samplers: list[dict[str, Any]] = []
        times = (np.arange(frames, dtype=np.float64) / fps).astype(np.float32)
        self._times = buffer.add(times, bounds=True)
        self._start = buffer.add(times[:1], bounds=True) if frames > 1 else self._times

    def add(self, node: int, path: str, values: Float[np.ndarray, "T n"]) -> None:
        """Add a track.

        Args:
            path: ``translation`` or ``rotation``.
        """
        still = float(np.ptp(values, axis=0).max()) <= _STILL
        output = self._buffer.add(np.asarray(values[:1] if still else values, np.float32))
        self._samplers.append(
            {"input": self._start if still else self._times, "interpolation": "LINEAR", "output": output}
        )
        self._channels.append({"sampler": len(self._samplers) - 1, "target": {"node": node, "path": path}})

    def finished(self, name: str) -> dict[str, Any]:
        """The animation as JSON."""
        return {"name": name, "channels": self._channels, "samplers": self._samplers}


def node_tracks(
    motion: Motion,
    rest: Float[np.ndarray, "J 3 3"],
    above: tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"], float],
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T J 3 3"]]:
    """Translations of the first joint's node and rotations of all nodes, relative to the node above each.

    Args:
        rest: orientation of each node in the world where the motion's rotations are zero.
        above: position, orientation and scale of the node above the first joint.
    """
    parents = motion.skeleton.parents
    world = world_rotations(np.asarray(motion.rotations, np.float64), parents) @ rest
    position, turn, scale = above
    local = world.copy()
    local[:, 0] = turn.T @ world[:, 0]
    for joint, parent in enumerate(parents[1:], start=1):
        local[:, joint] = np.swapaxes(world[:, parent], -1, -2) @ world[:, joint]
    return (np.asarray(motion.root, np.float64) - position) @ turn / scale, local
