"""Parts of the drawn surface of a figure: points that move with the joints, and cones between them.

The page has no skeletons: it gets world positions of points and a list of cones. Everything that depends on names,
proportions and the rest pose is decided in :mod:`~a2g_jax.viz.player.shape`.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

#: A location: a point ``(p,)``, between two points ``(p, q, weight)``, or metres along the axes of a frame
#: ``(frame, x, y, z)``.
Anchor = tuple[float | int, ...]


@dataclass(frozen=True)
class Cone:
    """A round cone between two anchors with a radius at each, flattened along one axis of a frame."""

    start: Anchor
    end: Anchor
    start_radius: float | int
    end_radius: float | int
    tint: str = "body"
    """``body`` (the figure's colour), ``legs`` and ``shoe`` (darker), ``skin``, ``hair`` or ``eye``."""
    frame: int = -1
    """Frame whose ``axis`` the cone is flattened along; -1 for a round one."""
    axis: int = 2
    flat: float = 1.0
    """Thickness along the axis, as a fraction of the radius."""
    shades: bool = False
    """Whether it casts a soft ambient shadow on the rest of the figure."""

    def encoded(self) -> list:
        """The cone as JSON for the page."""
        numbers = [self.start_radius, self.end_radius, self.frame, self.axis, self.flat, int(self.shades)]
        return [short(self.start), short(self.end), *short(numbers), self.tint]


@dataclass
class Shape:
    """The drawn surface of a figure: points, frames and cones of one skeleton."""

    points: list[tuple[int, tuple[float, float, float]]]
    """(joint, offset in that joint's frame), metres; the first J are the joints themselves."""
    frames: list[tuple[int, int, int, int]] = field(default_factory=list)
    """Axes from points (origin, up, left, right): Y from origin to up, X from right to left, Z = X x Y."""
    cones: list[Cone] = field(default_factory=list)
    wrists: tuple[int, ...] = ()
    """Points whose trails and speeds are drawn."""

    def point(self, joint: int, offset: Float[np.ndarray, " 3"]) -> int:
        """Add a point that is rigid to ``joint``."""
        self.points.append((joint, (float(offset[0]), float(offset[1]), float(offset[2]))))
        return len(self.points) - 1

    def frame(self, origin: int, up: int, left: int, right: int) -> int:
        """Add a frame."""
        self.frames.append((origin, up, left, right))
        return len(self.frames) - 1

    def add(self, start: Anchor, end: Anchor, radii: tuple[float, float], **more) -> None:
        """Add a cone."""
        self.cones.append(Cone(start, end, radii[0], radii[1], **more))


def short(numbers: Iterable[float | int]) -> list:
    """Numbers for compact JSON: whole ones as integers, others with five decimals."""
    return [int(number) if float(number).is_integer() else round(float(number), 5) for number in numbers]
