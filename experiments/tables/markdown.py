"""A table as Markdown: our rows, the paper's rows, the claims."""

from collections.abc import Mapping, Sequence
from typing import Any

from a2g_jax.evaluation.report import vectors_text
from a2g_jax.evaluation.scores import METRICS as SCORED
from a2g_jax.evaluation.scores import Metric
from a2g_jax.metrics.units import OURS, Units, find_units
from experiments.tables.claims import Claim, best_over_seeds, judge, over_seeds
from experiments.tables.records import current, path_of
from experiments.tables.runs import WHOLE, Score, baselines, run_table, whole_recordings
from experiments.tables.setting import Setting, Variant, arguments, setting

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
    "audio2gestures": ("beat_alignment", "wrist_speed"),
    "stylized_flow": (
        *("beat_alignment", "wrist_speed", "jerk", "bits_per_dim", "chi", "silhouette", "chi_full", "silhouette_full"),
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
    shown = {name: _units(found).shown(METRICS[name]) for name in columns}
    head = " | ".join(f"{each.title}{_unit(each, found)} {_ARROWS[each.better]}" for each in shown.values())
    lines = [f"# {title}", "", *_budget(found), "", f"| | seeds | {head} |", "|" + " --- |" * (len(columns) + 2)]
    for name in names:
        cells = [_cell(table, name, key, metric) for key, metric in shown.items()]
        seeds = len({record["seed"] for record in found if record["variant"] == name})
        if seeds:
            lines.append(f"| {name} | {seeds} | {' | '.join(cells)} |")
    best = "Means over seeds +- half of a 95 % interval; in brackets the best of the samples."
    lines += ["", " ".join([best, *notes(table, found)]), ""]
    if claims:
        lines += ["The paper's claims, checked on our data (differences paired by seed):", ""]
        lines += [f"- {claim.text}: **{judge(table, claim)}**" for claim in claims]
        lines.append("")
    if paper:
        lines += [
            "The paper's figures, on **other data** (Trinity, S2G-Ellen or TED), another skeleton and another feature"
            " network; they are comparable with ours only in order, not in value"
            f"{'' if _units(found) is OURS else ', though in the same units'}:",
            "",
            *(f"- {name}: {text}" for name, text in paper.items()),
            "",
        ]
    return "\n".join(lines)


def _units(found: Sequence[Mapping[str, Any]]) -> Units:
    """Units of records that fit into one table; those of 0.1 are in ours."""
    return find_units(found[-1].get("units") or OURS.key)


def notes(table: str, found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences on units, feature vectors and networks of the records."""
    lines = [_units(found).describe] if _units(found).describe else []
    models = {record["model"] for record in found if "model" in record}
    if table.startswith("stylized_flow/") and models - {"stylized_flow"}:
        lines.append("Flows are given the true first poses of each clip; the other models have none.")
    scored = [record["scores"]["fgd"] for record in found if "fgd" in record["scores"]]
    old = [record for record in found if "units" not in record]
    if old and any("position_l1" in record["scores"] for record in old):
        lines.append(
            "These records are in our own units: L1 distances are sums over coordinates and means over our joints."
        )
    few = [
        score
        for score in scored
        if score["mean"] is not None and score.get("vectors", float("inf")) <= score.get("features", 0)
    ]
    lines += sorted({f"A dash: {score['reason']}." for score in scored if score["mean"] is None and "reason" in score})
    if few:
        lines.append(
            f"FGD marked as of too few vectors for a covariance of {few[0]['features']} features is mostly the error of"
            " that estimate."
        )
    if scored and all("vectors" not in score for score in scored):
        clips = max((record.get("clips", 0) for record in found), default=0)
        # By the flow's protocols a clip gives one vector.
        lines.append(
            f"FGD is of {clips} vectors of 128 features, which do not determine a covariance."
            if table.startswith("stylized_flow/") and clips
            else "They do not state the number of vectors behind FGD."
        )
    against = sorted({record["variant"] for record in old if _perceptual(record)})
    if against and scored:
        lines.append(
            f"The losses of {', '.join(against)} used the feature network that FGD and LPIPS use, which favours these"
            " rows."
        )
    return lines


def _perceptual(record: Mapping[str, Any]) -> bool:
    """Whether a row has a perceptual loss."""
    return any(record.get("changes", {}).get(name, 0.0) > 0 for name in ("lpips_weight", "perceptual_weight"))


def _unit(metric: Metric, found: Sequence[Mapping[str, Any]]) -> str:
    """Unit of a column: centimetres or metres, or the corpus's own unit if it has no metres."""
    unit = metric.unit
    if any(record.get("unit", "cm") != "cm" for record in found):
        unit = unit.replace("cm", "units").replace("m/", "units/")
    return f", {unit}" if unit else ""


def _cell(table: str, variant: str, name: str, metric: Metric) -> str:
    found, digits = over_seeds(table, variant, name), metric.digits
    if found is None:
        return "-"
    mean, half, count = found
    text = f"{mean:.{digits}f}" + (f" +- {half:.{digits}f}" if count > 1 else "")
    best = best_over_seeds(table, variant, name)
    if best is not None and best != mean:
        text += f" ({best:.{digits}f})"
    kept = (r["scores"][name] for r in current(table) if r["variant"] == variant and name in r["scores"])
    scores = next(one for one in kept if one["mean"] is not None)
    return text + vectors_text(scores)


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
