"""The MOTION section of a BVH file: its header, and its numbers in rows of any length."""

import math
import re
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.io.bvh_hierarchy import MAX_VALUE, Joint, comma_hint, fail, parse_hierarchy, parse_number, shown
from a2g_jax.io.frame_rate import rate_from_frame_time, usual_rate

# Possessive quantifiers: linear time on long lines of spaces.
_MOTION = re.compile(r"^[ \t]*(MOTION)[ \t]*$", re.IGNORECASE | re.MULTILINE)
#: The same where line breaks were lost.
_INLINE = re.compile(r"(?:^|[}\s])(MOTION)(?=\s+Frames?\s*+:?\s*+[0-9])", re.IGNORECASE)
_FRAMES = re.compile(r"Frames?\s*+:?\s*+(?!Time)(\S++)", re.IGNORECASE)
_FRAME_TIME = re.compile(r"Frame\s*+Time\s*+:?\s*+(\S++)", re.IGNORECASE)
_SPACE: re.Pattern[str] = re.compile(r"\s*+")
#: Decimated files keep the old header: least number of frames, and largest share by which the ratio may be off.
_FEWEST, _NEAR = 10, 0.005


@dataclass(frozen=True, eq=False)
class Parsed:
    """A BVH file with its numbers still as text."""

    path: object
    head: str
    """The text before ``MOTION``."""
    joints: list[Joint]
    frames: int
    """Number of frames by the header."""
    frame_time: str
    lines: list[str]
    """Lines of the motion; numbers of a frame may be spread over several."""
    first: int
    """Number of the first of them in the file."""

    @property
    def channels(self) -> int:
        """Number of values in a frame."""
        return sum(len(joint.channels or ()) for joint in self.joints)

    @property
    def fps(self) -> float:
        """Frames per second by the header."""
        return rate_from_frame_time(self.frame_time)


def parse_bvh(path: object, text: str) -> Parsed:
    """The skeleton and the header of the motion.

    Raises:
        InputError: the file is not a BVH file or is damaged there; the message names the line.
    """
    start = _MOTION.search(text) or _INLINE.search(text)
    joints = parse_hierarchy(path, text[: start.start(1)] if start else text[:4_000_000])
    if start is None:
        fail(path, text.count("\n") + 1, "the file ends without a MOTION section; is it cut short?")
    line = text.count("\n", 0, start.start(1)) + 1
    at, line = _skip(text, start.end(1), line)
    found = _FRAMES.match(text, at)
    if not found:
        fail(path, line, f"expected 'Frames: <count>' after MOTION; got {_line_at(text, at)}.")
    if not re.fullmatch(r"[0-9]{1,15}", found[1]) or int(found[1]) == 0:
        hint = " (a decimal or thousands comma: write a whole number)" if "," in found[1] else ""
        fail(path, line, f"expected a positive number of frames; got {shown(found[1])}{hint}.")
    frames = int(found[1])
    after, line = _skip(text, found.end(), line)
    found = _FRAME_TIME.match(text, after)
    if not found:
        fail(path, line, f"expected 'Frame Time: <seconds>' after Frames; got {_line_at(text, after)}.")
    seconds = parse_number(found[1])
    if seconds is None or not 1e-5 <= seconds <= 5:
        hint = comma_hint(found[1]) or _time_hint(seconds)
        fail(path, line, f"expected a frame time in seconds, such as 0.033333; got {shown(found[1])}{hint}.")
    parsed = Parsed(path, text[: start.start(1)], joints, frames, found[1], text[found.end() :].split("\n"), line)
    if parsed.channels == 0:
        fail(path, joints[0].line, "no joint has a channel, so nothing moves; add CHANNELS.")
    return parsed


def _time_hint(seconds: float | None) -> str:
    """What a number that cannot be a frame time may be instead."""
    if seconds is None or not 5 < seconds <= 1000:
        return ""
    if any(abs(seconds - usual) < 0.02 for usual in (24, 25, 29.97, 30, 48, 50, 59.94, 60, 90, 100, 120, 240)):
        return f" (are these frames per second? Write {1 / seconds:.6f})"
    return f" (are these milliseconds? Write {seconds / 1000:.6f})"


def _skip(text: str, at: int, line: int) -> tuple[int, int]:
    """The place of the next character that is no space, and its line; the end of the text if there is none."""
    spaces = _SPACE.match(text, at)
    stop = spaces.end() if spaces else at
    return stop, line + text.count("\n", at, stop)


def _line_at(text: str, at: int) -> str:
    end = text.find("\n", at)
    rest = text[at : end if end >= 0 else len(text)].strip()
    return shown(rest) if rest else "the end of the file"


def read_values(parsed: Parsed) -> Float[np.ndarray, "T C"]:
    """The numbers of all frames.

    Raises:
        InputError: text among the numbers, or more or fewer of them than the header says; the message names the line.
    """
    values = values_of(parsed)
    if len(values) != parsed.frames:
        filled = [at for at, line in enumerate(parsed.lines) if line.strip()]
        remedy = count_remedy(parsed.frames, len(values), parsed.fps)
        message = f"the header says {parsed.frames} frames and the file has {len(values)}; {remedy}"
        fail(parsed.path, parsed.first + filled[-1], message)
    return values


def values_of(parsed: Parsed) -> Float[np.ndarray, "T C"]:
    """The numbers of all whole frames in the file, whatever their number by the header.

    Raises:
        InputError: text among the numbers, or not whole frames; the message names the line.
    """
    lines, channels = parsed.lines, parsed.channels
    if not any(line.strip() for line in lines):
        message = f"expected {parsed.frames} frames after the frame time; got the end of the file."
        fail(parsed.path, parsed.first + len(lines) - 1, message)
    # The whole block at once; line by line only to locate an error.
    try:
        values = np.loadtxt(lines, dtype=np.float64, comments=None, ndmin=2)
    except ValueError:
        values = np.zeros((0, 0))
    if values.shape[1] != channels:
        values = _of_any_rows(parsed)
    if not np.all(np.abs(values) <= MAX_VALUE):  # also false for NaN
        find_fault(parsed)
    return values


