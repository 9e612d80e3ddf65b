"""What a reader of a data set is: what to find in a folder, and how to read each of it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from a2g_jax.data.recording import PoseRecording, Recording

#: What an official split may call its parts.
SPLITS = ("train", "validation", "test")


@dataclass(frozen=True)
class Take:
    """A recording that a data set has, found but not read."""

    name: str
    """Unique within the data set."""
    sources: tuple[str, ...]
    """The files it is read from."""
    split: str = ""
    """``"train"``, ``"validation"`` or ``"test"`` where the data set says it, else empty."""
    spec: dict[str, Any] = field(default_factory=dict)
    """Whatever else reading it needs, as JSON-able values: a clip's index, times."""


@dataclass(frozen=True)
class DataSet:
    """How recordings of a data set, as its authors lay it out on disk, are read."""

    name: str
    """On the command line."""
    title: str
    fps: float
    """The rate that papers prepare it at, frames per second."""
    find: Callable[[Path], list[Take]]
    """All recordings under the data set's folder, in a fixed order; ``InputError`` if the folder is another one."""
    read: Callable[[Take, int], Recording | PoseRecording]
    """A recording with its audio at a sample rate. A function of a module, so that worker processes can be sent it."""
    pose: str = "6d"
    """The representation that its poses have where nobody asks for another."""
    about: str = ""
    """Where to get it, its licence, how it lies on disk, and which split is official."""
