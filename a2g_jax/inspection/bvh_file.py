"""A BVH file as written: header, channels, and as much of the motion as is readable."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.inspection.finding import Finding, Place
from a2g_jax.inspection.motion_checks import FLIP_DEGREES, rotation_steps
from a2g_jax.io.bvh_hierarchy import Joint, Layout
from a2g_jax.io.bvh_motion import Parsed, count_remedy, parse_bvh, values_of
from a2g_jax.io.bvh_reader import STRETCH
from a2g_jax.io.bvh_text import read_text

#: Degrees between two frames from which the jump of a channel is a full turn.
WRAP = 180.0


@dataclass(frozen=True, eq=False)
class BvhFile:
    """The contents of a BVH file, consistent or not."""

    parsed: Parsed
    values: Float[np.ndarray, "T C"]
    """Numbers of the frames before the first fault."""
    frames: int
    """Number of frames in the file, readable or not."""
    findings: list[Finding]
    """On the number of frames, and on lines and numbers that cannot be read."""

    @property
    def joints(self) -> list[Joint]:
        """The joints in file order."""
        return self.parsed.joints

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
    """Read a BVH file as far as it can be read.

    Raises:
        InputError: no skeleton, or no motion with the usual header.
    """
    parsed = parse_bvh(path, read_text(path))
    findings: list[Finding] = []
    try:
        values = values_of(parsed)
        count = len(values)
    except InputError as error:
        if not any(line.strip() for line in parsed.lines):
            raise
        findings, values, count = _readable(parsed, error)
    return BvhFile(parsed, values, count, _check_count(parsed, count) + findings)


def _check_count(parsed: Parsed, count: int) -> list[Finding]:
    """Number of frames by the header compared with that in the file."""
    if count == parsed.frames:
        return []
    message = f"the header says {parsed.frames} frames and there are {count} in the file."
    remedy = count_remedy(parsed.frames, count, parsed.fps)
    place = Place(frame=min(count, parsed.frames))
    return [Finding("warning", "frame-count", message, remedy[:1].upper() + remedy[1:], place, float(count))]


def _readable(parsed: Parsed, error: InputError) -> tuple[list[Finding], Float[np.ndarray, "T C"], int]:
    """Findings on lines with wrong numbers, the values of the lines before the first such one, the number of lines."""
    rows = [row for line in parsed.lines if (row := line.split())]
    count = parsed.channels
    findings: list[Finding] = []
    stop = len(rows)
    lengths = np.array([len(row) for row in rows])
    if (wrong := np.flatnonzero(lengths != count)).size:
        stop = int(wrong[0])
        message = (
            f"{len(wrong)} lines of motion do not have {count} numbers, one per channel; this one has {lengths[stop]}."
        )
        if np.median(lengths) != count:
            message = str(error).removeprefix(f"{parsed.path}, ")
        findings.append(Finding("warning", "columns", message, "Export the file again.", Place(frame=stop)))
    try:
        values = np.array(rows[:stop], np.float64).reshape(stop, count)
    except ValueError:
        message = f"some values of the motion are not numbers: {str(error).removeprefix(f'{parsed.path}, ')}"
        findings.append(Finding("warning", "numbers", message, "Export the file again."))
        return findings, np.zeros((0, count)), len(rows)
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        first = int(np.argmin(finite))
        message = f"{int((~finite).sum())} frames hold NaN or infinite values."
        findings.append(Finding("warning", "nan", message, "Cut them out or fill them.", Place(frame=first)))
        values = values[:first]
    return findings, values, len(rows)


def check_layout(layout: Layout) -> list[Finding]:
    """Findings on the unit, on bones that move, and on a path that another joint than the root has."""
    findings = []
    unit = layout.unit
    if not unit.plain:
        fix = "" if unit.usual else "If you know it, name it when reading (scale of read_bvh)."
        findings.append(Finding("info" if unit.usual else "warning", "unit", f"{unit}.", fix, value=unit.metres))
    if layout.root_doubt:
        fix = "Multiply the root's positions, or export the file again."
        findings.append(Finding("warning", "root-unit", f"{layout.root_doubt}.", fix))
    if layout.carrier:
        name = layout.joints[layout.carrier].name
        message = f"the path of the body is in the position channels of {name}; it is read as that of the root above."
        findings.append(Finding("info", "path", message, place=Place(joint=name)))
    if layout.stretch is not None and layout.stretch.metres > STRETCH:
        place = Place(joint=layout.stretch.joint, frame=layout.stretch.frame)
        fix = "Export it with rotations only below the hips, if exact places matter."
        findings.append(
            Finding("warning", "moving-bones", f"{layout.stretch}.", fix, place, 100 * layout.stretch.metres)
        )
    return findings


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