def count_remedy(claimed: int, there: int, fps: float) -> str:
    """What to do about a number of frames that is not that of the header.

    A file with every n-th frame often keeps its old header. Then the frame time is wrong as well as the number.
    """
    cut = "is the file cut short? Restore it, or write" if there < claimed else "correct the header or remove the rest:"
    plain = f"{cut} 'Frames: {there}'."
    rate = fps * there / claimed
    few, many = sorted((claimed, there))
    whole = round(many / few)
    near = whole >= 2 and abs(many - whole * few) <= max(whole, _NEAR * many)
    usual = usual_rate(rate, _NEAR)
    if few < _FEWEST or not (near or usual is not None):
        return plain
    exact = (fps / whole if there < claimed else fps * whole) if near else float(usual or rate)
    what = "every second frame" if whole == 2 else f"one of {whole} frames"
    kept = f" keeps {what}" if near and there < claimed else ""
    return (
        f"if it{kept or ' has another frame rate'} and lasts {claimed / fps:.1f} s as its header says, write"
        f" 'Frames: {there}' and 'Frame Time: {1 / exact:.6f}' ({exact:.4g} fps); if it is only "
        f"{'cut short, restore it' if there < claimed else 'too long, remove the rest'}."
    )


def _of_any_rows(parsed: Parsed) -> Float[np.ndarray, "T C"]:
    """Frames read by counting numbers, where each frame starts a line or the lines are those of a fixed width."""
    lines, channels = parsed.lines, parsed.channels
    rows = [line.split() for line in lines]
    counts = np.array([len(row) for row in rows if row])
    tokens = [token for row in rows for token in row]
    whole, rest = divmod(len(tokens), channels)
    ends = np.cumsum(counts)
    frames_start_lines = set(range(channels, len(tokens), channels)) <= set(ends.tolist())
    fixed_width = bool(np.all(counts[:-1] == counts[0])) and counts[-1] <= counts[0]
    whole_rows = not rest and (frames_start_lines or fixed_width)
    exact = whole_rows and whole == parsed.frames
    if not exact and (len(counts) == parsed.frames or np.median(counts) == channels):
        # A number for a channel is missing or one is too many: a frame a line was meant.
        _check_counter(parsed, rows)
        find_fault(parsed)
    if not whole_rows:
        for number, row in enumerate(rows):
            _check_numbers(parsed, number, row)
        promised, last = parsed.frames * channels, max(at for at, row in enumerate(rows) if row)
        missing = promised - len(tokens)
        what = f"{abs(missing)} are {'missing' if missing > 0 else 'too many'}" if missing else "frames are not whole"
        fail(
            parsed.path,
            parsed.first + last,
            f"the header promises {parsed.frames} frames of {channels} values, {promised} numbers, and the file has "
            f"{len(tokens)} in {len(counts)} lines: {what} ({whole} whole frames and {rest} numbers); is it cut short "
            "or were lines lost? Export it again, with one frame a line.",
        )
    try:
        if not set("".join(tokens)) <= set("0123456789+-.eE"):
            raise ValueError
        return np.array(tokens, np.float64).reshape(whole, channels)
    except ValueError:
        for number, row in enumerate(rows):
            _check_numbers(parsed, number, row)
    raise InputError(f"{parsed.path}: the frames cannot be read as numbers; is the file damaged?")


def _check_counter(parsed: Parsed, rows: list[list[str]]) -> None:
    """Refuse rows that begin with the number or the time of their frame."""
    filled = [(at, row) for at, row in enumerate(rows) if row]
    if len(filled) < 3 or any(len(row) != parsed.channels + 1 for _, row in filled):
        return
    first = [parse_number(row[0]) for _, row in filled]
    numbers = np.array([math.nan if value is None else value for value in first])
    steps = np.diff(numbers)
    if np.all(steps > 0) and np.ptp(steps) <= 0.01 * steps[0] + 1e-9:
        fail(
            parsed.path,
            parsed.first + filled[0][0],
            f"expected {parsed.channels} values, one a channel; got {parsed.channels + 1}, of which the first counts "
            "the frames; remove that column.",
        )


def find_fault(parsed: Parsed) -> NoReturn:
    """Raise an ``InputError`` for the first value or line of the motion that is wrong."""
    rows = [line.split() for line in parsed.lines]
    for at, tokens in enumerate(rows):
        _check_numbers(parsed, at, tokens)
    for at, tokens in enumerate(rows):
        if tokens and len(tokens) != parsed.channels:
            short = "is the file cut short? Restore it, or remove the line and correct the header"
            hint = short if len(tokens) < parsed.channels else "correct the joints' channels or remove the rest"
            message = f"expected {parsed.channels} values, one a channel; got {len(tokens)}; {hint}."
            fail(parsed.path, parsed.first + at, message)
    raise InputError(f"{parsed.path}: the frames cannot be read as numbers; is the file damaged?")


def _check_numbers(parsed: Parsed, at: int, tokens: list[str]) -> None:
    for column, token in enumerate(tokens, start=1):
        value = parse_number(token)
        if value is None:
            hint = comma_hint(token)
            fail(parsed.path, parsed.first + at, f"expected a number as value {column}; got {shown(token)}{hint}.")
        if abs(value) > MAX_VALUE:
            fail(parsed.path, parsed.first + at, f"value {column} is out of range; got {shown(token)}.")
