"""A BVH file as written: header, channels, and as much of the motion as is readable."""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.inspection.finding import Finding, Place
from a2g_jax.inspection.motion_checks import FLIP_DEGREES, rotation_steps
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.bvh_hierarchy import Joint, parse_hierarchy
from a2g_jax.io.files import check_readable

#: Degrees between two frames from which the jump of a channel is a full turn.
WRAP = 180.0
_HEADER = re.compile(r"\A(\s*Frames?\s*+:?\s*+)([0-9]{1,15})(\s*?\n\s*Frame\s*+Time\s*+:?\s*+)(\S{1,40})[^\n]*\n", re.I)
_MOTION = re.compile(r"^[ \t]*MOTION[ \t]*$", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True, eq=False)
class BvhFile:
    """The contents of a BVH file, consistent or not."""

    joints: list[Joint]
    claimed: int
    """Number of frames by the header."""
    frame_time: str
    rows: list[str]
    """Lines of the motion that are not empty."""
    head: str
    """The text up to the number of frames."""
    middle: str
    """The text between it and the motion."""

    @property
    def channels(self) -> tuple[str, ...]:
        """All channels in the order of the columns, such as ``"Hips Zrotation"``."""
        return tuple(f"{joint.name} {channel}" for joint in self.joints for channel in joint.channels or ())

    @property
    def orders(self) -> tuple[str, ...]:
        """Rotation orders of the joints, the most frequent first."""
        found = ["".join(channel[0] for channel in joint.channels or () if channel.endswith("rotation"))
                 for joint in self.joints]  # fmt: skip
        kinds = [order for order in dict.fromkeys(found) if order]
        return tuple(sorted(kinds, key=lambda order: -found.count(order)))

    @property
    def root_order(self) -> tuple[str, ...]:
        """Channels of the root."""
        return tuple(self.joints[0].channels or ())


def scan_bvh(path: Path) -> BvhFile:
    """Parse a BVH file without checking its motion.

    Raises:
        InputError: no skeleton, or no motion with the usual header.
    """
    path = check_readable(path, "a BVH file")
    text = path.read_bytes().decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")
    start = _MOTION.search(text)
    joints = parse_hierarchy(path, text[: start.start()] if start else text[:4_000_000])
    header = _HEADER.match(text[start.end() :]) if start else None
    if start is None or header is None:
        read_bvh(path)  # raises with the fault and its line
        raise InputError(f"{path}: expected 'Frames:' and 'Frame Time:' after MOTION.")
    body = text[start.end() + header.end() :]
    return BvhFile(
        joints,
        int(header[2]),
        header[4],
        [line for line in body.split("\n") if line.strip()],
        text[: start.end()] + header[1],
        header[3] + header[4] + "\n",
    )


def check_frame_count(file: BvhFile) -> list[Finding]:
    """Number of frames by the header compared with the lines of motion."""
    count = len(file.rows)
    if count == file.claimed:
        return []
    message = f"the header says {file.claimed} frames and there are {count} lines of motion."
    fix = f"Write 'Frames: {count}', or copy the file again if it was cut short."
    return [Finding("warning", "frame-count", message, fix, Place(frame=min(count, file.claimed)), float(count))]


def check_rows(file: BvhFile) -> tuple[list[Finding], Float[np.ndarray, "T C"]]:
    """Findings on lines with wrong numbers, and the values of the lines before the first such one."""
    count = len(file.channels)
    findings: list[Finding] = []
    stop = len(file.rows)
    lengths = np.array([len(row.split()) for row in file.rows])
    if (wrong := np.flatnonzero(lengths != count)).size:
        stop = int(wrong[0])
        message = (
            f"{len(wrong)} lines of motion do not have {count} numbers, one per channel; this one has {lengths[stop]}."
        )
        findings.append(Finding("warning", "columns", message, "Export the file again.", Place(frame=stop)))
    try:
        values = np.array([row.split() for row in file.rows[:stop]], np.float64).reshape(stop, count)
    except ValueError:
        message = "some values of the motion are not numbers."
        findings.append(Finding("warning", "numbers", message, "Export the file again."))
        return findings, np.zeros((0, count))
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        first = int(np.argmin(finite))
        message = f"{int((~finite).sum())} frames hold NaN or infinite values."
        findings.append(Finding("warning", "nan", message, "Cut them out or fill them.", Place(frame=first)))
        values = values[:first]
    return findings, values


def check_wraps(file: BvhFile, values: Float[np.ndarray, "T C"], motion: Motion) -> list[Finding]:
    """Euler angles that jump by a full turn: the same rotation, but harmful to filters and networks on angles."""
    rotations = [at for at, name in enumerate(file.channels) if name.endswith("rotation")]
    owners = np.repeat(np.arange(len(file.joints)), [len(joint.channels or ()) for joint in file.joints])
    # Where the rotation jumps too, it is a flip, which check_flips reports.
    flipped = rotation_steps(motion)[:, owners[rotations]] > FLIP_DEGREES
    jumps = np.sum((np.abs(np.diff(values[:, rotations], axis=0)) > WRAP) & ~flipped, axis=0)
    if not jumps.any():
        return []
    worst = int(np.argmax(jumps))
    message = (
        f"Euler angles jump by about 360 degrees {int(jumps.sum())} times in {int((jumps > 0).sum())} channels, "
        f"most in {file.channels[rotations[worst]]}; rotations read from them do not."
    )
    return [Finding("info", "euler-wrap", message, value=float(jumps.sum()))]


def read_first_frames(path: Path, file: BvhFile, frames: int) -> Motion | None:
    """The motion of the first ``frames`` lines; None without any.

    Raises:
        InputError: see :func:`~a2g_jax.io.bvh.read_bvh`; the message names the file itself.
    """
    if frames == 0:
        return None
    if frames == len(file.rows) == file.claimed:
        return read_bvh(path)
    with _repaired(file, frames) as temporary:
        try:
            return read_bvh(temporary)
        except InputError as error:
            raise InputError(str(error).replace(str(temporary), str(path))) from None


@contextmanager
def _repaired(file: BvhFile, frames: int) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "repaired.bvh"
        rows = "\n".join(file.rows[:frames])
        path.write_text(f"{file.head}{frames}{file.middle}{rows}\n", encoding="utf-8")
        yield path
