"""A skinned character in a GLB or VRM file, as a target of motion."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.geometry.anthropometry import Unit, find_unit, stature
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.gltf.animation import Animation, continuous_quaternions, node_tracks
from a2g_jax.io.gltf.buffers import Buffer
from a2g_jax.io.gltf.container import read_glb, write_glb
from a2g_jax.io.gltf.figure import Surface
from a2g_jax.io.gltf.mesh import read_surfaces
from a2g_jax.io.gltf.nodes import read_nodes
from a2g_jax.io.gltf.rig import find_node_rig

#: Name of the animation in the files.
ANIMATION = "gesture"


class GlbCharacter:
    """A character whose file comes back with one more animation, and is otherwise as it was."""

    suffix = ".glb"

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Read a file.

        Raises:
            InputError: it cannot be read, or has no body with arms.
        """
        self._glb = read_glb(path)
        self.path = self._glb.path
        self._found = find_node_rig(self._glb)
        self.rig = self._found.rig
        tall = stature(self.rig.skeleton, self.rig.roles)
        self._unit = Unit("metres", 1.0) if tall is None else find_unit(tall, 1.0)
        self.metres = self._unit.metres
        _ = Buffer(self._glb)  # a file that cannot be added to is refused before any work

    def notes(self) -> list[str]:
        """What is to be noticed about the file, a sentence each."""
        found = [] if self.metres == 1.0 else [f"{self.path}: {self._unit}"]
        images = self._glb.document.get("images", [])
        outside = [
            image["uri"]
            for image in images
            if isinstance(image, dict) and isinstance(image.get("uri"), str) and not image["uri"].startswith("data:")
        ]
        if outside:
            found.append(f"{self.path}: has textures in other files ({outside[0]}); copy them beside what is written")
        return found

    def surfaces(self) -> list[Surface]:
        """The meshes in the reference pose, in plain axes and metres.

        Raises:
            InputError: there are none, or they are compressed or damaged.
        """
        return read_surfaces(self._glb, self._found, self.metres)

    def write(self, path: Path, motion: Motion) -> dict[str, float]:
        """Write the file with the motion as its first animation; nothing is approximated, so nothing is returned.

        The first joint's node gets translations, and every joint's node gets rotations: one sampler each, linear
        between quaternions whose signs do not jump. Tracks that do not move have one key.

        Raises:
            InputError: the motion has another skeleton, no frames, or NaN.
        """
        if not motion.skeleton.same_tree(self.rig.skeleton):
            raise InputError(f"{path}: not written: the motion is not of the joints of {self.path}.")
        check_motion_values(path, motion)
        buffer = Buffer(self._glb)
        places, turns = node_tracks(motion, self._found.rest, self._found.above)
        animation = Animation(buffer, motion.frames, motion.fps)
        animation.add(self._found.nodes[0], "translation", places)
        for joint, node in enumerate(self._found.nodes):
            animation.add(node, "rotation", continuous_quaternions(turns[:, joint]))
        document, binary = buffer.finished()
        document["nodes"] = self._nodes()
        document["animations"] = [animation.finished(ANIMATION), *document.get("animations", [])]
        write_glb(path, document, binary)
        return {}

    def _nodes(self) -> list[dict[str, Any]]:
        """The nodes of the file; animated ones may have no matrix, so it becomes translation, rotation and scale."""
        rows = list(self._glb.document["nodes"])
        if not any("matrix" in rows[node] for node in self._found.nodes):
            return rows
        nodes = read_nodes(self._glb)
        for node in self._found.nodes:
            if "matrix" in rows[node]:
                own = nodes[node]
                row = {key: value for key, value in rows[node].items() if key != "matrix"}
                rows[node] = row | {
                    "translation": own.translation.tolist(),
                    "rotation": continuous_quaternions(own.rotation[None])[0].tolist(),
                    "scale": own.scale.tolist(),
                }
        return rows


def check_motion_values(path: object, motion: Motion) -> None:
    """Refuse a motion that a file cannot hold.

    Raises:
        InputError: no frames, NaN or infinities.
    """
    if motion.frames == 0:
        raise InputError(f"{path}: not written: the motion has no frames.")
    for what, values in (("rotations", motion.rotations), ("root", motion.root)):
        bad = np.argwhere(~np.isfinite(np.asarray(values)))
        if len(bad):
            raise InputError(f"{path}: not written: NaN or infinity in the {what} of frame {bad[0][0]}.")
