"""The same statistics on real speech, beside the people's own motion."""

import hashlib
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.intervals import mean_interval
from a2g_jax.metrics.liveliness import body_of, distance_between
from experiments.motion.measure import kept
from experiments.motion.rows import Row
from experiments.motion.speeches import Speech, code_digest, digest, source_digest
from experiments.motion.statistics import as_json, statistics

#: Row of the person.
PERSON = "the person"
#: Standard errors of the null by which agreement has to exceed its mean.
ABOVE = 2.0


def on_take(speech: Speech, motions: Sequence[Motion]) -> dict[str, Any]:
    """Statistics of one motion or more for one take; intervals are over the motions."""
    values: dict[str, Any] = statistics([speech] * len(motions), [[motion] for motion in motions])
    if len(motions) > 1:
        joints, wrists = distance_between([body_of(motion) for motion in motions])
        values["between_joints"] = as_json(mean_interval(np.array([joints])))
        values["between_wrists"] = as_json(mean_interval(np.array([wrists])))
    return {**values, "above_null": above_null(speech, motions)}


def _run_on_take(row: Row, speech: Speech, number: int) -> dict[str, Any]:
    assert row.draw is not None
    return on_take(speech, row.draw(number))


def above_null(speech: Speech, motions: Sequence[Motion]) -> dict[str, Any]:
    """Whether agreement exceeds that of the shifted motions: the mean over motions against its standard error."""
    scores = [speech.agreement(motion) for motion in motions]
    excess = float(np.mean([one.value - one.null_mean for one in scores]))
    error = float(np.mean([one.null_std for one in scores])) / np.sqrt(len(scores))
    z = excess / max(error, 1e-9)
    return {
        "z": float(z),
        "above": bool(z > ABOVE),
        "samples_above": int(sum(one.value > one.null_mean for one in scores)),
        "samples": len(scores),
    }


def real_takes(
    speeches: Sequence[Speech], rows: Sequence[Row], cache: Path, report: Callable[[], None]
) -> dict[str, dict[str, Any]]:
    """For each take: its seconds and the statistics of every row, kept on disk as soon as they are measured.

    Args:
        rows: runs for these speeches.
        cache: folder of the figures.
    """
    code = digest(
        code_digest(
            [
                Path(__file__).parent / name
                for name in ("real.py", "statistics.py", "resampling.py", "rows.py", "speeches.py", "__main__.py")
            ]
        ),
        source_digest("metrics", "geometry"),
    )
    takes: dict[str, dict[str, Any]] = {}
    for number, speech in enumerate(speeches):
        audio = hashlib.sha256(np.ascontiguousarray(speech.audio).tobytes()).hexdigest()
        found: dict[str, Any] = {}
        if speech.truth is not None:
            place = cache / f"{digest(code, audio, PERSON)}.json"
            found[PERSON] = kept(place, partial(on_take, speech, [speech.truth]))
        for row in rows:
            place = cache / f"{digest(code, audio, row.identity)}.json"
            found[row.name] = kept(place, partial(_run_on_take, row, speech, number))
            report()
        takes[speech.name] = {"seconds": speech.seconds, "rows": found}
    return takes
