"""How closely pins are followed, and how smooth their seams are."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.generation.timeline import Pin
from a2g_jax.geometry.body import find_body
from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.rotation import matrix_from_6d
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.metrics.physical import jerk

#: Seconds on either side of a seam in which its jerk is looked at.
SEAM = 0.25
#: A pin counts as followed below this share of what the unpinned motion is away from the clip.
FOLLOWED = 0.5
#: Most frames of a corpus that are looked at for its percentile.
_MOST = 200_000


def local_places(motion: Motion) -> Float[np.ndarray, "T J 3"]:
    """Joint positions with the root at the origin, metres."""
    places = motion.positions()
    local: Float[np.ndarray, "T J 3"] = places - places[:, :1]
    return local


def wrist_jerk(places: Float[np.ndarray, "T J 3"], skeleton: Skeleton, fps: float) -> Float[np.ndarray, " t"]:
    """The larger of both wrists' jerks, m/s3, three frames fewer; of all joints where there are no wrists."""
    body = find_body(skeleton)
    joints = [body[BODY_JOINTS.index(f"{side}_Wrist")] for side in "LR"] if body is not None else slice(None)
    return np.asarray(jerk(places[:, joints], fps)).max(axis=1)


def corpus_jerk(corpus: Corpus, percentile: float = 99.0) -> float:
    """A percentile of wrist jerk in a corpus's training motion, m/s3.

    Raises:
        InputError: its poses are not rotations.
    """
    corpus.require_pose("6d")
    values, seen = [], 0
    for segment in corpus.segments("train"):
        pose = np.asarray(corpus.pose[segment.start : segment.stop], np.float32)
        offsets = np.asarray(corpus.skeleton.offsets, np.float32)
        places = np.asarray(joint_positions(matrix_from_6d(pose), offsets, corpus.skeleton.parents))
        values.append(wrist_jerk(places, corpus.skeleton, corpus.fps))
        seen += segment.frames
        if seen > _MOST:
            break
    return float(np.percentile(np.concatenate(values), percentile))


def report_pins(pins: Sequence[Pin], pinned: Motion, plain: Motion, limit: float, source: str) -> list[dict[str, Any]]:
    """For each pin, JSON-able: its place, how far the pinned and the unpinned motion are from it, and its seams' jerk.

    Args:
        pinned: the motion with the pins; ``plain``: the same sample without.
        limit: jerk that seams should stay below, m/s3.
        source: whose it is.

    Returns:
        ``file``, ``start``, ``end`` (s), ``error_cm``, ``unpinned_error_cm`` (mean distance of joints, root at the
        origin), ``followed``, ``seam_jerk`` (m/s3, the largest within a quarter second of either end),
        ``jerk_limit``, ``jerk_limit_source``, ``smooth``.
    """
    fps, skeleton = pinned.fps, pinned.skeleton
    ours, without = local_places(pinned), local_places(plain)
    jerks = wrist_jerk(ours, skeleton, fps)
    width = round(SEAM * fps)
    rows = []
    for pin in pins:
        target = local_places(pin.motion)
        error, before = (
            100.0 * float(np.linalg.norm(places[pin.first : pin.stop] - target, axis=-1).mean())
            for places in (ours, without)
        )
        # A seam is where the blend is: before the first and after the last frame. Value k is of frames k to k + 3.
        parts = [jerks[max(0, at - width - 2) : at + width] for at in (pin.first, pin.stop)]
        seam = float(np.concatenate(parts).max()) if sum(map(len, parts)) else 0.0
        rows.append(
            {
                "file": pin.name,
                "start": pin.first / fps,
                "end": pin.stop / fps,
                "error_cm": error,
                "unpinned_error_cm": before,
                "followed": error < FOLLOWED * before,
                "seam_jerk": seam,
                "jerk_limit": limit,
                "jerk_limit_source": source,
                "smooth": seam < limit,
            }
        )
    return rows


def describe(row: dict[str, Any]) -> str:
    """A line about one pin for the terminal."""
    followed = "" if row["followed"] else ", NOT FOLLOWED"
    rough = "" if row["smooth"] else ", ROUGH SEAM"
    return (
        f"{row['file']} at {row['start']:.2f} to {row['end']:.2f} s: {row['error_cm']:.1f} cm from the clip (unpinned"
        f" {row['unpinned_error_cm']:.1f} cm){followed}; jerk at the seams {row['seam_jerk']:.0f} m/s3 (limit"
        f" {row['jerk_limit']:.0f}, {row['jerk_limit_source']}){rough}"
    )
