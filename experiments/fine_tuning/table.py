"""The tables of fine-tuning: statistics, distances from the person, and differences between methods."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.stats import t as student

from experiments.fine_tuning.measure import DESCRIBED, STATISTICS, distances
from experiments.fine_tuning.methods import METHODS
from experiments.fine_tuning.records import HELD_OUT, OTHERS, SAMPLES, Record
from experiments.fine_tuning.takes import FOLDS

#: Statistics by what they describe, for the claims.
GROUPS = {
    "speed": ("speed_p50", "speed_p90", "speed_p99"),
    "reach": ("height", "height_spread", "radius"),
    "rest": ("rest",),
    "jerk": ("jerk_p50", "jerk_p90"),
    "posture": ("posture",),
}
_TUNED, _RIVALS = "fine-tuned", ("shipped", "from scratch", "from scratch with dynamics")
#: Distances of a record by group, and ``all``.
Distances = dict[str, float]


def render(run: str, records: Sequence[Record], cores: int) -> str:
    """The page of a shipped run: for each take the statistics, the distances from the person, and the costs."""
    takes = list(dict.fromkeys(record["take"] for record in records))
    lines = [
        f"# Fine-tuning `{run}` on a minute of a person's motion",
        "",
        f"Made by `python -m experiments.fine_tuning{'' if run == 'demo' else f' --run {run}'}`. Each take is cut into"
        f" {FOLDS} parts in time. A run is trained on all but one of them and generates {SAMPLES} motions for the"
        " speech of that one, whose frames entered neither training nor statistics nor early stopping; each part is"
        " held out once. *All parts together*: the motions for all parts, each of a run that never had it, against the"
        " person's whole take. *Single parts*: each against the person's motion in that part alone, on average."
        " Nothing in the tables of statistics is a score: figures near the person's are good. Rates are the recordings'"
        " own (BEAT's take has 15 frames a second): between its frames there is interpolation.",
        "",
    ]
    for take in takes:
        lines += _take([record for record in records if record["take"] == take])
    lines += ["## Definitions", ""]
    lines += [f"- **{name}**: {one.definition}." for name, one in (STATISTICS | DESCRIBED).items()]
    lines += [
        "- **distance**: mean over the statistics before agreement of the absolute binary logarithm of the ratio to the"
        " person's (1 is a factor of two); of rest and height the difference by 20 (per cent of time, cm), of posture"
        " by 10 cm.",
        "- **intervals**: 95 % of Student's t over seeds, and for single parts over the parts' means over seeds, of"
        " paired differences. Three seeds give wide ones; they hold for these takes, not for other people.",
        f"- **{OTHERS}**: what a method that reproduces its training motion exactly would get.",
        f"- Minutes are of processor time for one training, one process on {cores} shared cores. No FGD: a part has"
        " three clips of the feature network.",
    ]
    return "\n".join(lines) + "\n"


def _take(records: list[Record]) -> list[str]:
    person = next(record for record in records if record["method"] == HELD_OUT)
    methods = [method for method in METHODS if any(record["method"] == method for record in records)]
    both = {**STATISTICS, **DESCRIBED}
    lines = [
        f"## {person['take']}",
        "",
        "| all parts together | " + " | ".join(one.title for one in both.values()) + " |",
    ]
    lines += ["|---|" + "---|" * len(both)]
    for method in (HELD_OUT, *methods):
        rows = [record["pooled"] for record in records if record["method"] == method]
        cells = [_mean([row[name] for row in rows if name in row], one.digits) for name, one in both.items()]
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    lines += [
        "",
        f"| distance from the person | all parts together | {' | '.join(GROUPS)} | single parts | steps | minutes |",
    ]
    lines += ["|---|---|" + "---|" * len(GROUPS) + "---|---|---|"]
    for method in (OTHERS, *methods):
        own = [record for record in records if record["method"] == method]
        together = [_pooled(record, person) for record in own]
        cells = [_spread([one[name] for one in together]) for name in ("all", *GROUPS)]
        cells.append(_mean([_single(record, person)["all"] for record in own], 2))
        trained = [fold for record in own for fold in record["folds"] if fold.get("cpu_minutes")]
        steps = [fold["steps"] for fold in trained]
        cells.append("" if not steps else str(steps[0]) if len(set(steps)) == 1 else f"{min(steps)} to {max(steps)}")
        cells.append(_mean([fold["cpu_minutes"] for fold in trained], 1))
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return [*lines, "", *_single_parts(records, person, methods), "", *_differences(records, person), ""]


def _single_parts(records: list[Record], person: Record, methods: Sequence[str]) -> list[str]:
    """Distances in single parts by group: those of the person's other 80 % are the floor of what can be expected."""
    lines = [f"| distance in single parts | all | {' | '.join(GROUPS)} |", "|---|---|" + "---|" * len(GROUPS)]
    for method in (OTHERS, *methods):
        each = [_single(record, person) for record in records if record["method"] == method]
        cells = [_mean([one[name] for one in each], 2) for name in ("all", *GROUPS)]
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return lines


