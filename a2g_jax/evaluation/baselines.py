"""Baselines: other right motions for the audio, noise, and motions that do not depend on the audio.

Each is poses for one test stretch, in the representation of the corpus and of the length of the stretch.
"""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.generated import check_synthesizer
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.pose_track import represent
from a2g_jax.geometry.rotation import matrix_from_axis_angle
from a2g_jax.talker.recordings import resample_motion, talk
from a2g_jax.talker.views.catalogue import find_view

Pose = Float[np.ndarray, "T R D"]

#: Length of the audio windows of :func:`nearest_neighbour`, seconds.
NEIGHBOUR_SECONDS = 4.0
#: Windows compared at once: bounds memory at about 50 MB.
_CHUNK = 1500


def mean_pose(corpus: Corpus, segment: Segment) -> Pose:
    """The mean pose of the training split in every frame."""
    mean = jnp.asarray(corpus.statistics["pose"].mean)
    return np.tile(np.asarray(corpus.space.valid(mean))[None], (segment.frames, 1, 1)).astype(np.float32)


def first_pose(pose: Pose) -> Pose:
    """The first recorded pose of a stretch in every frame."""
    return np.broadcast_to(pose[:1], pose.shape)


def other_clip(corpus: Corpus, segments: list[Segment], number: int) -> Pose:
    """The motion of the next test stretch, repeated where it is shorter; of a single one, its second half first.

    Recorded motion, but of other audio.
    """
    segment = segments[number]
    if len(segments) == 1:
        pose = np.asarray(corpus.pose[segment.start : segment.stop])
        return np.roll(pose, len(pose) // 2, axis=0)
    other = segments[(number + 1) % len(segments)]
    rows = other.start + np.arange(segment.frames) % other.frames
    return np.asarray(corpus.pose[rows])


def with_noise(space: PoseSpace, pose: Pose, degrees: float, rng: np.random.Generator) -> Pose:
    """The truth with every joint turned, independently in each frame, about a random axis (Audio2Gestures, Table 4).

    Args:
        space: of the pose; it has rotations.
        degrees: standard deviation of each component of the turn.
    """
    turns = matrix_from_axis_angle(jnp.asarray(rng.normal(0.0, np.deg2rad(degrees), (*pose.shape[:2], 3)), jnp.float32))
    rotations = rotations_from_rows(np.asarray(pose, np.float32), space.kind)
    return space.write(rotations @ np.asarray(turns))


def nearest_neighbour(corpus: Corpus, segment: Segment) -> Pose:
    """The training motion whose audio is most similar, in windows of four seconds.

    Euclidean distance of normalised log-mel rows; training windows start every half second.

    Raises:
        InputError: no training stretch is as long as a window.
    """
    window = min(segment.frames, round(NEIGHBOUR_SECONDS * corpus.fps))
    step = max(1, round(0.5 * corpus.fps))
    starts = np.array(
        [
            row
            for one in corpus.segments("train")
            for row in range(one.start, one.stop - window + 1, step)
            # A stretch of the training split is not its own neighbour.
            if row >= segment.stop or row + window <= segment.start
        ],
        np.int64,
    )
    if len(starts) == 0:
        raise InputError(
            f"{corpus.path}: has no other training stretch of {window} frames for neighbours; prepare more."
        )
    # The last window ends with the clip and overlaps the one before.
    firsts = [*range(0, segment.frames - window + 1, window)]
    if firsts[-1] + window < segment.frames:
        firsts.append(segment.frames - window)
    wanted = _windows(corpus, segment.start + np.array(firsts), window)
    best, least = np.zeros(len(firsts), np.int64), np.full(len(firsts), np.inf)
    for chunk in range(0, len(starts), _CHUNK):
        chunk_starts = starts[chunk : chunk + _CHUNK]
        candidates = _windows(corpus, chunk_starts, window)
        # |a - b|^2 without |b|^2, which is constant.
        distance = np.sum(np.square(candidates), axis=1)[:, None] - 2.0 * candidates @ wanted.T
        nearest = np.argmin(distance, axis=0)
        values = distance[nearest, np.arange(len(firsts))]
        best = np.where(values < least, chunk_starts[nearest], best)
        least = np.minimum(values, least)
    pose = np.empty((segment.frames, *corpus.pose.shape[1:]), np.float32)
    for first, start in zip(firsts, best, strict=True):
        pose[first : first + window] = corpus.pose[start : start + window]
    return pose


def _windows(corpus: Corpus, starts: Int[np.ndarray, " n"], frames: int) -> Float[np.ndarray, "n values"]:
    """Normalised audio rows of the windows, flattened."""
    rows = np.asarray(corpus.audio)[starts[:, None] + np.arange(frames)[None]]
    return np.asarray(corpus.statistics["audio"].normalise(rows), np.float32).reshape(len(starts), -1)


def right_motions(corpus: Corpus, segment: Segment, samples: int, seed: int) -> list[Pose] | None:
    """Other right motions for the same audio, drawn from the talker; None for real recordings, and for generated ones
    with capture noise.

    Raises:
        InputError: the corpus was generated by another version of the talker.
    """
    role = _role(corpus, segment)
    if role is None:
        return None
    options: dict[str, Any] = corpus.recipe
    check_synthesizer(corpus.recipe, corpus.path)
    view = find_view(options.get("view", "body"))
    fingers = bool(options["fingers"]) or view.fingers
    recording = talk(**role, fps=corpus.fps, sample_rate=corpus.mel.sample_rate, fingers=fingers)
    entry = corpus.recordings[segment.recording]
    first = segment.start - entry.first
    key = jax.random.fold_in(jax.random.key(seed), segment.recording)
    poses = []
    for number in range(samples):
        motion, _ = resample_motion(recording, jax.random.fold_in(key, number))
        converted = view.convert(replace(recording, motion=motion), corpus.fps)
        pose, _ = represent(converted.motion, corpus.space.kind, entry.name)
        poses.append(pose[first : first + segment.frames])
    return poses


def _role(corpus: Corpus, segment: Segment) -> dict[str, Any] | None:
    """Arguments of a generated recording; None for real ones and for those with capture noise."""
    recipe = corpus.recipe
    if recipe.get("reader") != "talker" or recipe.get("jitter", 0.0) != 0.0:
        return None
    roles = [*recipe.get("roles", ()), *corpus.later.get("stored", ())]
    name = corpus.recordings[segment.recording].name
    return next((dict(role) for role in roles if role["name"] == name), None)
