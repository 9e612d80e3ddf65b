"""One recording as rows of a corpus: features and motion at the same frame times."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.recording import Recording
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.geometry.body import find_body
from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.select import select_joints
from a2g_jax.geometry.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Prepared:
    """One recording as rows of a corpus."""

    name: str
    audio: Float[np.ndarray, "T bands"]
    pose: Float[np.ndarray, "T J 6"]
    root: Float[np.ndarray, "T 3"]
    skeleton: Skeleton
    speaker: str
    emotion: str
    sources: tuple[str, ...]
    annotations: dict[str, Any]


def prepare_recording(recording: Recording, fps: float, mel: MelConfig, joints: str = "body") -> Prepared:
    """Features and motion of one recording at ``fps``, as many frames as both have.

    Args:
        joints: ``"body"`` keeps the 22 body joints where they can be found by name (and all joints otherwise),
            ``"all"`` keeps the rig as it is.

    Raises:
        InputError: audio and motion differ in length by more than a second and 5 %, or the audio has another rate.
    """
    where = " and ".join(recording.sources) or recording.name
    if recording.sample_rate != mel.sample_rate:
        raise InputError(f"{where}: has {recording.sample_rate} Hz audio; expected {mel.sample_rate} Hz.")
    heard, seen = len(recording.audio) / recording.sample_rate, recording.motion.seconds
    if abs(heard - seen) > max(1.0, 0.05 * max(heard, seen)):
        raise InputError(
            f"{where}: audio lasts {heard:.2f} s and motion {seen:.2f} s; cut them to the same take, or correct the"
            " motion's frame time."
        )
    motion = recording.motion
    if joints == "body" and (body := find_body(motion.skeleton)) is not None:
        motion = select_joints(motion, body)
    frames = min(round(heard * fps), round(seen * fps))
    if frames < 2:
        raise InputError(f"{where}: gives {frames} frames at {fps:g} fps; use longer recordings or a higher --fps.")
    motion = resample(motion, fps, frames)
    rotations = np.asarray(motion.rotations, np.float32)
    return Prepared(
        name=recording.name,
        audio=log_mel(recording.audio, mel, fps, frames),
        pose=np.swapaxes(rotations[..., :2], -1, -2).reshape(*rotations.shape[:2], 6),
        root=np.asarray(motion.root, np.float32),
        skeleton=motion.skeleton,
        speaker=recording.speaker,
        emotion=recording.emotion,
        sources=recording.sources,
        annotations={"words": [asdict(word) for word in recording.words], **recording.annotations},
    )
