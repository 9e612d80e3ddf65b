"""Contents of the page: motions with their labels, and lanes of the timeline."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.viz.player.skin import Skin


@dataclass(frozen=True)
class Track:
    """A lane of labelled spans, such as the gesture phases of one hand.

    Each span is ``(start, end, text, key)`` in seconds. The key picks the colour: ``preparation``, ``stroke``,
    ``hold``, ``retraction``, ``rest``, ``left``, ``right`` and ``both`` have fixed colours, ``#rrggbb`` is itself, and
    any other key gets one of the palette, always the same.
    """

    name: str
    spans: tuple[tuple[float | int, float | int, str, str], ...]

    def encoded(self) -> dict:
        """The lane as JSON for the page."""
        return {"name": self.name, "spans": [list(span) for span in self.spans]}


@dataclass(frozen=True)
class Bars:
    """A lane of bars, such as syllables as high as their accent.

    Each bar is ``(start, end, height, text, note)``: seconds, 0 to 1, the label, and further text of the tooltip.
    """

    name: str
    bars: tuple[tuple[float | int, float | int, float | int, str, str], ...]

    def encoded(self) -> dict:
        """The lane as JSON for the page."""
        return {"name": self.name, "bars": [list(bar) for bar in self.bars]}


@dataclass(frozen=True, eq=False)
class Curve:
    """A lane with a curve, such as the pitch of the voice; gaps where the values are NaN."""

    name: str
    rate: float
    """Values per second; the first is at time zero."""
    values: Float[np.ndarray, " N"]
    unit: str = ""

    def encoded(self) -> dict:
        """The lane as JSON for the page."""
        values = [round(float(value), 2) if np.isfinite(value) else None for value in self.values]
        return {"name": self.name, "rate": self.rate, "values": values, "unit": self.unit}


@dataclass(frozen=True)
class Mark:
    """A moment of one hand or both, such as the apex of a stroke."""

    time: float
    """Seconds."""
    size: float
    """0 to 1."""
    hand: str
    """``left``, ``right`` or ``both``."""
    key: str
    """Colour and name: ``beat``, ``offer``, ``sweep``, ``point``, ``list``, ``frame``, or any other."""
    note: str = ""
    """Further text of the tooltip."""


@dataclass(frozen=True)
class Hands:
    """A lane with the gesture phases of both hands, left above right, and marks on them.

    Phases are ``(start, end, phase)`` in seconds, drawn by their kind: ``preparation`` rises, ``stroke`` is full,
    ``hold`` is level, ``retraction`` falls, ``rest`` is a line. The current phase is also written under the
    figure, with the mark's key during a stroke.
    """

    name: str
    left: tuple[tuple[float | int, float | int, str], ...]
    right: tuple[tuple[float | int, float | int, str], ...]
    marks: tuple[Mark, ...] = ()

    def encoded(self) -> dict:
        """The lane as JSON for the page."""
        return {
            "name": self.name,
            "left": [list(span) for span in self.left],
            "right": [list(span) for span in self.right],
            "marks": [[mark.time, mark.size, mark.hand, mark.key, mark.note] for mark in self.marks],
        }


#: Any lane of the timeline.
Lane = Track | Bars | Curve | Hands


@dataclass(frozen=True, eq=False)
class Figure:
    """One motion of the page, with the text under it."""

    motion: Motion
    label: str
    note: str = ""
    tracks: tuple[Lane, ...] = ()
    files: tuple[str, ...] = ()
    """Names of its files in the folder of the page, which offers them."""
    number: int | None = None
    """Picks the colour, so that it stays the same in any order of the figures; None for the place on the page."""
    skin: Skin | None = None
    """A character's mesh on the motion's skeleton, in place of the figure; the page has it once for all its figures."""
