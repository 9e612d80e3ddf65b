"""The table of fine-tuning, and which claims hold."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.fine_tuning.measure import DESCRIBED, STATISTICS, distances

#: Statistics by what they describe, for the claims.
GROUPS = {
    "speed": ("speed_p50", "speed_p90", "speed_p99"),
    "reach": ("height", "height_spread", "radius"),
    "rest": ("rest",),
    "jerk": ("jerk_p50", "jerk_p90"),
    "posture": ("posture",),
}
_REFERENCES = ("the person, held out", "the person, first 80 %")


def render(run: str, records: Sequence[dict[str, Any]], samples: int, cores: int) -> str:
    """The page of a shipped run: for each take the statistics, the distances from the person, and the costs."""
    takes = list(dict.fromkeys(record["take"] for record in records))
    lines = [
        f"# Fine-tuning `{run}` on a minute of a person's motion",
        "",
        f"Made by `python -m experiments.fine_tuning{'' if run == 'demo' else f' --run {run}'}`. Trained on the first"
        f" 80 % of a take, a fifth of it for early stopping; measured on {samples} motions for the speech of the rest."
        " Means over seeds. Nothing in the table is a score: figures near the person's are good. Rates are the"
        " recordings' own (BEAT's take has 15 frames a second): between its frames there is interpolation.",
        "",
    ]
    for take in takes:
        lines += _take(take, [record for record in records if record["take"] == take])
    lines += ["## Definitions", ""]
    lines += [f"- **{name}**: {one.definition}." for name, one in (STATISTICS | DESCRIBED).items()]
    lines += [
        "- **distance**: mean over the statistics before agreement of the absolute binary logarithm of the ratio to the"
        " person's (1 is a factor of two); of rest and height the difference by 20 (per cent of time, cm), of posture"
        " by 10 cm. The range is over seeds.",
        f"- Minutes are of processor time, one process on {cores} shared cores. No FGD: the held-out end has three"
        " clips of the feature network.",
    ]
    return "\n".join(lines) + "\n"


def _take(take: str, records: list[dict[str, Any]]) -> list[str]:
    methods = list(dict.fromkeys(record["method"] for record in records))
    both = {**STATISTICS, **DESCRIBED}
    lines = [f"## {take}", "", "| | " + " | ".join(one.title for one in both.values()) + " |"]
    lines += ["|---|" + "---|" * len(both)]
    for method in methods:
        rows = [record["values"] for record in records if record["method"] == method]
        cells = [_mean([row[name] for row in rows if name in row], one.digits) for name, one in both.items()]
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    truths = {method: _values(records, method)[0] for method in _REFERENCES}
    lines += [
        "",
        "| distance from the person | held-out end | " + " | ".join(GROUPS) + " | first 80 % | steps | minutes |",
    ]
    lines += ["|---|---|" + "---|" * len(GROUPS) + "---|---|---|"]
    for method in methods[1:]:
        own = [record for record in records if record["method"] == method]
        cells = [_range([_distance(record, truths[_REFERENCES[0]]) for record in own])]
        for names in GROUPS.values():
            cells.append(_range([_distance(record, truths[_REFERENCES[0]], names) for record in own]))
        named = [name for name in STATISTICS if name != "posture"]
        known = method != _REFERENCES[1]
        cells.append(_range([_distance(record, truths[_REFERENCES[1]], named) for record in own]) if known else "")
        trained = [record for record in own if record.get("cpu_minutes")]
        cells.append(", ".join(str(record["steps"]) for record in trained))
        cells.append(_mean([record["cpu_minutes"] for record in trained], 1))
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def _values(records: list[dict[str, Any]], method: str) -> list[dict[str, float]]:
    return [record["values"] for record in records if record["method"] == method]


def _distance(record: dict[str, Any], truth: dict[str, float], names: Sequence[str] = ()) -> float:
    found = distances(record["values"], {**truth, "posture": 0.0})
    return float(np.mean([found[name] for name in names or found]))


def _mean(values: list[float], digits: int) -> str:
    return f"{np.mean(values):.{digits}f}" if values else ""


def _range(values: list[float]) -> str:
    if not values:
        return ""
    spread = f" ({min(values):.2f} to {max(values):.2f})" if len(values) > 1 else ""
    return f"{np.mean(values):.2f}{spread}"
