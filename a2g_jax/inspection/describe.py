"""Facts of motions, speech recordings and transcripts."""

from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.match_table import missing_parts
from a2g_jax.geometry.retarget.poses import joint_places, rotation_angle, world_rotations
from a2g_jax.geometry.retarget.rig import Rig, find_rig
from a2g_jax.inspection.audio_checks import Speech, peak_db
from a2g_jax.inspection.finding import Finding
from a2g_jax.inspection.motion_checks import rotation_steps
from a2g_jax.io.words import Word

_TRACKED = ("L_Wrist", "R_Wrist", "Head")


def try_rig(motion: Motion, path: str) -> tuple[Rig | None, list[Finding]]:
    """The body of a motion, or a note that none is found."""
    try:
        rig = find_rig(motion, name=path)
    except InputError as error:
        text = str(error).removeprefix(f"{path}: ")
        message = text if text.startswith("no human body") else f"no human body is found in the skeleton ({text})"
        fix = "Facts that need a body (speeds of the hands, the offset) are left out; retargeting is not possible."
        return None, [Finding("info", "no-body", " ".join(message.split()), fix)]
    fix = "Name these joints in the usual way; retargeting does not move what it does not find."
    return rig, [Finding("warning", "unmapped", f"{text}.", fix) for text in missing_parts(rig)]


def body_places(motion: Motion, rig: Rig) -> Float[np.ndarray, "T J 3"]:
    """Positions of the joints in metres: left, up, forward of the rig's world."""
    world = world_rotations(np.asarray(motion.rotations, np.float32), motion.skeleton.parents)
    positions = joint_places(world, np.asarray(motion.skeleton.offsets), motion.skeleton.parents)
    return (positions + np.asarray(motion.root)[:, None]) * rig.unit_factor @ rig.world


def motion_facts(
    motion: Motion, rig: Rig | None, positions: Float[np.ndarray, "T J 3"] | None = None
) -> dict[str, Any]:
    """Length, frame rate, rotation ranges of joints, speed and reach of hands and head.

    Args:
        positions: of the joints (:func:`body_places`), if computed before.
    """
    facts: dict[str, Any] = {
        "frames": motion.frames,
        "fps": round(motion.fps, 6),
        "seconds": round(motion.seconds, 3),
        "root (m)": _box(np.asarray(motion.root, np.float64)),
    }
    if motion.frames > 1:
        steps = rotation_steps(motion) * motion.fps
        facts["rotation speed (degrees/s)"] = _percentiles(steps.max(axis=1))
        rotations = np.asarray(motion.rotations)
        ranges = rotation_angle(rotations, np.broadcast_to(rotations[:1], rotations.shape)).max(axis=0)
        widest = np.argsort(-ranges)[:5]
        facts["largest rotation from frame 0 (degrees)"] = {
            motion.skeleton.names[j]: round(float(ranges[j]), 1) for j in widest
        }
    if rig is None or motion.frames < 2:
        return facts
    positions = body_places(motion, rig) if positions is None else positions
    chest = positions[:, rig.roles["Chest"]]
    for part in _TRACKED:
        if part in rig.roles:
            path = positions[:, rig.roles[part]]
            speed = np.linalg.norm(np.diff(path, axis=0), axis=1) * motion.fps
            facts[f"{part} speed (m/s)"] = _percentiles(speed)
            facts[f"{part} from the chest (m; left, up, forward)"] = _box(path - chest)
    return facts


def audio_facts(speech: Speech) -> dict[str, Any]:
    """Length and level."""
    return {
        "seconds": round(len(speech.audio) / speech.sample_rate, 3),
        "active level (dBFS)": round(speech.level_with_offset, 1),
        "peak (dBFS)": round(peak_db(speech.audio), 1),
        "clipped share": round(speech.clipped[0], 6),
        "mean": round(float(np.mean(speech.audio, dtype=np.float64)), 6),
    }


def word_facts(words: tuple[Word, ...]) -> dict[str, Any]:
    """Number, rate and times of words."""
    if not words:
        return {"words": 0}
    lengths = np.array([word.end - word.start for word in words])
    last = max(word.end for word in words)
    return {
        "words": len(words),
        "different": len({word.text.lower() for word in words}),
        "first starts (s)": round(words[0].start, 3),
        "last ends (s)": round(last, 3),
        "words a minute": round(60 * len(words) / max(last - words[0].start, 1e-3), 1),
        "length of a word (s)": _percentiles(lengths),
    }


def _percentiles(values: Float[np.ndarray, " N"]) -> dict[str, float]:
    return {f"p{share}": round(float(np.percentile(values, share)), 3) for share in (50, 95, 99)} | {
        "max": round(float(values.max()), 3)
    }


def _box(points: Float[np.ndarray, "T 3"]) -> list[list[float]]:
    # Adding zero turns -0 into 0.
    low, high = np.round(points.min(axis=0), 3) + 0.0, np.round(points.max(axis=0), 3) + 0.0
    return [[float(a), float(b)] for a, b in zip(low, high, strict=True)]
