"""Report on pinned clips: how closely they are followed, and how smooth their seams are."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.generation.audio2gestures.pins import Pin
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.metrics.physical import jerk

#: Seconds on either side of a seam in which jerk is measured, unless the blend is wider.
SEAM = 0.25
#: A pin counts as followed if its error is below this share of the unpinned motion's.
FOLLOWED = 0.5
#: Most frames of a corpus that its percentile is computed from.
_MOST = 200_000


def local_places(motion: Motion) -> Float[np.ndarray, "T J 3"]:
    """Joint positions with the root at the origin, metres."""
    places = motion.positions()
    local: Float[np.ndarray, "T J 3"] = places - places[:, :1]
    return local


def wrist_jerk(places: Float[np.ndarray, "T J 3"], skeleton: Skeleton, fps: float) -> Float[np.ndarray, " t"]:
    """Jerk of the faster wrist, m/s3, three values fewer than frames; of the fastest joint if no wrists are found."""
    return np.asarray(jerk(places[:, _wrists(skeleton)], fps)).max(axis=1)


def _wrists(skeleton: Skeleton) -> list[int]:
    joints = find_body_joints(skeleton)
    if joints is None:
        return list(range(skeleton.joints))
    return [joints[BODY_JOINTS.index(f"{side}_Wrist")] for side in "LR"]


def corpus_jerk(corpus: Corpus, percentile: float = 99.0) -> float:
    """A percentile of wrist jerk in a corpus's training motion, m/s3.

    Raises:
        InputError: its poses are not rotations.
    """
    corpus.require_rotations()
    values, frames = [], 0
    for segment in corpus.segments("train"):
        places = corpus.space.positions(np.asarray(corpus.pose[segment.start : segment.stop], np.float32))
        values.append(wrist_jerk(places, corpus.skeleton, corpus.fps))
        frames += segment.frames
        if frames > _MOST:
            break
    return float(np.percentile(np.concatenate(values), percentile))


def report_pins(
    pins: Sequence[Pin], pinned: Motion, plain: Motion, limit: float, source: str, blend: float = 0.75
) -> list[dict[str, Any]]:
    """A JSON-able record of each pin: its place, the distance of both motions from the clip, and the jerk of its seams.

    Args:
        pinned: the motion with the pins; ``plain``: the same sample without.
        limit: jerk that seams should stay below, m/s3.
        source: of the limit, for the report.
        blend: seconds of blending on either side; jerk is measured that far from a seam, and at least a quarter second.

    Returns:
        ``file``, ``start``, ``end`` (s), ``turned`` (degrees), ``error_cm``, ``unpinned_error_cm`` (mean distance of
        joints, root at the origin), the same of the wrists, ``followed`` (of all joints), ``seam_jerk`` (m/s3, the
        largest within reach of either end; 0 for a clip that fills the whole motion and has no seam), ``jerk_limit``,
        ``jerk_limit_source``, ``smooth``.
    """
    fps, skeleton = pinned.fps, pinned.skeleton
    ours, without = local_places(pinned), local_places(plain)
    jerks = wrist_jerk(ours, skeleton, fps)
    wrists, width = _wrists(skeleton), round(max(SEAM, blend) * fps)
    rows = []
    for pin in pins:
        distances = [
            100.0 * np.linalg.norm(places[pin.first : pin.stop] - local_places(pin.motion), axis=-1)
            for places in (ours, without)
        ]
        error, before = (float(distance.mean()) for distance in distances)
        wrist_error, wrist_before = (float(distance[:, wrists].mean()) for distance in distances)
        # Seams lie before the first and after the last frame of a pin, none at the ends of the motion. Value k is of
        # frames k to k + 3.
        seams = [at for at in (pin.first, pin.stop) if 0 < at < pinned.frames]
        parts = [jerks[max(0, at - width - 2) : at + width] for at in seams]
        seam = max((float(part.max()) for part in parts if len(part)), default=0.0)
        rows.append(
            {
                "file": pin.name,
                "start": pin.first / fps,
                "end": pin.stop / fps,
                "turned": pin.turned,
                "error_cm": error,
                "unpinned_error_cm": before,
                "wrist_error_cm": wrist_error,
                "unpinned_wrist_error_cm": wrist_before,
                "followed": error < FOLLOWED * before,
                "seam_jerk": seam,
                "jerk_limit": limit,
                "jerk_limit_source": source,
                "smooth": seam < limit,
            }
        )
    return rows


def describe(row: dict[str, Any]) -> str:
    """A line on one pin for the terminal."""
    followed = "" if row["followed"] else ", NOT FOLLOWED"
    rough = "" if row["smooth"] else ", ROUGH SEAM"
    turned = f", turned by {row['turned']:.0f} degrees" if abs(row["turned"]) >= 1.0 else ""
    return (
        f"{row['file']} at {row['start']:.2f} to {row['end']:.2f} s{turned}: {row['error_cm']:.1f} cm from the clip"
        f" (unpinned {row['unpinned_error_cm']:.1f} cm), wrists {row['wrist_error_cm']:.1f} cm (unpinned"
        f" {row['unpinned_wrist_error_cm']:.1f} cm){followed}; jerk at the seams {row['seam_jerk']:.0f} m/s3 (limit"
        f" {row['jerk_limit']:.0f}, {row['jerk_limit_source']}){rough}"
    )
