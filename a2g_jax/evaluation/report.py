"""The report of an evaluation as JSON, Markdown, LaTeX and a picture."""

import json
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.evaluation.emotion_tables import emotion_lines, emotions_picture
from a2g_jax.evaluation.report_notes import condition, notes, preface
from a2g_jax.evaluation.scores import METRICS, Metric
from a2g_jax.io.files import atomic_path, read_json
from a2g_jax.io.staging import staged
from a2g_jax.metrics.units import find_units

_ARROWS = {"lower": "↓", "higher": "↑", "truth": "≈"}
#: Motions of baselines, in the order of the table.
MOTIONS = (
    "truth",
    "another right motion",
    "truth, 1 degree of noise",
    "truth, 5 degrees of noise",
    "nearest neighbour in audio",
    "another clip's motion",
    "first pose held",
    "mean pose",
)
#: The floor of FGD: two random halves of the truth's vectors.
HALVES = "one half of the truth against the other"
BASELINES = (*MOTIONS, HALVES)
_LATEX_ARROWS = {"lower": r"$\downarrow$", "higher": r"$\uparrow$", "truth": r"$\approx$"}


def write_report(result: dict[str, Any], out: Path) -> list[Path]:
    """Write ``report.json``, ``report.md``, ``report.tex`` and, where Matplotlib is installed, ``report.png``.

    With a classifier of emotions also ``emotions.png``. All of them take the place of an earlier report together.

    Raises:
        OutputError: the disk is full, or the folder cannot be written to; an earlier report stays.
    """
    texts = {
        "report.json": json.dumps(result, indent=1) + "\n",
        "report.md": markdown(result),
        "report.tex": latex(result),
    }
    written = list(texts)
    with staged(out) as folder:
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
        if find_spec("matplotlib") is not None:
            _picture(result, folder / "report.png")
            written.append("report.png")
            if emotions_picture(result, folder / "emotions.png", BASELINES):
                written.append("emotions.png")
    return [out / name for name in written]


def markdown(result: dict[str, Any]) -> str:
    """The tables with their conditions and notes on how to read them."""
    about, metrics = result["about"], _metrics(result)
    lines = []
    for title, part in (
        ("Against the recorded motion", [metric for metric in metrics if metric.against_target]),
        ("Distribution, variety, rhythm and smoothness", [metric for metric in metrics if not metric.against_target]),
    ):
        head = [f"{_title(metric, about)}{_unit(metric, about)} {_ARROWS[metric.better]}" for metric in part]
        lines += [f"**{title}**", "", "| | samples | " + " | ".join(head) + " |", "|" + " --- |" * (len(part) + 2)]
        for row in result["rows"]:
            cells = [_cell(row["scores"].get(metric.key), metric) for metric in part]
            lines.append(f"| {row['name']} | {row['samples']} | " + " | ".join(cells) + " |")
        lines.append("")
    audits = [line for name, audit in result.get("audits", {}).items() for line in _audit_lines(name, audit)]
    return "\n".join([*preface(about), "", *lines, *notes(about), "", *emotion_lines(result), *audits])


