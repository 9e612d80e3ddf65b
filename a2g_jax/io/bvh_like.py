"""Writing a motion as BVH laid out as another file is: its names, channels, rotation orders and unit."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.euler import continuous_euler, euler_matrices
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.bvh_hierarchy import Joint, parse_hierarchy
from a2g_jax.io.files import atomic_path

_MOTION = re.compile(r"^[ \t]*MOTION[ \t]*$", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True, eq=False)
class Layout:
    """How a BVH file is laid out."""

    head: str
    """Its text up to the motion."""
    joints: list[Joint]
    scale: float
    """Metres in its unit, as the reader takes it."""


def read_with_layout(path: Path) -> tuple[Motion, Layout]:
    """A motion, and how its file is laid out.

    Raises:
        InputError: what :func:`~a2g_jax.io.bvh.read_bvh` raises.
    """
    motion = read_bvh(path)
    text = path.read_bytes().decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")
    start = _MOTION.search(text)
    head = text[: start.start() if start else len(text)]
    # The reader guesses the unit: what it made of the lengths says which it took.
    whole = np.linalg.norm(np.asarray(read_bvh(path, scale=1.0).skeleton.offsets, np.float64), axis=1).sum()
    metres = np.linalg.norm(np.asarray(motion.skeleton.offsets, np.float64), axis=1).sum()
    scale = 0.01 if whole > 0 and metres / whole < 0.1 else 1.0
    return motion, Layout(head, parse_hierarchy(path, head), scale)


def write_like(path: Path, motion: Motion, layout: Layout) -> dict[str, float]:
    """Write a motion whose skeleton came from a file of that layout, atomically.

    Angles run on without jumps. A joint with fewer than three rotation channels takes what these can show.

    Returns:
        By joint, the degrees by which the channels there are miss a rotation, where they do by more than a tenth.

    Raises:
        InputError: the motion holds NaN, or the file cannot be written.
    """
    if not (np.isfinite(motion.rotations).all() and np.isfinite(motion.root).all()):
        raise InputError(f"{path}: not written: NaN or infinity in the motion.")
    columns: list[Float[np.ndarray, " T"]] = []
    missed: dict[str, float] = {}
    offsets = np.asarray(motion.skeleton.offsets, np.float64) / layout.scale
    root = np.asarray(motion.root, np.float64) / layout.scale
    for index, joint in enumerate(layout.joints):
        channels = joint.channels or ()
        order = "".join(channel[0] for channel in channels if channel.endswith("rotation"))
        angles, off = _angles(np.asarray(motion.rotations[:, index], np.float64), order)
        if off > 0.1:
            missed[joint.name] = off
        for channel in channels:
            axis = "XYZ".index(channel[0])
            if channel.endswith("rotation"):
                columns.append(angles[:, order.index(channel[0])])
            else:
                columns.append(root[:, axis] if index == 0 else np.full(motion.frames, offsets[index, axis]))
    values = np.round(np.stack(columns, axis=1), 6) + 0.0
    row = " ".join(["%.6f"] * values.shape[1]) + "\n"
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(layout.head.rstrip() + "\n")
        file.write(f"MOTION\nFrames: {motion.frames}\nFrame Time: {1 / motion.fps:.10f}\n")
        file.writelines(row % tuple(frame) for frame in values.tolist())
    return missed


def _angles(rotations: Float[np.ndarray, "T 3 3"], order: str) -> tuple[Float[np.ndarray, "T A"], float]:
    """Degrees for the rotation channels there are, and how far they miss."""
    whole = order + "".join(axis for axis in "XYZ" if axis not in order)
    angles = continuous_euler(rotations[:, None], whole)[:, 0, : len(order)]
    shown = euler_matrices(angles, order) if order else np.broadcast_to(np.eye(3), rotations.shape)
    return angles, float(rotation_angle(shown, rotations).max(initial=0.0))
