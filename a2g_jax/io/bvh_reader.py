"""Read BVH files.

BVH (Biovision hierarchy) has no standard; this module reads the files of capture systems, Blender, MotionBuilder, Maya
and research data sets. The rotation channels of a joint multiply from left to right in the order of the file:
``Zrotation Xrotation Yrotation`` means ``R = Rz @ Rx @ Ry``, in degrees.
"""

import os
import re
from typing import NoReturn

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.euler import euler_matrices
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh_hierarchy import MAX_VALUE, Joint, Layout, fail, parse_hierarchy, parse_number, shown
from a2g_jax.io.files import check_readable
from a2g_jax.io.frame_rate import rate_from_frame_time

#: A skeleton larger than this at rest is in centimetres.
_LARGEST_BODY = 10.0

# Possessive quantifiers: linear time on long lines of spaces.
_FRAMES = re.compile(r"Frames?\s*+:?\s*+(\S++)$", re.IGNORECASE)
_FRAME_TIME = re.compile(r"Frame\s*+Time\s*+:?\s*+(\S++)$", re.IGNORECASE)


def read_bvh(path: str | os.PathLike[str], *, scale: float | None = None) -> Motion:
    """Read a BVH file: skeleton, joint rotations and root path.

    Joints may have any rotation order and 0 to 6 channels each. Position channels of the root are its position in
    the world (in place of its OFFSET); a coordinate without a channel comes from OFFSET. Position channels of
    another joint are its bone: a motion has fixed bone lengths, so their mean over time is used as its offset.

    The frame rate is the usual rate nearest to the file's rounded frame time
    (:func:`~a2g_jax.io.frame_rate.rate_from_frame_time`). The number of frames in the header must be that of the lines.

    Args:
        path: the file.
        scale: metres in one unit of the file. None guesses: centimetres (0.01) for a skeleton larger than 10 units at
            rest along any axis, otherwise metres (1).

    Returns:
        Float32 motion in metres, joints in file order.

    Raises:
        InputError: the file is not a BVH file or is damaged; the message names the line.
    """
    return read_with_layout(path, scale=scale)[0]


def read_with_layout(path: str | os.PathLike[str], *, scale: float | None = None) -> tuple[Motion, Layout]:
    """A motion and the layout of its file; arguments and errors of :func:`read_bvh`."""
    if scale is not None and not (np.isfinite(scale) and scale > 0):
        raise ValueError(f"Expected a positive scale, in metres a unit; got {scale}.")
    path = check_readable(path, "a BVH file")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the disk.") from None
    if b"\0" in data[:65536]:
        raise InputError(f"{path}: is binary, not text; expected a BVH file (and not one in UTF-16).")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # letters occur in names only, and any name is valid
    text = text.replace("\r\n", "\n").replace("\r", "\n")

    start = re.search(r"^[ \t]*MOTION[ \t]*$", text, re.IGNORECASE | re.MULTILINE)
    head = text[: start.start()] if start else text[:4_000_000]
    joints = parse_hierarchy(path, head)
    if start is None:
        fail(path, text.count("\n") + 1, "the file ends without a MOTION section; is it cut short?")
    line = text.count("\n", 0, start.start()) + 1
    frames, frame_time, lines, first = _motion_header(path, text[start.end() :].split("\n"), line)
    channels = sum(len(joint.channels or ()) for joint in joints)
    if channels == 0:
        fail(path, joints[0].line, "no joint has a channel, so nothing moves; add CHANNELS.")
    values = _motion_values(path, lines, first, frames, channels)
    offsets, rotations, root = _poses(joints, values)
    if scale is None:
        scale = 0.01 if _extent(joints, offsets) > _LARGEST_BODY else 1.0
    skeleton = _skeleton(joints, offsets, scale)
    fps = rate_from_frame_time(frame_time)
    motion = Motion(rotations=rotations, root=(root * scale).astype(np.float32), skeleton=skeleton, fps=fps)
    return motion, Layout(head, joints, scale)


def _motion_header(path: object, lines: list[str], line: int) -> tuple[int, str, list[str], int]:
    # lines[0] is the rest of the line of MOTION, which is number ``line``.
    at = _next_filled(lines, 0)
    found = _FRAMES.match(lines[at].strip())
    if not found:
        fail(path, line + at, f"expected 'Frames: <count>' after MOTION; got {_at(lines, at)}.")
    if not re.fullmatch(r"[0-9]{1,15}", found[1]) or int(found[1]) == 0:
        fail(path, line + at, f"expected a positive number of frames; got {shown(found[1])}.")
    frames = int(found[1])
    at = _next_filled(lines, at + 1)
    found = _FRAME_TIME.match(lines[at].strip())
    if not found:
        fail(path, line + at, f"expected 'Frame Time: <seconds>' after Frames; got {_at(lines, at)}.")
    seconds = parse_number(found[1])
    if seconds is None or not 1e-5 <= seconds <= 5:
        fail(
            path,
            line + at,
            f"expected a frame time in seconds, such as 0.033333; got {shown(found[1])}.",
        )
    return frames, found[1], lines[at + 1 :], line + at + 1


