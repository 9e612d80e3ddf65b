"""What becomes of absurd clips and pins: performed after a named change, or refused by name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.generation.pins.request import Pin, check_pins, pin_of
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.training.run import Run
from experiments.pins.clips import Take, absurd
from experiments.pins.measure import SPEECH, pinned, top_speed


def outcomes(run: Run, plain: Motion, take: Take, folder: Path, limit: float) -> list[dict[str, Any]]:
    """A record of each case: what it was, what happened, what the user reads, and figures of the motion if any.

    Args:
        take: generated talk, from whose seconds 4 to 6 the clips are made.
    """
    clip = take.cut(4.0, 2.0)
    cases: dict[str, Callable[[], list[Pin]]] = {}
    for name, make in absurd(clip, folder).items():
        cases[name] = lambda make=make: [pin_of(make(), run, "clip", 4.0)]  # type: ignore[misc]
    one = lambda start, part=clip: pin_of(part, run, "clip", start)  # noqa: E731
    cases["at the very start and end"] = lambda: [one(0.0), one(SPEECH - 2.0)]
    cases["0.2 s after the start"] = lambda: [one(0.2)]
    cases["past the end of the speech"] = lambda: [one(SPEECH - 1.0)]
    cases["longer than the speech"] = lambda: [one(0.0, take.motion)]
    cases["two that overlap"] = lambda: [one(2.0), one(3.5)]
    cases["two 0.1 s apart"] = lambda: [one(2.0), pin_of(take.cut(9.0, 2.0), run, "clip", 4.1)]
    cases["two 0.5 s apart"] = lambda: [one(2.0), pin_of(take.cut(9.0, 2.0), run, "clip", 4.5)]
    return [{"case": name, **_outcome(run, plain, make, limit)} for name, make in cases.items()]


def _outcome(run: Run, plain: Motion, make: Callable[[], list[Pin]], limit: float) -> dict[str, Any]:
    try:
        pins = check_pins(make(), plain.frames, plain.fps)
        motion, rows = pinned(run, plain, pins, limit)
    except InputError as error:
        return {"outcome": "refused", "message": str(error).replace("--pin clip@", "clip@")}
    notes = "; ".join(dict.fromkeys(note for row in rows for note in row["notes"]))
    turns = rotation_angle(motion.rotations[1:], motion.rotations[:-1])
    return {
        "outcome": "adapted" if notes else "performed",
        "message": notes,
        "turn": float(turns.max()),
        "speed": top_speed(motion),
        "rough": any(row["rough"] for row in rows),
    }
