"""Report on pinned clips: how closely they are followed, and how smooth the transitions around them are."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.generation.pins.request import Pin
from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.hands import hand_jerk, hand_joints, hand_speeds, local_places

#: Seconds around a clip's end in which jerk is measured, unless the transition is longer.
SEAM = 0.25
#: A clip is followed if its wrists are this near on average and in every frame, cm: less than the width of a hand.
FOLLOWED_MEAN, FOLLOWED_WORST = 5.0, 10.0
#: A transition is rough if its jerk exceeds this many times the limit, or its hands this many times the top speed.
ROUGH_JERK, ROUGH_SPEED = 1.5, 1.5
#: Speed of hands that is never rough, m/s: that of ordinary gestures.
ORDINARY_SPEED = 1.5
#: Most frames of a corpus that its percentile is computed from.
_MOST = 200_000


class Ends(NamedTuple):
    """Frames of the transitions before and after a clip."""

    before: int
    after: int
    inside: int = 0
    """Frames inside the clip, at either end, that a transition changes too."""


def corpus_jerk(corpus: Corpus, percentile: float = 99.0) -> float:
    """A percentile of wrist jerk in a corpus's training motion, m/s3.

    Raises:
        InputError: its poses are not rotations.
    """
    corpus.require_rotations()
    values, frames = [], 0
    for segment in corpus.segments("train"):
        places = corpus.space.positions(np.asarray(corpus.pose[segment.start : segment.stop], np.float32))
        values.append(hand_jerk(places, corpus.skeleton, corpus.fps))
        frames += segment.frames
        if frames > _MOST:
            break
    return float(np.percentile(np.concatenate(values), percentile))


def report_pins(
    pins: Sequence[Pin],
    pinned: Motion,
    plain: Motion,
    limit: float,
    source: str,
    ends: Ends | Sequence[Ends],
) -> list[dict[str, Any]]:
    """A JSON-able record of each pin: its place, the distance of both motions from the clip, and its transitions.

    Args:
        pinned: the motion with the pins; ``plain``: the same sample without.
        limit: jerk that transitions should stay below, m/s3.
        source: of the limit, for the report.
        ends: lengths of the transitions of each clip, or of all; jerk and speed are measured over them, but over a
            quarter of a second at least.

    Returns:
        ``file``, ``start``, ``end`` (s), ``turned`` (degrees), ``notes``; ``error_cm``, ``unpinned_error_cm`` (mean
        distance of joints, root at the origin), the same of the wrists and ``wrist_worst_cm``, ``followed`` (wrists
        within 5 cm on average and 10 cm always); ``before``, ``after`` (s, lengths of the transitions), ``seam_jerk``
        (m/s3, the largest in the transitions; 0 for a clip that fills the whole motion), ``jerk_limit``,
        ``jerk_limit_source``, ``smooth`` (below the limit), ``top_speed`` of the clip's hands and ``speed`` of those in
        clip and transitions (m/s), ``unpinned_seam_jerk`` and ``unpinned_speed`` of the same sample without the pin,
        ``rough`` (jerk above 1.5 times the largest of the limit, of the clip's and of the unpinned sample's there, or
        speed above 1.5 times the largest of the clip's, of the unpinned sample's there, and of 1.5 m/s).
    """
    fps, skeleton = pinned.fps, pinned.skeleton
    ours, without = local_places(pinned), local_places(plain)
    jerks, speeds = (function(ours, skeleton, fps) for function in (hand_jerk, hand_speeds))
    plain_jerks, plain_speeds = (function(without, skeleton, fps) for function in (hand_jerk, hand_speeds))
    wrists, least = hand_joints(skeleton), round(SEAM * fps)
    rows = []
    for number, pin in enumerate(pins):
        end = ends if isinstance(ends, Ends) else ends[number]
        target = local_places(pin.motion)
        distance, before = (
            100.0 * np.linalg.norm(places[pin.first : pin.stop] - target, axis=-1) for places in (ours, without)
        )
        # Seams lie before the first and after the last frame of a pin, none at the ends of the motion. Value k of the
        # jerk is of frames k to k + 3.
        parts = []
        inside = max(end.inside, least)
        if pin.first > 0:
            parts.append((pin.first - max(end.before, least), pin.first + inside))
        if pin.stop < pinned.frames:
            parts.append((pin.stop - inside, pin.stop + max(end.after, least)))
        seam, own = (
            max((float(values[max(0, low - 2) : high].max(initial=0.0)) for low, high in parts), default=0.0)
            for values in (jerks, plain_jerks)
        )
        clip_jerk = float(hand_jerk(target, skeleton, fps).max(initial=0.0))
        top = float(hand_speeds(target, skeleton, fps).max(initial=0.0))
        around = slice(max(0, pin.first - end.before - 1), pin.stop + end.after)
        speed, own_speed = (float(values[around].max(initial=0.0)) for values in (speeds, plain_speeds))
        rows.append(
            {
                "file": pin.name,
                "start": pin.first / fps,
                "end": pin.stop / fps,
                "turned": pin.turned,
                "notes": list(pin.notes),
                "error_cm": float(distance.mean()),
                "unpinned_error_cm": float(before.mean()),
                "wrist_error_cm": float(distance[:, wrists].mean()),
                "wrist_worst_cm": float(distance[:, wrists].max()),
                "unpinned_wrist_error_cm": float(before[:, wrists].mean()),
                "followed": bool(
                    distance[:, wrists].mean() <= FOLLOWED_MEAN and distance[:, wrists].max() <= FOLLOWED_WORST
                ),
                "before": end.before / fps,
                "after": end.after / fps,
                "seam_jerk": seam,
                "jerk_limit": limit,
                "jerk_limit_source": source,
                "smooth": seam < limit,
                "top_speed": top,
                "speed": speed,
                "unpinned_seam_jerk": own,
                "unpinned_speed": own_speed,
                "rough": seam > ROUGH_JERK * max(limit, clip_jerk, own)
                or speed > ROUGH_SPEED * max(top, own_speed, ORDINARY_SPEED),
            }
        )
    return rows


def describe(row: dict[str, Any]) -> str:
    """A line on one pin for the terminal."""
    followed = "" if row["followed"] else ", NOT FOLLOWED"
    rough = ", ROUGH" if row["rough"] else ""
    turned = f", turned by {row['turned']:.0f} degrees" if abs(row["turned"]) >= 1.0 else ""
    notes = "".join(f"; {note}" for note in row["notes"])
    return (
        f"{row['file']} at {row['start']:.2f} to {row['end']:.2f} s{turned}: wrists {row['wrist_error_cm']:.1f} cm from"
        f" the clip, {row['wrist_worst_cm']:.1f} at most (unpinned {row['unpinned_wrist_error_cm']:.1f} cm){followed};"
        f" transitions of {row['before']:.2f} and {row['after']:.2f} s, jerk {row['seam_jerk']:.0f} m/s3 (limit"
        f" {row['jerk_limit']:.0f}, {row['jerk_limit_source']}), hands up to {row['speed']:.1f} m/s (clip"
        f" {row['top_speed']:.1f}){rough}{notes}"
    )
