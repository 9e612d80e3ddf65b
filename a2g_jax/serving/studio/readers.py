"""What can be uploaded, with the readers of the package that look at it."""

from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.serving.studio.uploads import Kind

#: Longest speech, seconds: five samples of it are a page that browsers play.
MOST_SECONDS = 600.0
#: Longest clip, seconds.
MOST_CLIP_SECONDS = 300.0
#: Peaks of a waveform that the page draws.
PEAKS = 600

_SPEECH = (
    ".wav", ".mp3", ".mp4", ".m4a", ".flac", ".ogg", ".opus", ".aif", ".aiff", ".caf", ".w64", ".aac", ".mov",
    ".m4v", ".webm", ".mkv", ".mka", ".3gp", ".wma", ".wmv", ".amr", ".avi",
)  # fmt: skip


def speech(path: Path) -> dict[str, Any]:
    """Length, waveform and warnings of a recording.

    Raises:
        InputError: audio that cannot be used.
    """
    from a2g_jax.inspection.audio_checks import speech_warnings
    from a2g_jax.io.audio import load_audio

    sound = load_audio(path, max_seconds=MOST_SECONDS)
    return {
        "seconds": len(sound.samples) / sound.info.sample_rate,
        "peaks": peaks(sound.samples),
        "warnings": [f"{one.message} {one.fix}".strip() for one in speech_warnings(sound)],
    }


def clip(path: Path) -> dict[str, Any]:
    """Length and joints of a motion.

    Raises:
        InputError: a file that cannot be read, without a human body, or too long.
    """
    from a2g_jax.generation.clips import read_motion
    from a2g_jax.geometry.retarget import find_rig

    motion = read_motion(path)
    if motion.seconds > MOST_CLIP_SECONDS:
        raise InputError(f"{path}: lasts {motion.seconds:.0f} s; clips have {MOST_CLIP_SECONDS:.0f} s at most; cut it.")
    find_rig(motion, name=str(path))
    return {"seconds": motion.seconds, "joints": motion.skeleton.joints, "warnings": []}


def character(path: Path) -> dict[str, Any]:
    """Joints of a rig.

    Raises:
        InputError: a file that cannot be read, or without a human body.
    """
    from a2g_jax.io.character import read_character

    found = read_character(path)
    return {"joints": found.rig.skeleton.joints, "writes": found.suffix.removeprefix("."), "warnings": found.notes()}


def peaks(samples: Any, count: int = PEAKS) -> list[float]:
    """The loudest sample of each of at most ``count`` pieces, relative to the loudest of all."""
    size = max(1, -(-len(samples) // count))
    padded = np.pad(np.abs(samples), (0, -len(samples) % size))
    loudest = padded.reshape(-1, size).max(axis=1)
    return [round(float(value), 3) for value in loudest / max(float(loudest.max(initial=0.0)), 1e-6)]


#: Uploads by what they are for.
KINDS = {
    "speech": Kind("speech", _SPEECH, 500_000_000, speech),
    "clip": Kind("motion clips", (".bvh", ".npz"), 200_000_000, clip),
    "character": Kind("characters", (".bvh", ".glb", ".vrm"), 200_000_000, character),
}
