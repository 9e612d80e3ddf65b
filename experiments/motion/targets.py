"""The targets of a default, and the rule that picks it."""

from collections.abc import Mapping
from typing import Any, NamedTuple

TRUTH, RIGHT = "truth", "another right motion"

#: Rows by name; statistics of a row by key, each with its ``value``.
Rows = Mapping[str, Mapping[str, Any]]


class Target(NamedTuple):
    """A range for a statistic relative to that of a row, or absolute without one."""

    low: float
    high: float
    relative_to: str | None = TRUTH

    def describe(self) -> str:
        """The range in words."""
        times = {TRUTH: "x truth", RIGHT: "x right motion", None: ""}[self.relative_to]
        if self.low <= 0.0:
            return f"<= {self.high:g} {times}".strip()
        return f">= {self.low:g} {times}" if self.high == float("inf") else f"{self.low:g}-{self.high:g} {times}"


TARGETS: dict[str, Target] = {
    "fgd": Target(0.0, 3.0, RIGHT),
    "speed_p50": Target(0.75, 1.25),
    "speed_p90": Target(0.75, 1.25),
    "speed_p99": Target(0.75, 1.25),
    "jerk_p50": Target(0.5, 2.0),
    "jerk_p90": Target(0.7, 1.3),
    "rest": Target(0.5, 2.0),
    "rest_in_pauses": Target(0.5, 2.0),
    "between_joints": Target(0.8, float("inf"), RIGHT),
    "between_wrists": Target(0.8, float("inf"), RIGHT),
    "head_yaw": Target(0.65, 1.35),
    "hip_yaw": Target(0.65, 1.35),
    "sway": Target(0.65, 1.35),
    "slide": Target(0.0, 5.0, None),
    "agreement_excess": Target(0.8, float("inf")),
}
#: The audit's verdict on a run that follows its audio; a target as well.
LISTENS = ["listens"]
#: Without these a motion is either not like the data or not about the speech, whatever else it is.
MUST_HAVES = ("fgd", "agreement_excess", "listening")


def relative(key: str, row: Mapping[str, Any], rows: Rows) -> float | None:
    """The statistic in the unit of its target: relative to the reference row, or as it is; None if not measured."""
    value, target = row.get(key, {}).get("value"), TARGETS[key]
    if value is None or target.relative_to is None:
        return value
    reference = rows.get(target.relative_to, {}).get(key, {}).get("value")
    return None if not reference else value / reference


def check(row: Mapping[str, Any], rows: Rows) -> dict[str, bool]:
    """Whether each target is met, for the statistics that the row and its reference have.

    Args:
        row: statistics of one row.
        rows: all rows; truth and right motions among them.
    """
    met = {}
    for key, target in TARGETS.items():
        value = relative(key, row, rows)
        if value is not None:
            met[key] = target.low <= value <= target.high
    if "verdicts" in row.get("listening", {}):
        met["listening"] = row["listening"]["verdicts"] == LISTENS
    return met


def choose_default(candidates: Rows, rows: Rows) -> str:
    """The name of the run that `a2g demo` should use.

    The run with the most of the must-haves (FGD, agreement, audit); among these the one with the most targets; among
    these the one with the lowest FGD, then the first by name.

    Args:
        candidates: rows of runs.
        rows: all rows; truth and right motions among them.

    Raises:
        ValueError: no candidates.
    """
    if not candidates:
        raise ValueError("expected one or more runs")

    def rank(name: str) -> tuple[int, int, float, str]:
        met = check(candidates[name], rows)
        must = sum(met.get(key, False) for key in MUST_HAVES)
        distance = candidates[name].get("fgd", {}).get("value")
        return -must, -sum(met.values()), float("inf") if distance is None else distance, name

    return min(candidates, key=rank)
