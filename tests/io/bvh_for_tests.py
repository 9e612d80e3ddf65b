"""BVH text of a motion in forms that our own writer never makes."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from a2g_jax.geometry.euler import continuous_euler
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.bvh import read_bvh, write_bvh


def depth_first(motion: Motion) -> Motion:
    """The motion with its joints in the order of files."""
    with tempfile.TemporaryDirectory() as folder:
        write_bvh(Path(folder) / "a.bvh", motion)
        return read_bvh(Path(folder) / "a.bvh")


def bvh_text(
    motion: Motion,
    *,
    scale: float = 100.0,
    positions: Mapping[str, np.ndarray] | None = None,
    above: str = "",
    names: Mapping[str, str] | None = None,
) -> str:
    """The motion as BVH with ZXY rotations.

    Args:
        scale: units a metre.
        positions: values of position channels of joints below the root, metres, one row a frame or one for all.
        above: name of a joint at the origin above the root; the root then has the path in its own position channels.
        names: new names of joints.
    """
    skeleton, positions, names = motion.skeleton, dict(positions or {}), dict(names or {})
    children: dict[int, list[int]] = {}
    for joint, parent in enumerate(skeleton.parents):
        children.setdefault(parent, []).append(joint)
    lines, columns = ["HIERARCHY"], []
    angles = continuous_euler(np.asarray(motion.rotations, np.float64), "ZXY")
    frames = motion.frames
    offsets = np.asarray(motion.skeleton.offsets, np.float64) * scale

    def block(joint: int, keyword: str) -> None:
        name = skeleton.names[joint]
        offset = " ".join(f"{x:.6f}" for x in offsets[joint])
        has = joint == 0 or name in positions
        lines.extend([f"{keyword} {names.get(name, name)}", "{", f"OFFSET {offset}"])
        lines.append(
            f"CHANNELS {6 if has else 3} {'Xposition Yposition Zposition ' if has else ''}Zrotation Xrotation Yrotation"
        )
        if has:
            value = motion.root if joint == 0 else positions[name]
            columns.append(np.broadcast_to(np.asarray(value, np.float64) * scale, (frames, 3)))
        columns.append(angles[:, joint])
        for child in children.get(joint, []):
            block(child, "JOINT")
        if joint not in children:
            lines.extend(["End Site", "{", f"OFFSET 0 {0.05 * scale:.6f} 0", "}"])
        lines.append("}")

    if above:
        columns.append(np.zeros((frames, 6)))
        lines += [f"ROOT {above}", "{", "OFFSET 0 0 0"]
        lines.append("CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation")
    block(0, "JOINT" if above else "ROOT")
    if above:
        lines.append("}")
    rows = [" ".join(f"{x:.6f}" for x in row) for row in np.concatenate(columns, axis=1)]
    return "\n".join([*lines, "MOTION", f"Frames: {frames}", f"Frame Time: {1 / motion.fps:.8f}", *rows]) + "\n"
