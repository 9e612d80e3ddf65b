"""A table of EmotionGesture as Markdown: our rows, nulls, verdicts on claims, and the paper's figures."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from a2g_jax.evaluation.scores import METRICS as SCORED
from a2g_jax.evaluation.scores import Metric
from experiments.emotion_gesture.bench import NULLS
from experiments.emotion_gesture.table import Table
from experiments.tables.claims import judge, over_seeds
from experiments.tables.records import current, path_of

ARROWS = {"lower": "↓", "higher": "↑", "truth": "≈"}


def _percent(title: str, better: str = "higher") -> Metric:
    return Metric(title, "%", better, "EmotionGesture", 1)


METRICS: dict[str, Metric] = {
    **SCORED,
    "position_l2": replace(SCORED["position_l2"], title="L2"),
    "mpjre": replace(SCORED["mpjre"], title="rotation error"),
    "beat_alignment": replace(SCORED["beat_alignment"], title="BA"),
    "beat_alignment shuffled": Metric("BA to other speech", "", "truth", "null"),
    "emotion_accuracy": _percent("EA"),
    "emotion_balanced": _percent("EA, mean over emotions"),
    "emotion_balanced shuffled": _percent("the same, of other speech", "truth"),
    "requested_accuracy": _percent("EA of requests"),
    "requested_other_accuracy": _percent("EA of requests, not the speech's"),
    "diversity": replace(SCORED["diversity"], title="diversity between clips"),
    "multimodality": replace(SCORED["multimodality"], title="diversity between samples"),
    "jerk": replace(SCORED["jerk"], title="jerk"),
    "seam_speed": Metric("speed at the seam", "of the truth's", "truth", "ours", 2),
    "seam_jerk": Metric("jerk at the seam", "of the truth's", "truth", "ours", 2),
    "onset_beat": Metric("onset AUC, beat features", "", "higher", "ours"),
    "onset_emotion": Metric("onset AUC, emotion features", "", "truth", "ours"),
    "emotion_beat": _percent("emotion, beat features", "truth"),
    "emotion_emotion": _percent("emotion, emotion features"),
    "reconstruction": Metric("held-out reconstruction", "", "lower", "Eq. 7"),
    "beat_loss": Metric("held-out beat alignment loss", "", "lower", "Eq. 2"),
    "own_accuracy": _percent("own emotion classifier"),
    "jerk_ratio": Metric("jerk", "of the clean motion's", "truth", "ours", 2),
    "accuracy": _percent("accuracy"),
    "balanced": _percent("mean over emotions"),
}


def show(table: Table) -> None:
    """Render the records of a table, if there are any, to its page and to the terminal."""
    if not current(table.name):
        print(f"{table.name}: there are no records yet; give a corpus with --corpus.")
        return
    text = render(table)
    path_of(table.name, ".md").write_text(text + "\n", encoding="utf-8")
    print(text)


def render(table: Table) -> str:
    """The page."""
    found = current(table.name)
    columns = [name for name in table.columns if any(name in record["scores"] for record in found)]
    lines = [f"# {table.title}", "", *about(found), ""]
    head = [_title(_metric(name), found) for name in columns]
    lines += [f"| | seeds | {' | '.join(head)} |", "|" + " --- |" * (len(columns) + 2)]
    for name in rows_of(table, found):
        seeds = len({record["seed"] for record in found if record["variant"] == name})
        if seeds:
            cells = [cell_text(table.name, name, key) for key in columns]
            lines.append(f"| {name} | {seeds} | {' | '.join(cells)} |")
    lines += ["", " ".join([*_notes(found), *table.notes]), ""]
    if table.claims:
        lines += ["The paper's claims and ours, checked on our data (differences paired by seed):", ""]
        lines += [f"- {claim.text}: **{judge(table.name, claim)}**" for claim in table.claims]
        lines.append("")
    if table.paper:
        lines += [
            "The paper's figures on BEAT, in other units and with other networks; comparable with ours in order, not in"
            " value:",
            "",
            *(f"- {name}: {text}" for name, text in table.paper.items()),
            "",
        ]
    return "\n".join(lines)


def _metric(key: str) -> Metric:
    """A metric; those that have no entry are shares, and levels of chance among them."""
    return METRICS.get(key, _percent(key, "truth" if key.startswith("chance") else "higher"))


def rows_of(table: Table, found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Rows of a page: variants, then nulls, then other untrained rows."""
    return list(dict.fromkeys([*table.variants, *NULLS, *(record["variant"] for record in found)]))


def about(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """What was trained, on what, and for how long."""
    trained = [record for record in found if record["steps"] > 0]
    if not trained:
        return ["Nothing was trained yet."]
    steps = sorted({record["trained_steps"] for record in trained})
    minutes = sum(record["train_seconds"] for record in trained) / 60
    last = trained[-1]
    # Scores of generated motion only.
    samples = f", {last['samples']} samples of each" if "position_l2" in last["scores"] else ""
    lines = [
        f"Corpus {last['corpus']}; the preset tiny's size, {', '.join(map(str, steps))} steps a run, {len(trained)}"
        f" records, {minutes:.0f} minutes of training on 2 cores shared with other work;"
        f" {last['clips']} test clips{samples}."
    ]
    seconds: dict[str, list[float]] = {}
    for record in trained:
        seconds.setdefault(record["variant"], []).append(record["train_cpu_seconds"])
    means = {name: sum(values) / len(values) for name, values in seconds.items() if max(values)}
    said = ", ".join(f"{name} {value:.0f}" for name, value in means.items())
    return [*lines, "", f"Seconds of processor time of a training, with all its stages (mean over seeds): {said}."]


def cell_text(table: str, variant: str, key: str) -> str:
    """A score over seeds with its interval; ``-`` without one."""
    found, metric = over_seeds(table, variant, key), _metric(key)
    if found is None:
        return "-"
    mean, half, count = found
    factor = 100.0 if metric.unit == "%" else 1.0
    text = f"{factor * mean:.{metric.digits}f}"
    return text + (f" +- {factor * half:.{metric.digits}f}" if count > 1 else "")


def _title(metric: Metric, found: Sequence[Mapping[str, Any]]) -> str:
    unit = metric.unit
    if any(record.get("unit", "cm") != "cm" for record in found):
        unit = unit.replace("cm", "units").replace("m/", "units/")
    return f"{metric.title}{f', {unit}' if unit else ''} {ARROWS[metric.better]}"


def _notes(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences on intervals, chance and the networks that score."""
    lines = ["Means over seeds +- half of a 95 % interval; rows without training have a draw for each seed."]
    scores = [record["scores"] for record in found]
    fgd = next((one["fgd"] for one in scores if "fgd" in one), None)
    if fgd is not None:
        lines.append(f"FGD is of {fgd['vectors']} vectors of {fgd['features']} features.")
    balanced = next((one["emotion_balanced"] for one in scores if "emotion_balanced" in one), None)
    if balanced is not None:
        lines.append(
            "EA is by a classifier of generated frames alone, trained on other recordings; chance is"
            f" {100 * balanced['chance']:.1f} % in the mean over emotions, and the truth's row what can be reached."
        )
    if len({record.get("emotion_classifier") for record in found}) > 1:
        lines.append(
            "Rows and seeds without EA are of another machine, where the classifier was trained again and is not the"
            " same to the last bit."
        )
    if any("requested_accuracy" in one for one in scores):
        lines.append(
            "Requests: test speeches in each emotion, with no seed clip; chance is 1 / emotions, and the truth is talk"
            " in each emotion by each speaker."
        )
    return lines
