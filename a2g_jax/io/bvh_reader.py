"""Read BVH files.

BVH (Biovision hierarchy) has no standard; this module reads the files of capture systems, Blender, MotionBuilder, Maya
and research data sets. The rotation channels of a joint multiply from left to right in the order of the file:
``Zrotation Xrotation Yrotation`` means ``R = Rz @ Rx @ Ry``, in degrees.
"""

import os
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError, InputWarning
from a2g_jax.geometry.anthropometry import Unit, find_unit, stature
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.parts import find_parts
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh_hierarchy import Joint, Layout
from a2g_jax.io.bvh_motion import Parsed, parse_bvh, read_values
from a2g_jax.io.bvh_poses import extent, poses_of
from a2g_jax.io.bvh_text import read_text
from a2g_jax.io.root_unit import root_unit_doubt

#: A skeleton larger than this at rest is in centimetres.
_LARGEST_BODY = 10.0
#: Metres by which joints may miss their places in the file before there is a warning.
STRETCH = 0.005


def read_bvh(path: str | os.PathLike[str], *, scale: float | None = None) -> Motion:
    """Read a BVH file: skeleton, joint rotations and root path.

    Joints may have any rotation order and 0 to 6 channels each. Position channels of the root are its position in
    the world (in place of its OFFSET); a coordinate without a channel comes from OFFSET. Position channels of
    another joint are its bone, or the path of the body where a root above it does not have it
    (:func:`~a2g_jax.io.bvh_poses.poses_of`).

    The numbers of a frame may be spread over several lines, or all frames be on one. The text may be in UTF-8, UTF-16
    or an older encoding (:func:`~a2g_jax.io.bvh_text.read_text`). The frame rate is the usual rate nearest to the
    file's rounded frame time (:func:`~a2g_jax.io.frame_rate.rate_from_frame_time`). The number of frames in the header
    must be that of the file.

    Args:
        path: the file.
        scale: metres in one unit of the file. None finds it: centimetres (0.01) for a skeleton larger than 10 units at
            rest along any axis, otherwise metres (1), where the limbs are then those of a person; else the usual unit
            in which they are (:func:`~a2g_jax.geometry.anthropometry.find_unit`).

    Returns:
        Float32 motion in metres, joints in file order.

    Raises:
        InputError: the file is not a BVH file or is damaged; the message names the line.

    Warns:
        InputWarning: an unusual unit, or bones that move.
    """
    motion, layout = read_with_layout(path, scale=scale)
    for message in doubts(layout):
        warnings.warn(InputWarning(f"{path}: {message}."), stacklevel=2)
    return motion


def read_with_layout(path: str | os.PathLike[str], *, scale: float | None = None) -> tuple[Motion, Layout]:
    """A motion and the layout of its file; arguments and errors of :func:`read_bvh`, but no warnings."""
    if scale is not None and not (np.isfinite(scale) and scale > 0):
        raise ValueError(f"Expected a positive scale, in metres a unit; got {scale}.")
    path = Path(path)
    parsed = parse_bvh(path, read_text(path))
    return build(parsed, read_values(parsed), scale)


def doubts(layout: Layout) -> list[str]:
    """What is not certain in a motion as it was read, a sentence each."""
    found = []
    if not layout.unit.plain:
        found.append(str(layout.unit))
    if layout.stretch is not None and layout.stretch.metres > STRETCH:
        found.append(str(layout.stretch))
    if layout.root_doubt:
        found.append(layout.root_doubt)
    return found


def build(parsed: Parsed, values: Float[np.ndarray, "T C"], scale: float | None = None) -> tuple[Motion, Layout]:
    """The motion of the numbers of a file, and its layout."""
    joints = parsed.joints
    poses = poses_of(joints, values)
    roles = _roles(_skeleton(joints, poses.offsets, 1.0))
    unit = Unit("as given", scale) if scale is not None else _unit(joints, poses.offsets, roles)
    scale = unit.metres
    motion = Motion(
        rotations=poses.rotations,
        root=(poses.root * scale).astype(np.float32),
        skeleton=_skeleton(joints, poses.offsets, scale),
        fps=parsed.fps,
    )
    still, stretch = poses.still_root, poses.stretch
    if still is not None:
        still = (still[0] * scale, still[1] * scale, still[2] * scale)
    if stretch is not None:
        stretch = replace(stretch, metres=stretch.metres * scale)
    doubt = root_unit_doubt(motion.skeleton, np.asarray(motion.root), roles) if roles else ""
    return motion, Layout(parsed.head, joints, scale, unit, poses.carrier, still, stretch, doubt)


def _roles(skeleton: Skeleton) -> dict[str, int]:
    """Joints of the body by part; none where no body is found."""
    try:
        return find_parts(skeleton, "the skeleton", {})[0]
    except InputError:
        return {}


def _unit(joints: list[Joint], offsets: Float[np.ndarray, "J 3"], roles: dict[str, int]) -> Unit:
    guess = 0.01 if extent(joints, offsets) > _LARGEST_BODY else 1.0
    tall = stature(_skeleton(joints, offsets, 1.0), roles) if roles else None
    return Unit("centimetres" if guess < 1 else "metres", guess) if tall is None else find_unit(tall, guess)


def _skeleton(joints: list[Joint], offsets: Float[np.ndarray, "J 3"], scale: float) -> Skeleton:
    ends = tuple(
        (index, (x * scale, y * scale, z * scale)) for index, joint in enumerate(joints) for x, y, z in joint.ends
    )
    return Skeleton(
        offsets=(offsets * scale).astype(np.float32),
        names=tuple(joint.name for joint in joints),
        parents=tuple(joint.parent for joint in joints),
        ends=ends,
    )
