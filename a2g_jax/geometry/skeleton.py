"""Skeletons: joint trees with fixed bone lengths."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import jax
import numpy as np
from jaxtyping import Array, Float

#: The 22 SMPL-X body joints, in SMPL-X order.
BODY_JOINTS: tuple[str, ...] = (
    "Pelvis",
    "L_Hip",
    "R_Hip",
    "Spine1",
    "L_Knee",
    "R_Knee",
    "Spine2",
    "L_Ankle",
    "R_Ankle",
    "Spine3",
    "L_Foot",
    "R_Foot",
    "Neck",
    "L_Collar",
    "R_Collar",
    "Head",
    "L_Shoulder",
    "R_Shoulder",
    "L_Elbow",
    "R_Elbow",
    "L_Wrist",
    "R_Wrist",
)

#: Parent of each of :data:`BODY_JOINTS`.
BODY_PARENTS: tuple[int, ...] = (
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A tree of joints with fixed bone lengths.

    A pytree: ``offsets`` is a leaf, everything else is static under ``jax.jit``.
    World coordinates are right-handed and Y-up, lengths are metres.
    """

    offsets: Float[Array | np.ndarray, "J 3"]
    """Position of each joint in its parent's frame at rest, in metres.

    Row 0 (the root) is not used by forward kinematics: the root's position is part of a motion.
    """
    names: tuple[str, ...]
    """One unique name a joint; static."""
    parents: tuple[int, ...]
    """Index of each joint's parent, -1 for the root; a parent comes before its children; static."""
    ends: tuple[tuple[int, tuple[float, float, float]], ...] = field(default=())
    """BVH end sites: (joint, offset in that joint's frame in metres); drawn and written, without rotation; static."""

    def __post_init__(self) -> None:
        # Leaves may be any object under tracing and tree transformations, so only static fields are checked.
        count = len(self.names)
        if len(self.parents) != count:
            raise ValueError(f"Expected one parent a joint; got {len(self.parents)} parents for {count} names.")
        if count == 0 or self.parents[0] != -1:
            raise ValueError("Expected joint 0 to be the root, with parent -1.")
        for joint, parent in enumerate(self.parents[1:], start=1):
            if not 0 <= parent < joint:
                raise ValueError(
                    f"Expected the parent of joint {joint} ({self.names[joint]}) to come before it; got {parent}."
                )
        if len(set(self.names)) != count:
            twice = sorted({name for name in self.names if self.names.count(name) > 1})
            raise ValueError(f"Expected unique joint names; got {', '.join(twice)} more than once.")

    @property
    def joints(self) -> int:
        """Number of joints J."""
        return len(self.names)

    @cached_property
    def levels(self) -> tuple[tuple[int, ...], ...]:
        """Joints by depth: level 0 is the root; the parents of level n are in level n - 1."""
        return tree_levels(self.parents)

    def index(self, name: str) -> int:
        """Index of the joint called ``name``; otherwise a ``KeyError`` that lists the joints."""
        try:
            return self.names.index(name)
        except ValueError:
            raise KeyError(f"no joint {name!r}; the joints are {', '.join(self.names)}") from None

    def scaled(self, factor: float) -> "Skeleton":
        """The same tree with every length times ``factor``."""
        ends = tuple((joint, (x * factor, y * factor, z * factor)) for joint, (x, y, z) in self.ends)
        return replace(self, offsets=np.asarray(self.offsets) * factor, ends=ends)

    def same_tree(self, other: "Skeleton") -> bool:
        """Whether names and parents agree (bone lengths may differ)."""
        return self.names == other.names and self.parents == other.parents


def tree_levels(parents: tuple[int, ...]) -> tuple[tuple[int, ...], ...]:
    """Group joints by their depth in the tree given by ``parents`` (root -1, parents first)."""
    depth: list[int] = []
    for parent in parents:
        depth.append(0 if parent < 0 else depth[parent] + 1)
    return tuple(
        tuple(joint for joint, d in enumerate(depth) if d == level) for level in range(max(depth, default=0) + 1)
    )


jax.tree_util.register_dataclass(Skeleton, data_fields=["offsets"], meta_fields=["names", "parents", "ends"])
