"""Write BVH files that Blender, MotionBuilder and the usual viewers open."""

import math
import os
import re

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.euler import continuous_euler
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh_hierarchy import MAX_DEPTH, MAX_JOINTS
from a2g_jax.io.files import atomic_path

#: Length in metres of the End Site of a leaf joint that has none.
_TIP = 0.05


def write_bvh(path: str | os.PathLike[str], motion: Motion, *, order: str = "ZXY", scale: float = 100.0) -> None:
    """Write a motion as BVH: six channels for the root, three for every other joint.

    Angles run on without jumps of 360 degrees from frame to frame, so that editors interpolate them well. Numbers
    are fixed-point: lengths to 10 nanometres or better, angles to a millionth of a degree. Spaces and braces in joint
    names become underscores, and leaf joints without an end get an End Site of 5 cm along their bone.

    BVH nests its joints, so a reader gets them in depth-first order: compare with the original by name.

    Args:
        path: written atomically; missing folders are made.
        order: the rotation channels, a permutation of ``XYZ``.
        scale: units of the file in a metre: 100 writes centimetres.

    Raises:
        ValueError: an unknown order or scale.
        InputError: the motion has no frames or holds NaN or infinities, or the file cannot be written.
    """
    if sorted(order) != ["X", "Y", "Z"]:
        raise ValueError(f"Expected the rotation order as a permutation of XYZ; got {order!r}.")
    if not (math.isfinite(scale) and scale > 0):
        raise ValueError(f"Expected a positive scale, in units a metre; got {scale}.")
    skeleton = motion.skeleton
    rotations = np.asarray(motion.rotations, np.float64)
    root = np.asarray(motion.root, np.float64)
    _check(path, motion, rotations, root)

    walk = _depth_first(skeleton)
    places = max(6, 8 - math.floor(math.log10(scale)))
    angles = continuous_euler(rotations[:, walk], order)
    values = np.concatenate([root * scale, angles.reshape(len(angles), -1)], axis=1)
    # Rounding here, and adding zero, keeps "-0.000000" out of the file.
    values[:, :3] = np.round(values[:, :3], places) + 0.0
    values[:, 3:] = np.round(values[:, 3:], 6) + 0.0
    row = " ".join([f"%.{places}f"] * 3 + ["%.6f"] * (values.shape[1] - 3)) + "\n"
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join(_hierarchy(skeleton, walk, order, scale, places)) + "\n")
        file.write(f"MOTION\nFrames: {motion.frames}\nFrame Time: {1 / motion.fps:.10f}\n")
        file.writelines(row % tuple(frame) for frame in values.tolist())


def _check(
    path: object, motion: Motion, rotations: Float[np.ndarray, "T J 3 3"], root: Float[np.ndarray, "T 3"]
) -> None:
    skeleton = motion.skeleton
    if motion.frames == 0:
        raise InputError(f"{path}: not written: the motion has no frames.")
    if rotations.shape[1] != skeleton.joints or len(root) != len(rotations):
        raise InputError(
            f"{path}: not written: the motion has rotations of shape {rotations.shape} and a root of shape "
            f"{root.shape} for a skeleton of {skeleton.joints} joints."
        )
    if not 0.2 <= motion.fps <= 1e5:
        raise InputError(f"{path}: not written: expected a frame rate of 0.2 to 100000 fps; got {motion.fps}.")
    if skeleton.joints > MAX_JOINTS or len(skeleton.levels) > MAX_DEPTH:
        raise InputError(f"{path}: not written: more than {MAX_JOINTS} joints or {MAX_DEPTH} levels.")
    for what, array in (("rotations", rotations), ("root", root), ("offsets", np.asarray(skeleton.offsets))):
        bad = np.argwhere(~np.isfinite(array))
        if len(bad):
            place = "joint" if what == "offsets" else "frame"
            raise InputError(f"{path}: not written: NaN or infinity in the {what} of {place} {bad[0][0]}.")


def _depth_first(skeleton: Skeleton) -> list[int]:
    children = _children(skeleton)
    walk, stack = [], [0]
    while stack:
        joint = stack.pop()
        walk.append(joint)
        stack.extend(reversed(children[joint]))
    return walk


def _children(skeleton: Skeleton) -> list[list[int]]:
    children: list[list[int]] = [[] for _ in skeleton.names]
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        children[parent].append(joint)
    return children


def _hierarchy(skeleton: Skeleton, walk: list[int], order: str, scale: float, places: int) -> list[str]:
    names = _file_names(skeleton.names)
    offsets = np.asarray(skeleton.offsets, np.float64)
    children = _children(skeleton)
    rotations = " ".join(f"{axis}rotation" for axis in order)
    depth: list[int] = []
    for parent in skeleton.parents:
        depth.append(0 if parent < 0 else depth[parent] + 1)

    def offset_line(offset) -> str:
        numbers = np.round(np.asarray(offset, np.float64) * scale, places) + 0.0
        return "OFFSET " + " ".join(f"{number:.{places}f}" for number in numbers)

    lines, level = ["HIERARCHY"], -1
    for joint in walk:
        for closing in range(level, depth[joint] - 1, -1):
            lines.append("\t" * closing + "}")
        level = depth[joint]
        indent = "\t" * level
        lines += [indent + ("JOINT " if level else "ROOT ") + names[joint], indent + "{"]
        lines.append(f"{indent}\t{offset_line(offsets[joint])}")
        positions = "" if level else "Xposition Yposition Zposition "
        lines.append(f"{indent}\tCHANNELS {3 if level else 6} {positions}{rotations}")
        ends = [end for owner, end in skeleton.ends if owner == joint]
        if not ends and not children[joint]:
            ends = [_tip(offsets[joint] if level else np.zeros(3))]
        for end in ends:
            lines += [f"{indent}\tEnd Site", f"{indent}\t{{", f"{indent}\t\t{offset_line(end)}", f"{indent}\t}}"]
    lines += ["\t" * closing + "}" for closing in range(level, -1, -1)]
    return lines


def _tip(bone: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
    # A leaf's own frame is parallel to its parent's at rest, so the bone's direction holds in it.
    length = float(np.linalg.norm(bone))
    x, y, z = (bone / length * _TIP).tolist() if length > 1e-9 else (0.0, _TIP, 0.0)
    return x, y, z


def _file_names(names: tuple[str, ...]) -> list[str]:
    taken: set[str] = set()
    result = []
    for name in names:
        plain = unique = re.sub(r"[\s{}\0]", "_", name.strip()) or "joint"
        number = 2
        while unique in taken:
            unique = f"{plain}_{number}"
            number += 1
        taken.add(unique)
        result.append(unique)
    return result
