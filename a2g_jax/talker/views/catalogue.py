"""Views of generated recordings by the name of the data set whose format they have: :data:`VIEWS`."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.recording import PoseRecording, Recording
from a2g_jax.talker.views.directions import TED, TED_EXPRESSIVE, BoneLayout, directions
from a2g_jax.talker.views.keypoints import KEYPOINT_BONES, KEYPOINTS, keypoints
from a2g_jax.talker.views.upper_body import upper_body_recording


@dataclass(frozen=True)
class View:
    """The format of a data set's recordings."""

    title: str
    fps: float
    """Its rate, frames per second."""
    pose: str
    """Representation of its poses."""
    fingers: bool
    """Whether it needs a motion with fingers."""
    convert: Callable[[Recording, float], Recording | PoseRecording]
    """A generated recording in that format, at a rate in frames per second."""


def _whole(recording: Recording, _fps: float) -> Recording:
    return recording


def _two_dimensional(recording: Recording, fps: float) -> PoseRecording:
    values = keypoints(recording.motion, fps).astype(np.float32)
    return _poses(recording, PoseTrack("keypoints", values, PoseLayout(KEYPOINTS, KEYPOINT_BONES), fps))


def _ted(recording: Recording, fps: float) -> PoseRecording:
    return _directed(recording, TED, fps)


def _ted_expressive(recording: Recording, fps: float) -> PoseRecording:
    return _directed(recording, TED_EXPRESSIVE, fps)


def _directed(recording: Recording, bones: BoneLayout, fps: float) -> PoseRecording:
    values = directions(recording.motion, bones, fps)
    layout = PoseLayout(bones.points, bones.bones, bones.lengths)
    rows = values.reshape(len(values), len(bones.bones), 3).astype(np.float32)
    return _poses(recording, PoseTrack("directions", rows, layout, fps))


def _poses(recording: Recording, track: PoseTrack) -> PoseRecording:
    return PoseRecording(
        name=recording.name,
        audio=recording.audio,
        sample_rate=recording.sample_rate,
        words=recording.words,
        speaker=recording.speaker,
        emotion=recording.emotion,
        annotations=recording.annotations,
        motion=track,
    )


VIEWS: dict[str, View] = {
    "body": View("the skeleton as it is", 30.0, "6d", False, _whole),
    "beat": View("BEAT's 47 joints of the upper body", 15.0, "6d", True, upper_body_recording),
    "ted": View("TED Gesture's 9 bone directions", 15.0, "directions", False, _ted),
    "ted-expressive": View("TED-Expressive's 42 bone directions", 15.0, "directions", True, _ted_expressive),
    "s2g": View("Speech2Gesture's 49 keypoints in the image", 15.0, "keypoints", True, _two_dimensional),
}


def find_view(name: str) -> View:
    """The view of that name.

    Raises:
        InputError: there is none of that name.
    """
    if name not in VIEWS:
        raise InputError(f"--view: there is no {name!r}; there are: {', '.join(VIEWS)}.")
    return VIEWS[name]
