"""The HIERARCHY section of a BVH file: joints, offsets and channels."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

from a2g_jax.errors import InputError
from a2g_jax.geometry.anthropometry import Unit

#: Bounds on what is read and written: a broken or hostile file costs an error message, not memory.
MAX_DEPTH = 512
MAX_JOINTS = 4096
#: Largest length or angle (in the file's units) that is accepted.
MAX_VALUE = 1e9

CHANNELS = ("Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation")
_CHANNEL = {name.lower(): name for name in CHANNELS}
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_DECIMAL_COMMA = re.compile(r"[+-]?(?:[0-9]*|[0-9]{1,3}(?:\.[0-9]{3})+),[0-9]+(?:[eE][+-]?[0-9]+)?")
_TOKEN = re.compile(r"[{}]|[^\s{}]+|\n")
_STATEMENTS = "OFFSET, CHANNELS, JOINT, End Site or '}'"


@dataclass
class Joint:
    """One ROOT or JOINT block, in the file's units."""

    name: str
    parent: int
    line: int
    offset: tuple[float, float, float] | None = None
    channels: tuple[str, ...] | None = None
    ends: list[tuple[float, float, float]] = field(default_factory=list)


@dataclass(frozen=True)
class Stretch:
    """Bones that move, read as bones of fixed length."""

    joint: str
    """The joint that is farthest from its place in the file."""
    frame: int
    metres: float
    moving: int
    """Number of joints whose position channels move."""

    def __str__(self) -> str:
        """The warning."""
        what = (
            "the position channels of one joint move"
            if self.moving == 1
            else (f"the position channels of {self.moving} joints move")
        )
        return (
            f"{what} against the joint above; bones have a fixed length here, so joints are up to "
            f"{100 * self.metres:.1f} cm from their places in the file ({self.joint}, frame {self.frame})"
        )


@dataclass(frozen=True, eq=False)
class Layout:
    """Layout of a BVH file: what a writer needs to write another motion in the same way."""

    head: str
    """The text before ``MOTION``."""
    joints: list[Joint]
    scale: float
    """Metres in one unit of the file."""
    unit: Unit
    """How that was found."""
    carrier: int = 0
    """The joint whose position channels hold the path of the body."""
    still_root: tuple[float, float, float] | None = None
    """Position of a root that does not move, metres; None if it moves."""
    stretch: Stretch | None = None
    """The largest error of a joint's place that bones of fixed length cause, if bones move."""
    root_doubt: str = ""
    """Why positions of the root may be in another unit; empty if nothing shows it."""


def fail(path: object, line: int, message: str) -> NoReturn:
    """Raise an ``InputError`` for a line of a file."""
    raise InputError(f"{path}, line {line}: {message}")


def shown(token: str) -> str:
    """A token of the file for a message: quoted, on one line, shortened."""
    return repr(token if len(token) <= 40 else token[:37] + "...")


def parse_number(token: str) -> float | None:
    """The number written as ``token`` in plain ASCII, or None, also for Python's own forms (``1_000``, ``nan``)."""
    return float(token) if _NUMBER.fullmatch(token) else None


def comma_hint(token: str) -> str:
    """The remedy for a number written with a decimal comma, or with commas or semicolons around it; else empty."""
    if ";" in token:
        return " (semicolons separate the values: write spaces instead)"
    if "," not in token:
        return ""
    if _DECIMAL_COMMA.fullmatch(token):
        return " (a decimal comma: write a point in all numbers, or export the file with an English number format)"
    return " (commas separate the values: write spaces instead)"


def parse_hierarchy(path: object, text: str) -> list[Joint]:
    """Read the text before ``MOTION``.

    Returns:
        The joints in file order, parents first; joint 0 is the root.

    Raises:
        InputError: an error in a line; the message names it.
    """
    parser = _Parser(path, text)
    parser.file()
    return parser.joints