def _next_filled(lines: list[str], at: int) -> int:
    # The index of the next line with content, or of the last line.
    while at < len(lines) - 1 and not lines[at].strip():
        at += 1
    return min(at, len(lines) - 1)


def _at(lines: list[str], at: int) -> str:
    return shown(lines[at].strip()) if lines[at].strip() else "the end of the file"


def _motion_values(path: object, lines: list[str], first: int, frames: int, channels: int) -> Float[np.ndarray, "T C"]:
    # The whole block at once; line by line only to locate an error.
    if not any(line.strip() for line in lines):
        fail(path, first, f"expected {frames} frames after the frame time; got the end of the file.")
    try:
        values = np.loadtxt(lines, dtype=np.float64, comments=None, ndmin=2)
    except ValueError:
        _find_fault(path, lines, first, channels)
    if values.shape[1] != channels:
        _find_fault(path, lines, first, channels)
    if not np.all(np.abs(values) <= MAX_VALUE):  # also false for NaN
        _find_fault(path, lines, first, channels)
    if len(values) != frames:
        filled = [at for at, line in enumerate(lines) if line.strip()]
        what = "is the file cut short?" if len(values) < frames else "correct the header or remove the rest."
        fail(path, first + filled[-1], f"the header says {frames} frames and the file has {len(values)}; {what}")
    return values


def _find_fault(path: object, lines: list[str], first: int, channels: int) -> NoReturn:
    for at, line in enumerate(lines):
        tokens = line.split()
        for column, token in enumerate(tokens, start=1):
            value = parse_number(token)
            if value is None:
                hint = " (write a decimal point, not a comma)" if "," in token else ""
                fail(path, first + at, f"expected a number as value {column}; got {shown(token)}{hint}.")
            if abs(value) > MAX_VALUE:
                fail(path, first + at, f"value {column} is out of range; got {shown(token)}.")
        if tokens and len(tokens) != channels:
            short = "is the file cut short? Restore it, or remove the line and correct the header"
            hint = short if len(tokens) < channels else "correct the joints' channels or remove the rest"
            fail(path, first + at, f"expected {channels} values, one a channel; got {len(tokens)}; {hint}.")
    raise InputError(f"{path}: the frames cannot be read as numbers; is the file damaged?")


def _poses(
    joints: list[Joint], values: Float[np.ndarray, "T C"]
) -> tuple[Float[np.ndarray, "J 3"], Float[np.ndarray, "T J 3 3"], Float[np.ndarray, "T 3"]]:
    """Offsets, rotations and root path, in the unit of the file."""
    offsets = np.array([joint.offset for joint in joints], np.float64)
    root = np.tile(offsets[0], (len(values), 1))
    angles: dict[str, list[tuple[int, list[int]]]] = {}
    column = 0
    for index, joint in enumerate(joints):
        order, columns = "", []
        for channel in joint.channels or ():
            axis = "XYZ".index(channel[0])
            if channel.endswith("rotation"):
                order += channel[0]
                columns.append(column)
            elif index == 0:
                root[:, axis] = values[:, column]
            else:
                offsets[index, axis] = values[:, column].mean()
            column += 1
        if order:
            angles.setdefault(order, []).append((index, columns))

    rotations = np.broadcast_to(np.eye(3, dtype=np.float32), (len(values), len(joints), 3, 3)).copy()
    for order, members in angles.items():
        indices = [index for index, _ in members]
        rotations[:, indices] = euler_matrices(values[:, [columns for _, columns in members]], order)
    return offsets, rotations, root


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


def _extent(joints: list[Joint], offsets: Float[np.ndarray, "J 3"]) -> float:
    # The longest side of the box around the joints and End Sites at rest.
    places = np.zeros((len(joints), 3))
    for index, joint in enumerate(joints[1:], start=1):
        places[index] = places[joint.parent] + offsets[index]
    tips = [places[index] + end for index, joint in enumerate(joints) for end in joint.ends]
    points = np.concatenate([places, np.reshape(tips, (-1, 3))])
    return float(np.max(points.max(axis=0) - points.min(axis=0)))
