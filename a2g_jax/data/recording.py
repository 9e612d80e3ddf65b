"""One recording: speech, the motion made with it, and what is known about both."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.io.words import Word as Word


@dataclass(frozen=True, eq=False, kw_only=True)
class Speech:
    """Speech audio and what is known about it; whatever else is recorded with it also starts at time zero."""

    name: str
    """Unique within a corpus."""
    audio: Float[np.ndarray, " N"]
    """Mono samples in -1 to 1."""
    sample_rate: int
    words: tuple[Word, ...] = ()
    speaker: str = ""
    emotion: str = ""
    sources: tuple[str, ...] = ()
    """Files it was read from; empty for a generated one."""
    annotations: dict[str, Any] = field(default_factory=dict)
    """Anything else that is known, as JSON-able values; times in seconds."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording(Speech):
    """Speech with the motion of a skeleton."""

    motion: Motion


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseRecording(Speech):
    """Speech with poses that have no skeleton: keypoints of a video, or directions of bones."""

    motion: PoseTrack
