"""Write BVH files that Blender, MotionBuilder and the usual viewers open."""

import math
import os
import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.euler import continuous_euler, euler_matrices
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh_hierarchy import MAX_DEPTH, MAX_JOINTS, Layout
from a2g_jax.io.files import atomic_path

#: Length in metres of the End Site added to a leaf joint without one.
_TIP = 0.05
#: Decimals of an angle in degrees.
_ANGLE_DECIMALS = 6
#: Largest error in degrees of rotation channels that is not reported.
_CLOSE = 0.1


def write_bvh(path: str | os.PathLike[str], motion: Motion, *, order: str = "ZXY", scale: float = 100.0) -> None:
    """Write a motion as BVH: six channels for the root, three for every other joint.

    Angles have no jumps of 360 degrees between frames, so that editors interpolate them well. Numbers are fixed-point:
    lengths to 10 nanometres or better, angles to a millionth of a degree. Spaces and braces in joint names become
    underscores, and leaf joints without an end get an End Site of 5 cm along their bone.

    Joints of BVH files are in depth-first order: compare them with the original by name.

    Example:
        >>> import a2g_jax
        >>> a2g_jax.write_bvh("gesture.bvh", a2g_jax.talk(2.0, seed=1).motion)
        >>> a2g_jax.read_bvh("gesture.bvh").frames
        60

    Args:
        path: written atomically; missing folders are created.
        order: the rotation channels, a permutation of ``XYZ``.
        scale: units of the file per metre: 100 writes centimetres.

    Raises:
        ValueError: an unknown order or scale.
        InputError: the motion has no frames, NaN or infinities, or the file cannot be written.
    """
    if sorted(order) != ["X", "Y", "Z"]:
        raise ValueError(f"Expected the rotation order as a permutation of XYZ; got {order!r}.")
    if not (math.isfinite(scale) and scale > 0):
        raise ValueError(f"Expected a positive scale, in units a metre; got {scale}.")
    rotations, root = _checked(path, motion)
    skeleton = motion.skeleton
    walk = _depth_first(skeleton)
    decimals = max(6, 8 - math.floor(math.log10(scale)))
    angles = continuous_euler(rotations[:, walk], order)
    values = np.concatenate([root * scale, angles.reshape(len(angles), -1)], axis=1)
    head = "\n".join(_hierarchy(skeleton, walk, order, scale, decimals))
    _write(path, head, values, [decimals] * 3 + [_ANGLE_DECIMALS] * (values.shape[1] - 3), motion.fps)


def write_like(path: str | os.PathLike[str], motion: Motion, layout: Layout) -> dict[str, float]:
    """Write a motion in the layout of the file that its skeleton was read from: names, channels, orders and unit.

    Angles have no jumps, as in :func:`write_bvh`. Joints with fewer than three rotation channels are approximated.

    Args:
        path: written atomically; missing folders are created.
        layout: of a file with the joints of the motion, as :func:`~a2g_jax.io.bvh.read_with_layout` gives it.

    Returns:
        Largest error in degrees by joint, of the joints whose channels miss a rotation by more than 0.1 degrees.

    Raises:
        InputError: the motion has no frames, NaN or infinities, or the file cannot be written.
    """
    rotations, root = _checked(path, motion)
    offsets = np.asarray(motion.skeleton.offsets, np.float64) / layout.scale
    places = _places(motion.skeleton.parents, rotations, root / layout.scale, offsets, layout)
    columns: list[Float[np.ndarray, " T"]] = []
    errors: dict[str, float] = {}
    for index, joint in enumerate(layout.joints):
        channels = joint.channels or ()
        order = "".join(channel[0] for channel in channels if channel.endswith("rotation"))
        angles, error = _angles(rotations[:, index], order)
        if error > _CLOSE:
            errors[joint.name] = error
        for channel in channels:
            axis = "XYZ".index(channel[0])
            if channel.endswith("rotation"):
                columns.append(angles[:, order.index(channel[0])])
            else:
                own = places.get(index)
                columns.append(np.full(motion.frames, offsets[index, axis]) if own is None else own[:, axis])
    _write(path, layout.head.rstrip(), np.stack(columns, axis=1), [_ANGLE_DECIMALS] * len(columns), motion.fps)
    return errors


