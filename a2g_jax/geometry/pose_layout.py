"""Points and bones of a pose that has no skeleton."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PoseLayout:
    """The points of a pose and the bones between them."""

    names: tuple[str, ...]
    """Of the points."""
    bones: tuple[tuple[int, int], ...]
    """From which point to which; a point is reached before a bone starts from it."""
    lengths: tuple[float, ...] = ()
    """Of the bones, metres, to draw directions with; empty where nothing says them."""

    def __post_init__(self) -> None:
        """Refuse bones between points that are not there."""
        points = len(self.names)
        if any(not (0 <= start < points and 0 <= end < points) for start, end in self.bones):
            raise ValueError(f"a bone joins a point that is not there; there are {points} points: {self.bones}")
        if self.lengths and len(self.lengths) != len(self.bones):
            raise ValueError(f"expected {len(self.bones)} lengths of bones; got {len(self.lengths)}")
