"""What the page shows: a motion with its label, and spans of time drawn as lanes under the waveform."""

from dataclasses import dataclass

from a2g_jax.geometry.motion import Motion


@dataclass(frozen=True)
class Track:
    """A lane of labelled spans, such as the gesture phases of one hand.

    Each span is ``(start, end, text, key)`` in seconds. The key picks the colour: ``preparation``, ``stroke``,
    ``hold``, ``retraction``, ``rest``, ``left``, ``right`` and ``both`` have fixed colours, ``#rrggbb`` is itself, and
    any other key gets one of the palette, always the same.
    """

    name: str
    spans: tuple[tuple[float | int, float | int, str, str], ...]


@dataclass(frozen=True, eq=False)
class Figure:
    """One moving body of the page, with the text under it."""

    motion: Motion
    label: str
    note: str = ""
    tracks: tuple[Track, ...] = ()