def _places(
    parents: tuple[int, ...],
    rotations: Float[np.ndarray, "T J 3 3"],
    root: Float[np.ndarray, "T 3"],
    offsets: Float[np.ndarray, "J 3"],
    layout: Layout,
) -> dict[int, Float[np.ndarray, "T 3"]]:
    """What goes into position channels that hold no bone: those of the root and of the joint that carries the path.

    Where the root stands still in the layout's own motion, or lacks channels, the carrier takes the rest of the path.
    """
    carrier = layout.carrier
    if carrier == 0:
        return {0: root}
    written = root if layout.still_root is None else np.tile(np.array(layout.still_root) / layout.scale, (len(root), 1))
    own = layout.joints[0]
    for axis, letter in enumerate("XYZ"):
        if f"{letter}position" not in (own.channels or ()):
            written = written.copy()
            written[:, axis] = (own.offset or (0.0, 0.0, 0.0))[axis]
    chain = [carrier]
    while parents[chain[0]] >= 0:
        chain.insert(0, parents[chain[0]])
    above = rotations[:, 0]
    for joint in chain[1:-1]:
        above = above @ rotations[:, joint]
    # The path that the root does not take, turned into the frame of the joint above the carrier.
    rest = (np.swapaxes(above, -1, -2) @ (root - written)[:, :, None])[..., 0]
    return {0: written, carrier: offsets[carrier] + rest}


def _angles(rotations: Float[np.ndarray, "T 3 3"], order: str) -> tuple[Float[np.ndarray, "T A"], float]:
    """Angles in degrees for up to three rotation channels, and by how many degrees they miss the rotations."""
    whole = order + "".join(axis for axis in "XYZ" if axis not in order)
    angles = continuous_euler(rotations[:, None], whole)[:, 0, : len(order)]
    written = euler_matrices(angles, order) if order else np.broadcast_to(np.eye(3), rotations.shape)
    return angles, float(rotation_angle(written, rotations).max(initial=0.0))


def _write(
    path: str | os.PathLike[str], head: str, values: Float[np.ndarray, "T C"], decimals: Sequence[int], fps: float
) -> None:
    """Write the text before ``MOTION`` and the frames, a number of decimals for each column."""
    places = np.array(decimals)
    for count in np.unique(places).tolist():
        # Rounding here, and adding zero, keeps "-0.000000" out of the file.
        values[:, places == count] = np.round(values[:, places == count], count) + 0.0
    row = " ".join(f"%.{count}f" for count in decimals) + "\n"
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"{head}\nMOTION\nFrames: {len(values)}\nFrame Time: {1 / fps:.10f}\n")
        file.writelines(row % tuple(frame) for frame in values.tolist())


def _checked(path: object, motion: Motion) -> tuple[Float[np.ndarray, "T J 3 3"], Float[np.ndarray, "T 3"]]:
    """Rotations and root in double precision, or ``InputError`` for a motion that cannot be written."""
    skeleton = motion.skeleton
    rotations, root = np.asarray(motion.rotations, np.float64), np.asarray(motion.root, np.float64)
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
    return rotations, root


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
    # At rest a leaf's frame is parallel to its parent's, so the bone's direction is the same in both.
    length = float(np.linalg.norm(bone))
    x, y, z = (bone / length * _TIP).tolist() if length > 1e-9 else (0.0, _TIP, 0.0)
    return x, y, z


def _file_names(names: tuple[str, ...]) -> list[str]:
    used: set[str] = set()
    result = []
    for name in names:
        plain = unique = re.sub(r"[\s{}\0]", "_", name.strip()) or "joint"
        number = 2
        while unique in used:
            unique = f"{plain}_{number}"
            number += 1
        used.add(unique)
        result.append(unique)
    return result