def _differences(records: list[Record], person: Record) -> list[str]:
    """Fine-tuned less each rival, seed by seed; below zero is nearer to the person."""
    lines = [f"| fine-tuned less | all parts together | {' | '.join(GROUPS)} | single parts |"]
    lines += ["|---|---|" + "---|" * len(GROUPS) + "---|"]
    tuned = {record["seed"]: record for record in records if record["method"] == _TUNED}
    for rival in _RIVALS:
        others = {record["seed"]: record for record in records if record["method"] == rival}
        seeds = [seed for seed in tuned if seed in others]
        if not seeds:
            continue
        pairs = [(_pooled(tuned[seed], person), _pooled(others[seed], person)) for seed in seeds]
        cells = [interval([ours[name] - theirs[name] for ours, theirs in pairs]) for name in ("all", *GROUPS)]
        folds = [
            float(np.mean([_fold(tuned[seed], person, part) - _fold(others[seed], person, part) for seed in seeds]))
            for part in range(len(person["folds"]))
        ]
        lines.append(f"| {rival} | " + " | ".join([*cells, interval(folds)]) + " |")
    return lines if len(lines) > 2 else []


def _pooled(record: Record, person: Record) -> Distances:
    """Distances of all parts together; of the person's other 80 %, their mean over the parts that are left out."""
    if record["pooled"] is not None:
        return _grouped(record["pooled"], person["pooled"])
    return _average(_grouped({**fold["values"], "posture": 0.0}, person["pooled"]) for fold in record["folds"])


def _single(record: Record, person: Record) -> Distances:
    """Distances of single parts, on average."""
    pairs = zip(record["folds"], person["folds"], strict=True)
    return _average(_grouped(ours["values"], theirs["values"]) for ours, theirs in pairs)


def _fold(record: Record, person: Record, part: int) -> float:
    return _grouped(record["folds"][part]["values"], person["folds"][part]["values"])["all"]


def _grouped(values: dict[str, float], truth: dict[str, float]) -> Distances:
    found = distances(values, {**truth, "posture": 0.0})
    mean: Callable[[Iterable[str]], float] = lambda names: float(np.mean([found[name] for name in names]))  # noqa: E731
    return {"all": mean(found), **{group: mean(names) for group, names in GROUPS.items()}}


def _average(each: Iterable[Distances]) -> Distances:
    rows = list(each)
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def interval(values: Sequence[float]) -> str:
    """Mean with the 95 % interval of Student's t, in bold where it lies below zero."""
    mean = float(np.mean(values))
    if len(values) < 2:
        return f"{mean:+.2f}"
    half = float(student.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / np.sqrt(len(values)))
    text = f"{mean:+.2f} [{mean - half:+.2f}, {mean + half:+.2f}]"
    return f"**{text}**" if mean + half < 0 else text


def _mean(values: list[float], digits: int) -> str:
    return f"{np.mean(values):.{digits}f}" if values else ""


def _spread(values: list[float]) -> str:
    spread = f" ({min(values):.2f} to {max(values):.2f})" if len(values) > 1 else ""
    return f"{np.mean(values):.2f}{spread}"
