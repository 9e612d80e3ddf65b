"""Choices for reading recordings, and remarks on what was read."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from a2g_jax.errors import InputError


@dataclass(frozen=True)
class Note:
    """A remark on a file that can be used: what is unusual about it, and what can be done."""

    code: str
    """Kind of the remark, such as ``"channels"``; stable, for scripts."""
    message: str
    fix: str = ""
    """Remedy."""
    seconds: float | None = None
    """Where it begins."""
    value: float | None = None
    """The measured number in the message."""

    def __str__(self) -> str:
        return f"{self.message} {self.fix}".strip()


@dataclass
class Reading:
    """What to take from files with several channels or tiers, and the remarks made while reading."""

    channel: int | None = None
    """Channel of audio from 1 on; None for the mean of all."""
    tier: str | None = None
    """Tier of TextGrids: its name, or the speaker's; None for the first one of words."""
    notes: list[str] = field(default_factory=list)
    """Remarks, each with its file."""

    def note(self, place: object, note: Note) -> None:
        """Add a remark once."""
        line = f"{place}: {note}"
        if line not in self.notes:
            self.notes.append(line)


_CURRENT: ContextVar[Reading | None] = ContextVar("reading", default=None)


def current_reading() -> Reading:
    """The choices of the enclosing :func:`reading`, else those without any."""
    return _CURRENT.get() or Reading()


@contextmanager
def reading(channel: int | None = None, tier: str | None = None) -> Iterator[Reading]:
    """Choices for every reader that is called in the block, whatever the data set; yields them with the remarks."""
    choices = Reading(channel, tier)
    token = _CURRENT.set(choices)
    try:
        yield choices
    finally:
        _CURRENT.reset(token)


def parse_channel(text: str) -> int:
    """The number of a channel from ``left``, ``right`` or a number from 1 on.

    Raises:
        InputError: anything else.
    """
    names = {"left": 1, "right": 2}
    name = text.strip().lower()
    if name in names:
        return names[name]
    if name.isascii() and name.isdigit() and 1 <= int(name) <= 1024:
        return int(name)
    raise InputError(f"channel {text!r}: expected left, right or a number from 1 on.")
