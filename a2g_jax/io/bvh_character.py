"""A rig in a BVH file, as a target of motion."""

import os
import re
from dataclasses import replace
from pathlib import Path

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.io.bvh_hierarchy import Layout
from a2g_jax.io.bvh_reader import doubts, read_with_layout
from a2g_jax.io.bvh_writer import write_like
from a2g_jax.io.gltf.figure import Surface

Offset = tuple[float, float, float]
_OFFSET = re.compile(r"(OFFSET)((?:[ \t]+[^\s{}]+){3})", re.IGNORECASE)


class BvhCharacter:
    """A rig whose motions are written in the layout of its file: names, channels, axes, order and unit."""

    suffix = ".bvh"

    def __init__(self, path: str | os.PathLike[str], metres: float | None = None) -> None:
        """Read a file.

        Args:
            metres: in one unit of the files that are written; None for the unit of this one.

        Raises:
            InputError: it cannot be read, or has no body with arms.
        """
        self.path = Path(path)
        example, layout = read_with_layout(self.path)
        self.rig = find_rig(example, name=str(self.path))
        self.metres = self.rig.unit_factor
        self._notes = [f"{self.path}: {doubt}" for doubt in doubts(layout)]
        self._layout = layout if metres is None or metres == layout.scale else in_unit(layout, metres)

    def notes(self) -> list[str]:
        """What is to be noticed about the file, a sentence each."""
        return self._notes

    def surfaces(self) -> list[Surface]:
        """None: there are no meshes in a BVH file."""
        return []

    def write(self, path: Path, motion: Motion) -> dict[str, float]:
        """Write a motion of the rig's skeleton; see :func:`~a2g_jax.io.bvh.write_like`."""
        return write_like(path, motion, self._layout)


def in_unit(layout: Layout, metres: float) -> Layout:
    """A layout with its lengths in another unit.

    Args:
        metres: in one unit of the result.
    """
    factor = layout.scale / metres

    def scaled(found: re.Match[str]) -> str:
        return f"{found[1]} " + " ".join(f"{float(number) * factor:.6f}" for number in found[2].split())

    def times(vector: Offset) -> Offset:
        x, y, z = vector
        return x * factor, y * factor, z * factor

    joints = [
        replace(
            joint,
            offset=None if joint.offset is None else times(joint.offset),
            ends=[times(end) for end in joint.ends],
        )
        for joint in layout.joints
    ]
    return replace(layout, head=_OFFSET.sub(scaled, layout.head), joints=joints, scale=metres)