def latex(result: dict[str, Any]) -> str:
    """A table for a paper (needs booktabs): means, with the best of the samples in brackets."""
    metrics = _metrics(result)
    titles = [f"{_title(metric, result['about'])} {_LATEX_ARROWS[metric.better]}" for metric in metrics]
    head = " & ".join(["", *titles])
    lines = [r"\begin{tabular}{l" + "r" * len(metrics) + "}", r"\toprule", head + r" \\", r"\midrule"]
    for row in result["rows"]:
        cells = []
        for metric in metrics:
            score, digits = row["scores"].get(metric.key), metric.digits
            if score is None:
                cells.append("--")
                continue
            best = f" ({score['best']:.{digits}f})" if row["samples"] > 1 and score["best"] is not None else ""
            vectors = f", $n = {score['vectors']}$" if score.get("vectors") else ""
            cells.append(f"{score['mean']:.{digits}f}{best}{vectors}")
        name = row["name"].replace("_", r"\_").replace("&", r"\&").replace("%", r"\%")
        lines.append(" & ".join([name, *cells]) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def check_comparable(results: dict[str, dict[str, Any]]) -> None:
    """Refuse to compare reports of different conditions.

    Args:
        results: contents of ``report.json`` files by name.

    Raises:
        InputError: different skeletons, corpora, splits, numbers of samples, units, feature networks or classifiers.
    """
    (first, reference), *others = results.items()
    for name, result in others:
        for key in (
            *("skeleton", "corpus", "split", "samples", "clips", "units", "wrist_to_wrist"),
            *("feature_network", "emotion_classifier"),
        ):
            here, there = (condition(each["about"], key) for each in (reference, result))
            if here != there:
                raise InputError(
                    f"{first} and {name}: cannot be compared: {key.replace('_', ' ')} is {here} in one and {there} in"
                    " the other; evaluate both in the same way."
                )


def merge(results: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Several reports as one: the models of all, and the baselines once.

    Args:
        results: contents of ``report.json`` files by name.

    Raises:
        InputError: see :func:`check_comparable`.
    """
    check_comparable(results)
    names: list[str] = [row["name"] for result in results.values() for row in result["rows"]]
    rows: list[dict[str, Any]] = []
    baselines: dict[str, dict[str, Any]] = {}
    audits: dict[str, Any] = {}
    for report, result in results.items():
        for row in result["rows"]:
            if row["name"] in BASELINES:
                # One report may have metrics that another one lacks.
                earlier = baselines.get(row["name"], row)
                baselines[row["name"]] = {**earlier, "scores": row["scores"] | earlier["scores"]}
                continue
            name = f"{row['name']} ({report})" if names.count(row["name"]) > 1 else row["name"]
            rows.append({**row, "name": name})
            if row["name"] in result.get("audits", {}):
                audits[name] = result["audits"][row["name"]]
    about = dict(next(iter(results.values()))["about"])
    extra = {
        key: values for result in results.values() for key, values in result["about"].get("extra_metrics", {}).items()
    }
    if extra:
        about["extra_metrics"] = extra
    return {"about": about, "rows": [*rows, *baselines.values()], "audits": audits}


def read_report(folder: Path) -> dict[str, Any]:
    """The contents of a report's ``report.json``.

    Raises:
        InputError: no such file, or not a report.
    """
    path = folder / "report.json"
    if not path.is_file():
        raise InputError(f"{folder}: is no report (no report.json in it); make one with 'a2g evaluate RUN ...'.")
    value = read_json(path)
    if (
        not isinstance(value, dict)
        or not isinstance(value.get("about"), dict)
        or not isinstance(value.get("rows"), list)
    ):
        raise InputError(f"{path}: is not a report of 'a2g evaluate'; run that again.")
    return value


def _audit_lines(name: str, audit: dict[str, Any]) -> list[str]:
    """The section of a run's audit."""
    lines = [
        f"## Does {name} listen?",
        "",
        f"{'; '.join(audit['verdicts'])}. ({audit['clips']} clips; another seed changes the wrists' motion by"
        f" {audit['sampling_cm']:.1f} cm.)",
        "",
        "| audio | change of the motion, cm | as a share of another seed's | agreement with the true audio |",
        "| --- | --- | --- | --- |",
    ]
    for name, row in audit["conditions"].items():
        share, agreement = f"{row['change_of_sampling']:.2f}", f"{row['agreement']:.3f}"
        if row.get("agreement_interval"):
            agreement += f" [{row['agreement_interval'][0]:.3f}, {row['agreement_interval'][1]:.3f}]"
        lines.append(f"| {name} | {row['change_cm']:.1f} | {share} | {agreement} |")
    return [*lines, ""]


def describe_metrics(metrics: Sequence[Metric]) -> dict[str, dict[str, Any]]:
    """Titles, units and so on of metrics of other packages, for ``about``: the JSON is readable without them."""
    names = ("title", "unit", "better", "source", "digits", "against_target")
    return {metric.key: {name: getattr(metric, name) for name in names} for metric in metrics}


def _metrics(result: dict[str, Any]) -> list[Metric]:
    """The metrics that any row has, in the report's units."""
    units = find_units(condition(result["about"], "units"))
    extra = {key: Metric(key=key, **values) for key, values in result["about"].get("extra_metrics", {}).items()}
    scored = {name for row in result["rows"] for name in row["scores"]}
    return [units.shown(metric) for metric in (METRICS | extra).values() if metric.key in scored]


def _title(metric: Metric, about: dict[str, Any]) -> str:
    """Title of a column; reports of 0.1 scaled L1* by the length of the bones from wrist to wrist."""
    old = metric.key == "position_l1_star" and "wrist_to_wrist" not in about
    return f"{metric.title} (by the bones' length, as in 0.1)" if old else metric.title


def _unit(metric: Metric, about: dict[str, Any]) -> str:
    """Lengths are centimetres and metres, or the corpus's own unit where it has no metres."""
    unit = metric.unit
    if unit and about.get("unit", "cm") != "cm":
        unit = unit.replace("cm", about["unit"]).replace("m/", f"{about['unit']}/")
    return f", {unit}" if unit else ""


def _cell(score: dict[str, Any] | None, metric: Metric) -> str:
    if score is None:
        return "-"
    digits = metric.digits
    text = f"{score['mean']:.{digits}f}"
    if score["low"] is not None and score["low"] == score["low"]:
        text += f" [{score['low']:.{digits}f}, {score['high']:.{digits}f}]"
    if score["best"] is not None and score["best"] != score["mean"]:
        text += f" best {score['best']:.{digits}f}"
    return text + vectors_text(score)


def vectors_text(score: dict[str, Any]) -> str:
    """The number of feature vectors behind a score, and whether they are fewer than their features; empty for others.

    Scores of 0.1 do not state it.
    """
    if not score.get("vectors"):
        return ""
    few = ", too few" if score["vectors"] <= score["features"] else ""
    return f" (n = {score['vectors']}{few})"


def _picture(result: dict[str, Any], path: Path) -> None:
    """One panel for each metric, one bar with its interval for each row."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    metrics, rows = _metrics(result), result["rows"]
    columns = 4
    lines = -(-len(metrics) // columns)
    height = 0.24 * len(rows) + 0.7
    figure, axes = pyplot.subplots(
        lines, columns, figsize=(13, lines * height), sharey=True, squeeze=False, layout="constrained"
    )
    models = sum(row["name"] not in BASELINES for row in rows)
    for panel, metric in zip(axes.flat, metrics, strict=False):
        for place, row in enumerate(rows):
            score = row["scores"].get(metric.key)
            if score is None:
                continue
            colour = "#2f6fde" if place < models else "#b7c0cc"
            panel.barh(place, score["mean"], color=colour, height=0.7)
            if score["low"] is not None:
                panel.plot([score["low"], score["high"]], [place, place], color="#1b2433", linewidth=1.4)
        values = sorted(row["scores"][metric.key]["mean"] for row in rows if metric.key in row["scores"])
        if len(values) > 2 and values[-1] > 4 * values[-2] > 0:
            panel.set_xlim(0, 1.6 * values[-2])  # so that one row far beyond the others does not flatten them
        panel.set_title(
            f"{_title(metric, result['about'])}{_unit(metric, result['about'])} {_ARROWS[metric.better]}", fontsize=9
        )
        panel.tick_params(labelsize=8)
        panel.spines[["top", "right"]].set_visible(False)
    for panel in list(axes.flat)[len(metrics) :]:
        panel.set_visible(False)
    axes[0, 0].set_yticks(range(len(rows)), [row["name"] for row in rows])
    axes[0, 0].invert_yaxis()
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")
    pyplot.close(figure)
