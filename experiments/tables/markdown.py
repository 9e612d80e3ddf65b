"""A table as Markdown: our rows, the paper's rows, the claims."""

from collections.abc import Mapping, Sequence
from typing import Any

from a2g_jax.evaluation.scores import METRICS as SCORED
from a2g_jax.evaluation.scores import Metric
from experiments.tables.claims import Claim, best_over_seeds, judge, over_seeds
from experiments.tables.records import current, path_of
from experiments.tables.runs import (
    WHOLE,
    Score,
    Setting,
    Variant,
    arguments,
    baselines,
    run_table,
    setting,
    whole_recordings,
)

#: Columns of the papers' tables, in their order.
COLUMNS = (
    "position_l1",
    "speed_l1",
    "acceleration_l1",
    "pck",
    "stft",
    "ssim",
    "lpips",
    "fgd",
    "diversity",
    "multimodality",
)
#: Columns after them, by paper.
_OTHERS = {
    "audio2gestures": ("beat_alignment",),
    "stylized_flow": (
        *("beat_alignment", "jerk", "bits_per_dim", "chi", "silhouette", "chi_full", "silhouette_full"),
        *("chi_shuffled", "silhouette_shuffled", "chi_clusters", "silhouette_clusters"),
    ),
}
_T_SNE = "stylized flow, Table 3"
METRICS = {
    **SCORED,
    "bits_per_dim": Metric("bits per dimension", "", "lower", "held-out poses with the training's noise", 3),
    "chi_full": Metric("CHI, full space", "", "higher", _T_SNE, 1),
    "silhouette_full": Metric("silhouette, full space", "", "higher", _T_SNE),
    "chi_shuffled": Metric("CHI, speakers shuffled", "", "truth", _T_SNE, 1),
    "silhouette_shuffled": Metric("silhouette, speakers shuffled", "", "truth", _T_SNE),
    "chi_clusters": Metric("CHI, clusters instead of speakers", "", "truth", _T_SNE, 1),
    "silhouette_clusters": Metric("silhouette, clusters instead of speakers", "", "truth", _T_SNE),
}
_ARROWS = {"lower": "↓", "higher": "↑", "truth": "≈"}


def make(
    table: str,
    title: str,
    variants: Mapping[str, Variant],
    claims: Sequence[Claim],
    paper: Mapping[str, str],
    steps: int = 1000,
) -> None:
    """Command of a table: train and score what is missing, and render it; without a corpus, only render it."""
    options = arguments(title, steps).parse_args()
    if options.corpus is not None:
        compute(table, variants, setting(options), options.only.split(",") if options.only else None)
    draw(table, title, variants, claims, paper)


def compute(
    table: str,
    variants: Mapping[str, Variant],
    where: Setting,
    only: Sequence[str] | None,
    score: Score = whole_recordings,
    scored: str = WHOLE,
) -> None:
    """Train and score what is missing."""
    if scored == WHOLE:
        baselines(table, where)
    run_table(table, variants, where, only, score, scored)


def draw(
    table: str, title: str, variants: Mapping[str, Variant], claims: Sequence[Claim], paper: Mapping[str, str]
) -> None:
    """Write a table's Markdown next to its records, and print it; does nothing without records."""
    if not current(table):
        print(f"{table}: there are no records yet; give a corpus with --corpus.")
        return
    text = render(table, title, list(variants), claims, paper)
    path_of(table, ".md").write_text(text + "\n", encoding="utf-8")
    print(text)


def render(
    table: str,
    title: str,
    rows: Sequence[str],
    claims: Sequence[Claim],
    paper: Mapping[str, str],
) -> str:
    """Markdown with our table, the paper's figures and verdicts on its claims."""
    found = current(table)
    columns = [
        name for name in (*COLUMNS, *_OTHERS[table.split("/")[0]]) if any(name in record["scores"] for record in found)
    ]
    names = [*rows, *dict.fromkeys(record["variant"] for record in found if record["steps"] == 0)]
    head = " | ".join(f"{METRICS[name].title}{_unit(name, found)} {_ARROWS[METRICS[name].better]}" for name in columns)
    lines = [f"# {title}", "", *_budget(found), "", f"| | seeds | {head} |", "|" + " --- |" * (len(columns) + 2)]
    for name in names:
        cells = [_cell(table, name, metric) for metric in columns]
        seeds = len({record["seed"] for record in found if record["variant"] == name})
        if seeds:
            lines.append(f"| {name} | {seeds} | {' | '.join(cells)} |")
    lines += ["", "Means over seeds +- half of a 95 % interval; in brackets the best of the samples.", ""]
    if claims:
        lines += ["The paper's claims, checked on our data (differences paired by seed):", ""]
        lines += [f"- {claim.text}: **{judge(table, claim)}**" for claim in claims]
        lines.append("")
    if paper:
        lines += [
            "The paper's figures, on **other data** (Trinity, S2G-Ellen or TED), another skeleton and another feature"
            " network; they are comparable with ours only in order, not in value:",
            "",
            *(f"- {name}: {text}" for name, text in paper.items()),
            "",
        ]
    return "\n".join(lines)


def _unit(name: str, found: Sequence[Mapping[str, Any]]) -> str:
    """Unit of a column: centimetres or metres, or the corpus's own unit if it has no metres."""
    unit = METRICS[name].unit
    if any(record.get("unit", "cm") != "cm" for record in found):
        unit = unit.replace("cm", "units").replace("m/", "units/")
    return f", {unit}" if unit else ""


def _cell(table: str, variant: str, metric: str) -> str:
    found = over_seeds(table, variant, metric)
    if found is None:
        return "-"
    digits = METRICS[metric].digits
    mean, half, count = found
    text = f"{mean:.{digits}f}" + (f" +- {half:.{digits}f}" if count > 1 else "")
    best = best_over_seeds(table, variant, metric)
    return text if best is None or best == mean else f"{text} ({best:.{digits}f})"


def _budget(found: Sequence[Mapping[str, Any]]) -> list[str]:
    trained = [record for record in found if record["steps"] > 0]
    if not trained:
        return ["Nothing was trained yet."]
    steps = sorted({record["steps"] for record in trained})
    minutes = sum(record["train_seconds"] for record in trained) / 60
    corpora = sorted({record["corpus"] for record in found})
    unequal = any(record.get("trained_steps", record["steps"]) != record["steps"] for record in trained)
    return [
        f"Corpus {', '.join(corpora)}; the tiny preset, {', '.join(map(str, steps))} steps a run,"
        f" {len(trained)} records, {minutes:.0f} minutes of training on 2 cores shared with other work;"
        f" {trained[0]['samples']} samples of {trained[0]['clips']} test clips.",
        *(_training(trained) if unequal else []),
    ]


def _training(trained: Sequence[Mapping[str, Any]]) -> list[str]:
    """Steps and processor time of each row, where steps differ between rows."""
    rows = {record["variant"]: record["trained_steps"] for record in trained}
    seconds = {name: [record["train_cpu_seconds"] for record in trained if record["variant"] == name] for name in rows}
    return ["", "Training, in steps and seconds of one core (mean over seeds):", ""] + [
        f"- {name}: {steps} steps, {sum(seconds[name]) / len(seconds[name]):.0f} s" for name, steps in rows.items()
    ]
