"""View in the format of BEAT: EmotionGesture's 47 upper-body joints at 15 frames per second.

BEAT (Liu et al. 2022, "BEAT: A Large-Scale Semantic and Emotional Multi-Modal Dataset") has 75 joints, of which
EmotionGesture predicts 47: Spine, Neck, Neck1, and shoulder, arm, forearm, hand and 18 finger joints a side, as 6D
rotations: 282 values a frame.

What is called Spine here is the talker's chest joint (Spine3), to which neck and shoulders are rigidly attached; BEAT's
own 47 joints leave out the vertebrae between, and with them the position of everything above. Neck1 is the talker's
Head. The ring, pinky and index fingers have a metacarpal joint in the palm that never turns against the hand.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion, resample
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.recording import Recording
from a2g_jax.talker.views.landmarks import require_fingers

_FINGERS = ("Middle", "Ring", "Pinky", "Index", "Thumb")
_METACARPALS = ("Ring", "Pinky", "Index")
_PARENTS = {"Pinky": "Ring", "Thumb": "Index"}
"""In BEAT's tree the little finger's parent is the ring finger's metacarpal joint, the thumb's the index finger's."""
_METACARPAL = (0.03, 0.6, 0.55)
"""Place of a metacarpal joint between wrist and knuckle, as shares along each axis: BEAT's, about."""


def _tree() -> tuple[tuple[str, ...], tuple[int, ...], tuple[str, ...]]:
    """Names, parents, and the talker's joint that each takes its rotation from ("" for metacarpals)."""
    rows = [("Spine", "", "Spine3"), ("Neck", "Spine", "Neck"), ("Neck1", "Neck", "Head")]
    for side, word in (("R", "Right"), ("L", "Left")):
        arm = [("Shoulder", "Collar"), ("Arm", "Shoulder"), ("ForeArm", "Elbow"), ("Hand", "Wrist")]
        above = "Spine"
        for name, source in arm:
            rows.append((word + name, above, f"{side}_{source}"))
            above = word + name
        hand = above
        for finger in _FINGERS:
            above = hand + _PARENTS.get(finger, "")
            if finger in _METACARPALS:
                rows.append((hand + finger, above, ""))
                above = hand + finger
            for number in (1, 2, 3):
                name = f"{hand}{finger}{number}"
                rows.append((name, above, f"{side}_{finger}{number}"))
                above = name
    names = tuple(name for name, _, _ in rows)
    parents = tuple(names.index(above) if above else -1 for _, above, _ in rows)
    return names, parents, tuple(source for _, _, source in rows)


UPPER_BODY_JOINTS, UPPER_BODY_PARENTS, SOURCES = _tree()
"""Names and order of the 47 joints in BEAT's files, their parents, and the talker's joint for each.

They are those of :func:`~a2g_jax.geometry.retarget.upper_body_skeleton`, so generated and recorded corpora have the
same joints. ``SOURCES`` is empty for the six metacarpal joints, which the talker does not have.
"""


def upper_body_skeleton(source: Skeleton) -> Skeleton:
    """The 47 joints with the bones of a talker's skeleton."""
    offsets = np.zeros((len(UPPER_BODY_JOINTS), 3))
    for joint, name in enumerate(SOURCES):
        if joint and name:
            offsets[joint] = source.offsets[source.index(name)]
        elif not name:
            # A metacarpal joint comes right before its knuckle.
            offsets[joint] = source.offsets[source.index(SOURCES[joint + 1])] * _METACARPAL
    # So far both knuckles and metacarpal joints are relative to the wrist; metacarpal joints turn with the hand.
    from_wrist = offsets.copy()
    for joint, above in enumerate(UPPER_BODY_PARENTS):
        if joint and not SOURCES[above]:
            offsets[joint] -= from_wrist[above]
    where = {name: joint for joint, name in enumerate(SOURCES) if name}
    ends = [(where[source.names[joint]], end) for joint, end in source.ends if source.names[joint] in where]
    return Skeleton(offsets.astype(np.float32), UPPER_BODY_JOINTS, UPPER_BODY_PARENTS, tuple(sorted(ends)))


def upper_body(motion: Motion, fps: float = 15.0) -> Motion:
    """The motion of the 47 joints, with the positions and rotations of the talker's own.

    Args:
        motion: of the talker with fingers.
        fps: frames per second of the result; frame k shows time ``k / fps``.

    Returns:
        Motion whose root is the chest in the world.

    Raises:
        InputError: the motion has no fingers.
    """
    require_fingers(motion)
    motion = resample(motion, fps)
    source = motion.skeleton
    chest = source.index("Spine3")
    turn = np.asarray(motion.rotations[:, 0], np.float64)
    place = np.asarray(motion.root, np.float64)
    for name in ("Spine1", "Spine2", "Spine3"):
        joint = source.index(name)
        place = place + turn @ np.asarray(source.offsets[joint], np.float64)
        turn = turn @ np.asarray(motion.rotations[:, joint], np.float64)
    rotations = np.tile(np.eye(3, dtype=np.float32), (motion.frames, len(UPPER_BODY_JOINTS), 1, 1))
    for joint, name in enumerate(SOURCES):
        if name and source.index(name) != chest:
            rotations[:, joint] = motion.rotations[:, source.index(name)]
    rotations[:, 0] = turn
    return Motion(rotations, place.astype(np.float32), upper_body_skeleton(source), motion.fps)


def pose_values(motion: Motion) -> Float[np.ndarray, "T values"]:
    """Each frame's local rotations as 6D (the first two columns, joint by joint): 282 values for 47 joints."""
    rotations = np.asarray(motion.rotations)
    return np.swapaxes(rotations[..., :2], -1, -2).reshape(len(rotations), -1)


def upper_body_recording(recording: Recording, fps: float = 15.0) -> Recording:
    """A generated recording in BEAT's format: the motion of :func:`upper_body`, and words and syllables by frame.

    Audio, words, speaker, emotion and annotations stay; ``annotations["frames"]`` gains ``fps`` and the ``words`` and
    ``syllables`` as lists ``[text, first, stop]``: the frames from ``first`` up to but not including ``stop``. Edges
    are moved to the nearest frame time, and nothing is shorter than one frame, so neighbours may share a frame.

    For other valid motions, draw them from the original recording and take :func:`upper_body` of each.

    Raises:
        InputError: the recording's motion has no fingers.
    """
    motion = upper_body(recording.motion, fps)
    words = [(word.text, word.start, word.end) for word in recording.words]
    syllables = [
        ("".join(syllable["phones"]), syllable["onset"], syllable["end"])
        for syllable in recording.annotations.get("speech", {}).get("syllables", ())
    ]
    frames: dict[str, Any] = {
        "fps": motion.fps,
        "words": _cut(words, motion.fps, motion.frames),
        "syllables": _cut(syllables, motion.fps, motion.frames),
    }
    return replace(recording, motion=motion, annotations={**recording.annotations, "frames": frames})


def _cut(spans: list[tuple[str, float, float]], fps: float, frames: int) -> list[list[Any]]:
    """Spans in seconds as spans of frames; what starts after the last frame is left out."""
    cut = []
    for text, start, end in spans:
        first = math.floor(start * fps + 0.5)
        if first < frames:
            cut.append([text, first, min(max(first + 1, math.floor(end * fps + 0.5)), frames)])
    return cut
