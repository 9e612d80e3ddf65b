"""Readers of data sets: how to find the recordings in a folder, and how to read each."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from a2g_jax.recording import PoseRecording, Recording

#: Parts of an official split.
SPLITS = ("train", "validation", "test")


@dataclass(frozen=True)
class LabelRule:
    """Which windows of a table of emotions count (:mod:`a2g_jax.data.emotion_table`)."""

    confidence: float = 0.9
    """Least probability of a window's emotion."""
    emotions: tuple[str, ...] = ()
    """Emotions that count; empty for all."""
    table: str = ""
    """File name of the table in the data set's folder; empty where the user names one."""


@dataclass(frozen=True)
class Piece:
    """A stretch of a recording, with its label of a table of emotions (:mod:`a2g_jax.data.emotion_table`)."""

    start: float
    """Seconds from the start of the recording."""
    end: float
    emotion: str
    confidence: float
    """Mean probability of the emotion over the labelled windows in it."""


@dataclass(frozen=True)
class Take:
    """A recording of a data set, found but not read."""

    name: str
    """Unique within the data set."""
    sources: tuple[str, ...]
    """The files it is read from."""
    split: str = ""
    """``"train"``, ``"validation"`` or ``"test"`` by the official split; empty without one."""
    spec: dict[str, Any] = field(default_factory=dict)
    """Further arguments of reading it, as JSON values: a clip's index, times."""
    group: str = ""
    """Takes of one group, such as pieces of one recording, are in the same part of a split by the seed."""
    piece: Piece | None = None
    """The stretch that is prepared; None for all of it."""


@dataclass(frozen=True)
class DataSet:
    """Reader of a data set in its authors' layout on disk."""

    name: str
    """On the command line."""
    title: str
    fps: float
    """The usual rate in papers, frames per second."""
    find: Callable[[Path], list[Take]]
    """All recordings under the data set's folder, in a fixed order; ``InputError`` for a folder without any."""
    read: Callable[[Take, int], Recording | PoseRecording]
    """A recording with its audio at a sample rate. A function of a module, so that worker processes can import it."""
    pose: str = "6d"
    """Default representation of its poses."""
    about: str = ""
    """Where to get it, its licence, its layout on disk, and the official split."""
    labels: LabelRule | None = None
    """Of data sets whose emotions are in a table; None for others."""
