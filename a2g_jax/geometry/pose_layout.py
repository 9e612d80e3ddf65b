"""Motion that has no skeleton: keypoints seen in a video, or directions of bones."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float


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


@dataclass(frozen=True, eq=False)
class PoseTrack:
    """Poses over time."""

    kind: Literal["keypoints", "directions"]
    """``"keypoints"``: where each point is; ``"directions"``: which way each bone goes, as unit vectors."""
    values: Float[np.ndarray, "T P D"]
    """Keypoints (T, points, 2) in the data set's unit, x right and y down as in an image unless the reader says
    otherwise; directions (T, bones, 3)."""
    layout: PoseLayout
    fps: float

    def __post_init__(self) -> None:
        """Refuse values that the layout does not describe."""
        rows = len(self.layout.names if self.kind == "keypoints" else self.layout.bones)
        if self.values.shape[1] != rows:
            raise ValueError(f"expected {rows} {self.kind} in each frame; got {self.values.shape[1]}")

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.values)

    @property
    def seconds(self) -> float:
        """Duration: each frame lasts ``1 / fps``."""
        return self.frames / self.fps


def resample_track(track: PoseTrack, fps: float, frames: int) -> PoseTrack:
    """The poses at another rate, linearly between frames (directions are brought back to length 1).

    Args:
        fps: frame k of the result shows time ``k / fps``.
        frames: number of frames of the result; times after the last frame show the last frame.
    """
    if fps == track.fps and frames <= track.frames:
        return PoseTrack(track.kind, track.values[:frames], track.layout, fps)
    at = np.minimum(np.arange(frames) * (track.fps / fps), track.frames - 1)
    before = np.floor(at).astype(np.int64)
    after = np.minimum(before + 1, track.frames - 1)
    share = (at - before)[:, None, None]
    values = (1.0 - share) * track.values[before] + share * track.values[after]
    if track.kind == "directions":
        length = np.linalg.norm(values, axis=-1, keepdims=True)
        # Halfway between opposite directions there is none: the one before stays.
        values = np.where(length > 1e-6, values / np.maximum(length, 1e-6), track.values[before])
    return PoseTrack(track.kind, values.astype(track.values.dtype), track.layout, fps)
