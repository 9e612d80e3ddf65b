"""Scores over seeds, and verdicts on a paper's claims."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.tables.records import current

#: A row stands still if its wrists' mean speed, or its diversity, is below this share of the truth's.
STILL = 0.25
#: Scores that do not depend on how samples move.
_OF_DENSITY = ("bits_per_dim",)


def over_seeds(table: str, variant: str, metric: str) -> tuple[float, float, int] | None:
    """Mean over seeds of a score, half the width of its 95 % interval (Student's t), and the number of seeds."""
    return interval([r["scores"][metric]["mean"] for r in current(table) if _has(r, variant, metric)])


def best_over_seeds(table: str, variant: str, metric: str) -> float | None:
    """Mean over seeds of the best sample's score."""
    values = [r["scores"][metric]["best"] for r in current(table) if _has(r, variant, metric)]
    values = [value for value in values if value is not None]
    return float(np.mean(values)) if values else None


def _has(record: Mapping[str, Any], variant: str, metric: str) -> bool:
    return record["variant"] == variant and record["scores"].get(metric, {}).get("mean") is not None


def interval(values: Sequence[float]) -> tuple[float, float, int] | None:
    """Mean, half the width of its 95 % interval (Student's t; NaN for one value), and the number of values."""
    from scipy.stats import t

    if not values:
        return None
    count = len(values)
    half = float("nan")
    if count > 1:
        half = float(t.ppf(0.975, count - 1) * np.std(values, ddof=1) / np.sqrt(count))
    return float(np.mean(values)), half, count


def difference(table: str, first: str, second: str, metric: str) -> tuple[float, float, int] | None:
    """Interval of ``first - second``, paired by seed."""
    by_seed: dict[int, dict[str, float]] = {}
    for record in current(table):
        for name in (first, second):
            if _has(record, name, metric):
                by_seed.setdefault(record["seed"], {})[name] = record["scores"][metric]["mean"]
    return interval([pair[first] - pair[second] for pair in by_seed.values() if len(pair) == 2])


@dataclass(frozen=True)
class Claim:
    """A claim of the paper about a table, as an inequality between two rows."""

    text: str
    first: str
    second: str
    metric: str
    sign: int
    """1 if the claim is that ``first`` scores more than ``second``, -1 for less."""
    baseline: str = ""
    """The row that the claim compares the other one with; ``second`` if not given."""


def stands_still(table: str, variant: str) -> bool:
    """Whether a row hardly moves: by speed of the wrists or diversity, means over seeds, compared with the truth's."""
    for metric in ("wrist_speed", "diversity"):
        found, truth = over_seeds(table, variant, metric), over_seeds(table, "truth", metric)
        if found is not None and truth is not None and found[0] < STILL * truth[0]:
            return True
    return False


def judge(table: str, claim: Claim) -> str:
    """``holds``, ``does not hold`` or ``undecided``, with the interval of the difference over seeds.

    Nothing is decided by a comparison with a baseline that stands still, and a row that stands still supports no claim;
    it may contradict one.
    """
    found = difference(table, claim.first, claim.second, claim.metric)
    if found is None or found[2] < 3:
        return "undecided: fewer than 3 seeds"
    mean, half, count = found
    verdict = "undecided"
    if abs(mean) > half:
        verdict = "holds" if mean * claim.sign > 0 else "does not hold"
    if verdict != "undecided" and claim.metric not in _OF_DENSITY:
        baseline = claim.baseline or claim.second
        other = claim.first if baseline == claim.second else claim.second
        if stands_still(table, baseline):
            verdict = f"not decided ({baseline} stands still)"
        elif verdict == "holds" and stands_still(table, other):
            verdict = f"not decided ({other} stands still)"
    return f"{verdict}: {mean:+.3g} +- {half:.2g} over {count} seeds"
