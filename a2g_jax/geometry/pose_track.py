"""Motion that has no skeleton: keypoints of a video, or directions of bones."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_rows import layout_rows, unit_vectors, write_motion
from a2g_jax.geometry.skeleton import Skeleton


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
        rows = layout_rows(self.layout, self.kind)
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

    def clip(self, start: int, stop: int) -> "PoseTrack":
        """Frames ``start`` to ``stop`` (exclusive)."""
        return replace(self, values=self.values[start:stop])


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
    # Halfway between opposite directions there is none: the one before stays.
    values = unit_vectors(values, track.kind, track.values[before])
    return PoseTrack(track.kind, values.astype(track.values.dtype), track.layout, fps)


def represent(
    motion: Motion | PoseTrack, kind: str, where: str
) -> tuple[Float[np.ndarray, "T R D"], Skeleton | PoseLayout]:
    """Poses of a motion or a track, and the body that their rows are of.

    Args:
        kind: a key of :data:`~a2g_jax.geometry.pose_space.WIDTHS`.
        where: the recording, for the error.

    Raises:
        InputError: the motion cannot be written in this representation.
    """
    if not isinstance(motion, PoseTrack):
        return write_motion(motion, kind, where)
    if motion.kind != kind:
        raise InputError(f"{where}: holds {motion.kind}; prepare it with --pose {motion.kind}.")
    return np.asarray(motion.values, np.float32), motion.layout
