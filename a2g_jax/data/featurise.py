"""One recording as rows of a corpus: features and motion at the same frame times."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int16

from a2g_jax.data.datasets.cut import cut
from a2g_jax.data.scaled_waveform import scaled_waveform
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.geometry.motion import Motion, resample
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_track import PoseTrack, represent, resample_track
from a2g_jax.geometry.retarget import body_skeleton, find_rig, retarget, upper_body_rig
from a2g_jax.geometry.retarget.calibration import calibration_frames
from a2g_jax.geometry.retarget.onto import on_skeleton
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.geometry.smooth import smooth
from a2g_jax.geometry.turns import FASTEST, bridge_turns
from a2g_jax.recording import PoseRecording, Recording

#: Seconds of a calibration from which the lengths of motion and audio show whether the audio has it, too.
_CLEARLY = 0.25


@dataclass(frozen=True, eq=False)
class Prepared:
    """One recording as rows of a corpus."""

    name: str
    audio: Float[np.ndarray, "T width"]
    pose: Float[np.ndarray, "T R D"]
    root: Float[np.ndarray, "T 3"]
    waveform: Int16[np.ndarray, " N"] | None
    """Samples over the duration of the frames, where the corpus has them."""
    body: Skeleton | PoseLayout
    """Joints, points or bones of the pose rows."""
    speaker: str
    emotion: str
    split: str
    """Part of the official split, or empty."""
    sources: tuple[str, ...]
    annotations: dict[str, Any]
    notes: tuple[str, ...] = ()
    """What the user should know of it, a sentence each."""
    waveform_gain: float = 1.0
    """What the samples of the waveform were multiplied by."""


@dataclass(frozen=True)
class Skipped:
    """A recording that cannot be prepared."""

    name: str
    sources: tuple[str, ...]
    reason: str


def prepare_recording(
    recording: Recording | PoseRecording,
    features: Features,
    split: str = "",
    skeleton: Skeleton | None = None,
    cutoff: float | None = None,
) -> Prepared:
    """Features and motion of one recording, over the frames that both have.

    A calibration pose at the start of a recorded motion is left out, with its audio, and turns that are faster than any
    limb's are bridged, since a network would repeat them; notes name both.

    Args:
        split: the recording's part of the official split, if any.
        skeleton: the body to retarget to, in place of the one that ``features.joints`` describes.
        cutoff: frequency in Hz above which a motion with rotations is smoothed; None leaves it as it is.

    Raises:
        InputError: audio and motion differ in length by more than a second and 5 %, the audio has another rate, the
            rig is not recognised, or the motion cannot be written in the representation.
    """
    where = " and ".join(recording.sources) or recording.name
    mel, fps = features.mel, features.fps
    if recording.sample_rate != mel.sample_rate:
        raise InputError(f"{where}: has {recording.sample_rate} Hz audio; expected {mel.sample_rate} Hz.")
    notes: tuple[str, ...] = ()
    whole = recording.motion if isinstance(recording, Recording) else None
    if isinstance(recording, Recording) and recording.sources:
        recording, notes = without_calibration(recording)
    audio_seconds, motion_seconds = len(recording.audio) / recording.sample_rate, recording.motion.seconds
    if abs(audio_seconds - motion_seconds) > max(1.0, 0.05 * max(audio_seconds, motion_seconds)):
        raise InputError(
            f"{where}: audio lasts {audio_seconds:.2f} s and motion {motion_seconds:.2f} s; cut them to the same take,"
            " or correct the motion's frame time."
        )
    frames = min(round(audio_seconds * fps), round(motion_seconds * fps))
    if frames < 2:
        raise InputError(f"{where}: gives {frames} frames at {fps:g} fps; use longer recordings or a higher --fps.")
    motion: Motion | PoseTrack
    if isinstance(recording.motion, PoseTrack):
        motion = resample_track(recording.motion, fps, frames)
        root = np.zeros((frames, 3), np.float32)
    else:
        moved = recording.motion if cutoff is None else smooth(recording.motion, cutoff)
        if skeleton is None:
            moved = choose_joints(moved, features.joints, where, whole)
        else:
            moved = on_skeleton(moved, skeleton, moved.fps, where, whole)
        motion = resample(moved, fps, frames)
        if recording.sources:
            motion, turned = bridge_turns(motion)
            notes += flip_notes(recording.name, turned)
        root = np.asarray(motion.root, np.float32)
    pose, body = represent(motion, features.pose, where)
    waveform, gain = None, 1.0
    if features.waveform:
        waveform, gain = scaled_waveform(recording.audio, round(frames * mel.sample_rate / fps))
    return Prepared(
        name=recording.name,
        audio=log_mel(recording.audio, mel, fps, frames),
        pose=pose,
        root=root,
        waveform=waveform,
        waveform_gain=gain,
        body=body,
        speaker=recording.speaker,
        emotion=recording.emotion,
        split=split,
        sources=recording.sources,
        annotations={
            "words": [asdict(word) for word in recording.words],
            **({"motion_fps": float(recording.motion.fps)} if recording.sources else {}),
            **recording.annotations,
        },
        notes=notes,
    )


def flip_notes(name: str, turned: Mapping[str, int]) -> tuple[str, ...]:
    """A note on joints whose turns were bridged, by joint with the number of frames; none without any."""
    if not turned:
        return ()
    joints = ", ".join(f"{joint} ({count})" for joint, count in turned.items())
    return (f"{name}: turns faster than {FASTEST:g} degrees a second are bridged; frames by joint: {joints}.",)


def without_calibration(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The recording without a calibration pose at its start, and a note if there was one.

    The audio is cut as well, unless it is as long as the motion without that pose.
    """
    motion = recording.motion
    count = calibration_frames(motion)
    if count == 0:
        return recording, ()
    seconds = count / motion.fps
    audio_seconds = len(recording.audio) / recording.sample_rate
    prepended = seconds > _CLEARLY and abs(motion.seconds - seconds - audio_seconds) < abs(
        motion.seconds - audio_seconds
    )
    if prepended:
        left = replace(recording, motion=motion.clip(count, motion.frames))
    else:
        left = cut(recording, seconds)
        left = replace(left, motion=motion.clip(count, motion.frames))
    frames = "frame 0" if count == 1 else f"frames 0 to {count - 1}"
    speech = ", before the speech," if prepended else " and its speech"
    note = f"{recording.name}: {frames} of the motion ({seconds:.2f} s{speech}) left out: a calibration pose."
    annotations = {**left.annotations, "calibration": {"frames": count, "with_audio": not prepended}}
    return replace(left, annotations=annotations), (note,)


def choose_joints(motion: Motion, joints: str, where: str, whole: Motion | None = None) -> Motion:
    """The motion on the joints that a corpus keeps.

    A rig is retargeted to the 22 body joints, or to the 47 of the upper body: upright with y up and facing z, in
    metres, with a T-pose at rest, so that equal numbers are equal poses for any rig.

    Args:
        whole: the take that the motion is a part of, which may show the rig's reference pose; itself by default.

    Raises:
        InputError: the rig is not recognised.
    """
    if joints == "all" or (joints == "body" and motion.skeleton.names == BODY_JOINTS):
        return motion
    try:
        rig = find_rig(motion if whole is None else whole, name=where)
    except InputError as error:
        raise InputError(f"{error} Or use --joints all, which keeps the rig as it is.") from None
    target = body_skeleton(rig) if joints == "body" else upper_body_rig(rig)
    return retarget(motion, target, source=rig)