class _Parser:
    # A loop with an explicit stack: a file may nest deeper than Python's call stack.

    def __init__(self, path: object, text: str) -> None:
        self.path = path
        self.tokens = _tokens(text)
        self.line = 1
        self.ahead: str | None = None
        self.joints: list[Joint] = []
        self.lines: dict[str, int] = {}

    def fail(self, message: str) -> NoReturn:
        fail(self.path, self.line, message)

    def peek(self) -> str:
        """The next token, "" at the end; line breaks are tokens too."""
        if self.ahead is None:
            self.ahead, self.line = next(self.tokens)
        return self.ahead

    def next(self) -> str:
        """Consume and return the next token that is not a line break, "" at the end."""
        while True:
            token = self.peek()
            self.ahead = None if token else ""
            if token != "\n":
                return token

    def file(self) -> None:
        if (token := self.next()).upper() != "HIERARCHY":
            self.fail(f"expected HIERARCHY as the first word; got {shown(token)}. Is this a BVH file?")
        if (token := self.next()).upper() != "ROOT":
            self.fail(f"expected ROOT and its name after HIERARCHY; got {shown(token)}.")
        self.tree()
        if (token := self.next()).upper() == "ROOT":
            self.fail("found a second ROOT; a file may hold one skeleton. Split the file.")
        if token == "}":
            self.fail("found '}' without its '{'; remove it, or add the '{' that is missing above.")
        if token:
            self.fail(f"expected MOTION after the skeleton; got {shown(token)}.")

    def tree(self) -> None:
        stack = [self.open_joint(-1)]
        while stack:
            joint = self.joints[stack[-1]]
            token = self.next()
            match token.upper():
                case "OFFSET":
                    if joint.offset is not None:
                        self.fail(f"found a second OFFSET in {shown(joint.name)}; remove one.")
                    joint.offset = self.offset(f"joint {shown(joint.name)}")
                case "CHANNELS":
                    if joint.channels is not None:
                        self.fail(f"found a second CHANNELS in {shown(joint.name)}; remove one.")
                    joint.channels = self.channels(joint)
                case "JOINT":
                    if len(stack) >= MAX_DEPTH:
                        self.fail(f"joints nest deeper than {MAX_DEPTH} levels; is the file damaged?")
                    stack.append(self.open_joint(stack[-1]))
                case "END" | "ENDSITE":
                    joint.ends.append(self.end_site(joint.name))
                case "}":
                    if joint.offset is None:
                        self.fail(f"joint {shown(joint.name)} has no OFFSET; add one before this '}}'.")
                    stack.pop()
                case "ROOT":
                    self.fail("found a second ROOT; a file may hold one skeleton. Is a '}' missing above?")
                case "":
                    self.fail(
                        f"the skeleton ends while joint {shown(joint.name)} (line {joint.line}) is open; add its '}}'."
                    )
                case _:
                    self.fail(f"expected {_STATEMENTS} in joint {shown(joint.name)}; got {shown(token)}.")

    def open_joint(self, parent: int) -> int:
        if len(self.joints) >= MAX_JOINTS:
            self.fail(f"more than {MAX_JOINTS} joints; is the file damaged?")
        words = [self.next()]
        line = self.line
        if words[0] in ("", "{", "}"):
            self.fail(f"expected the joint's name; got {shown(words[0])}.")
        while self.peek() not in ("", "{", "}", "\n"):
            words.append(self.next())
        name = " ".join(words)
        if (token := self.next()) != "{":
            self.fail(f"expected '{{' after the joint's name {shown(name)}; got {shown(token)}.")
        if name in self.lines:
            fail(
                self.path,
                line,
                f"a joint named {shown(name)} is in line {self.lines[name]} already; rename one of them.",
            )
        self.lines[name] = line
        self.joints.append(Joint(name, parent, line))
        return len(self.joints) - 1

    def end_site(self, name: str) -> tuple[float, float, float]:
        while (token := self.next()) not in ("", "{", "}"):
            if token.upper() in ("OFFSET", "JOINT", "CHANNELS"):
                break
        if token != "{":
            self.fail(f"expected '{{' after End Site in joint {shown(name)}; got {shown(token)}.")
        if (token := self.next()).upper() != "OFFSET":
            self.fail(f"expected OFFSET in the End Site of joint {shown(name)}; got {shown(token)}.")
        offset = self.offset(f"the End Site of {shown(name)}")
        if (token := self.next()).upper() == "CHANNELS":
            if (token := self.next()) != "0":
                self.fail(f"an End Site has no channels; got CHANNELS {shown(token)}.")
            token = self.next()
        if token != "}":
            self.fail(f"expected '}}' after the OFFSET of the End Site of {shown(name)}; got {shown(token)}.")
        return offset

    def offset(self, owner: str) -> tuple[float, float, float]:
        values = []
        for _ in range(3):
            token = self.next()
            value = parse_number(token)
            if value is None:
                self.fail(f"expected three numbers as the OFFSET of {owner}; got {shown(token)}{comma_hint(token)}.")
            if abs(value) > MAX_VALUE:
                self.fail(f"the OFFSET of {owner} is out of range; got {shown(token)}.")
            values.append(value)
        return (values[0], values[1], values[2])

    def channels(self, joint: Joint) -> tuple[str, ...]:
        token = self.next()
        if token not in ("0", "1", "2", "3", "4", "5", "6"):
            self.fail(
                f"expected a number of channels from 0 to 6 in joint {shown(joint.name)}; got {shown(token)}"
                f"{comma_hint(token)}."
            )
        count = int(token)
        found: list[str] = []
        for _ in range(count):
            token = self.next()
            channel = _CHANNEL.get(token.lower())
            if channel is None:
                self.fail(
                    f"expected {count} channel names in joint {shown(joint.name)}; got {shown(token)}, "
                    f"which is none of {', '.join(CHANNELS)}{comma_hint(token)}."
                )
            if channel in found:
                self.fail(f"channel {channel} occurs twice in joint {shown(joint.name)}; remove one.")
            found.append(channel)
        return tuple(found)


def _tokens(text: str) -> Iterator[tuple[str, int]]:
    line = 1
    for match in _TOKEN.finditer(text):
        token = match.group()
        yield token, line
        line += token == "\n"
    yield "", line
