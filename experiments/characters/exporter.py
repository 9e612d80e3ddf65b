"""A rig as a program writes it: skeleton, axes, unit and order, for BVH and GLB files."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh import write_bvh
from experiments.characters.person import Stance, bone_axes

Rows = list[tuple[str, str, str]]


@dataclass(frozen=True)
class Exporter:
    """A rig as a program writes it."""

    name: str
    rows: Rows
    """Joint, the joint above (empty for the root), and the part of the body where it is."""
    stance: Stance = field(default_factory=Stance)
    up: str = "Y"
    order: str = "ZXY"
    units: float = 100.0
    """Units of BVH files in a metre."""
    axes: str = ""
    """Axis along the bones in a GLB: ``X``, ``Y``, ``-X``; empty for those of the world."""
    facing: int = 1
    """1 for +z, -1 for -z."""

    def skeleton(self) -> tuple[Skeleton, Float[np.ndarray, "3"]]:
        """The skeleton with world axes at rest, and the place of its root, metres."""
        names = [name for name, _, _ in self.rows]
        parents = tuple(names.index(above) if above else -1 for _, above, _ in self.rows)
        places = np.array([self.stance.place(part) for _, _, part in self.rows])
        if self.facing < 0:
            places = places * (-1.0, 1.0, -1.0)
        if self.up == "Z":
            places = np.stack([places[:, 0], -places[:, 2], places[:, 1]], axis=1)
        offsets = places - places[[max(parent, 0) for parent in parents]]
        ends = tuple(self._end(joint, parents, places) for joint in range(len(names)) if joint not in parents)
        return Skeleton(offsets.astype(np.float32), tuple(names), parents, ends), places[0]

    def _end(self, joint: int, parents: tuple[int, ...], places: Float[np.ndarray, "J 3"]):
        tip = places[joint] - places[max(parents[joint], 0)]
        part = self.rows[joint][2]
        side = part[:2] if part[1:2] == "_" else ""
        far = {"Head": "HeadTop", "Wrist": "HandTip", "Foot": "ToeTip"}.get(part.removeprefix(side))
        if far is not None:
            tip = self.stance.place(side + far) - self.stance.place(part)
            tip = tip * (self.facing, 1.0, self.facing)
            tip = np.array([tip[0], -tip[2], tip[1]]) if self.up == "Z" else tip
        x, y, z = (tip * (1.0 if far else 0.8)).tolist()
        return joint, (x, y, z)

    def orientations(self) -> Float[np.ndarray, "J 3 3"]:
        """Axes of the joints at rest in the world, for GLB files."""
        skeleton, _ = self.skeleton()
        turns = np.tile(np.eye(3), (skeleton.joints, 1, 1))
        if not self.axes:
            return turns
        offsets = np.asarray(skeleton.offsets, np.float64)
        for joint in range(skeleton.joints):
            below = [child for child, above in enumerate(skeleton.parents) if above == joint]
            along = offsets[below[0]] if below else offsets[joint]
            if np.linalg.norm(along) < 1e-6:
                along = np.array([0.0, 1.0, 0.0])
            turns[joint] = bone_axes(along, self.axes, np.array([0.0, 1.0, 0.0]))
        return turns

    def write(self, path: Path) -> Path:
        """Write the rig at rest as BVH, two frames."""
        skeleton, root = self.skeleton()
        still = np.tile(np.eye(3, dtype=np.float32), (2, skeleton.joints, 1, 1))
        motion = Motion(still, np.tile(root, (2, 1)).astype(np.float32), skeleton, 30.0)
        write_bvh(path, motion, order=self.order, scale=self.units)
        return path


def with_names(rig: Exporter, names: dict[str, str]) -> Exporter:
    """A rig with other joint names."""
    rows = [(names.get(name, name), names.get(above, above), part) for name, above, part in rig.rows]
    return replace(rig, rows=rows)
