"""One recording: speech, its motion and annotations."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.io.words import Word as Word


@dataclass(frozen=True, eq=False, kw_only=True)
class Speech:
    """Speech audio with its annotations; everything recorded with it also starts at time zero."""

    name: str
    """Unique within a corpus."""
    audio: Float[np.ndarray, " N"]
    """Mono samples in -1 to 1."""
    sample_rate: int
    words: tuple[Word, ...] = ()
    speaker: str = ""
    emotion: str = ""
    sources: tuple[str, ...] = ()
    """Files that it was read from; empty for a generated recording."""
    annotations: dict[str, Any] = field(default_factory=dict)
    """Further annotations as JSON values; times in seconds."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording(Speech):
    """Speech with the motion of a skeleton."""

    motion: Motion


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseRecording(Speech):
    """Speech with poses that have no skeleton: keypoints of a video, or directions of bones."""

    motion: PoseTrack
