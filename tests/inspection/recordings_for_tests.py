"""Clean generated recordings, and faults to plant into them."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.recording import Recording
from a2g_jax.talker.recordings import talk

RATE = 16000
#: Who talks in the eight clean recordings, in which emotion, in a room or not.
CAST = (
    ("ada", "neutral", False), ("bruno", "anger", True), ("chiara", "happiness", False), ("david", "sadness", True),
    ("elif", "neutral", True), ("felix", "surprise", False), ("ada", "fear", True), ("chiara", "neutral", True),
)  # fmt: skip


@cache
def clean(number: int, seconds: float = 20.0) -> Recording:
    """One of the clean recordings."""
    speaker, emotion, room = CAST[number]
    return talk(seconds, 40 + number, speaker=speaker, emotion=emotion, room=room, name=f"clean{number}")


@cache
def long_talk() -> Recording:
    """A clean recording that is long enough to measure an offset in."""
    return talk(64.0, 1000, speaker="ada", name="long")


def write_pair(folder: Path, recording: Recording, name: str = "take") -> tuple[Path, Path]:
    """The recording as BVH and WAV."""
    bvh, wav = folder / f"{name}.bvh", folder / f"{name}.wav"
    write_bvh(bvh, recording.motion)
    write_audio(wav, recording.audio, recording.sample_rate)
    return bvh, wav


def turned(motion: Motion, joint: str, frames: slice, matrix: np.ndarray) -> Motion:
    """The motion with a joint turned further in some frames."""
    rotations = np.asarray(motion.rotations).copy()
    index = motion.skeleton.index(joint)
    rotations[frames, index] = rotations[frames, index] @ matrix.astype(np.float32)
    return replace(motion, rotations=rotations)


def frozen(motion: Motion, joint: str, start: int, stop: int) -> Motion:
    """The motion with a joint held as it is at ``start``."""
    rotations = np.asarray(motion.rotations).copy()
    index = motion.skeleton.index(joint)
    rotations[start:stop, index] = rotations[start, index]
    return replace(motion, rotations=rotations)


def codes(findings) -> set[str]:
    """Codes of the warnings."""
    return {finding.code for finding in findings if finding.severity == "warning"}
