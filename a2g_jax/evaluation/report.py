"""The report of an evaluation as JSON, Markdown, LaTeX and a picture."""

import json
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from a2g_jax.evaluation.compare import check_comparable as check_comparable
from a2g_jax.evaluation.compare import merge as merge
from a2g_jax.evaluation.compare import read_report as read_report
from a2g_jax.evaluation.emotion_tables import emotion_lines, emotions_picture
from a2g_jax.evaluation.report_cells import columns, counted, heading, markdown_cell, run_rows
from a2g_jax.evaluation.report_cells import vectors_text as vectors_text
from a2g_jax.evaluation.report_latex import latex
from a2g_jax.evaluation.report_notes import notes, preface
from a2g_jax.evaluation.row_names import BASELINES as BASELINES
from a2g_jax.evaluation.row_names import HALVES as HALVES
from a2g_jax.evaluation.row_names import MOTIONS as MOTIONS
from a2g_jax.evaluation.scores import Metric
from a2g_jax.io.staging import staged


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
            from a2g_jax.evaluation.report_picture import save_picture

            save_picture(result, folder / "report.png")
            written.append("report.png")
            if emotions_picture(result, folder / "emotions.png", BASELINES):
                written.append("emotions.png")
    return [out / name for name in written]


def markdown(result: dict[str, Any]) -> str:
    """The tables with their conditions and notes on how to read them."""
    about, metrics = result["about"], columns(result)
    lines = []
    for title, part in (
        ("Against the recorded motion", [metric for metric in metrics if metric.against_target]),
        ("Distribution, variety, rhythm and smoothness", [metric for metric in metrics if not metric.against_target]),
    ):
        lines += [f"**{title}**", "", *_table(result["rows"], part, about), ""]
    audits = [line for name, audit in result.get("audits", {}).items() for line in _audit_lines(name, audit)]
    runs = [*_runs(result), ""] if run_rows(result) else []
    after = [*_single(result, metrics), *emotion_lines(result), *audits]
    return "\n".join([*preface(about), "", *runs, *lines, *notes(result), "", *after])


def _table(rows: Sequence[dict[str, Any]], metrics: Sequence[Metric], about: dict[str, Any]) -> list[str]:
    lines = [
        "| | samples | " + " | ".join(heading(metric, about) for metric in metrics) + " |",
        "|" + " --- |" * (len(metrics) + 2),
    ]
    for row in rows:
        cells = [markdown_cell(row["scores"].get(metric.key), metric) for metric in metrics]
        lines.append(f"| {_plain(row['name'])} | {row['samples']} | " + " | ".join(cells) + " |")
    return lines


def _runs(result: dict[str, Any]) -> list[str]:
    """What each run is."""
    lines = ["| run | model | preset | steps | seed | weights |", "|" + " --- |" * 6]
    for row in run_rows(result):
        run = row["run"]
        lines.append(
            f"| {_plain(row['name'])} | {run['model']} | {run['preset']} | {run['steps']} | {run['seed']} |"
            f" {run['weights'][:16]} |"
        )
    return lines


def _single(result: dict[str, Any], metrics: Sequence[Metric]) -> list[str]:
    """The runs of several seeds, one by one."""
    groups = [row for row in result["rows"] if "runs" in row]
    lines = ["## Single runs", "", "Brackets hold intervals over recordings.", ""] if groups else []
    for group in groups:
        lines += [f"**{_plain(group['name'])}**", "", *_table(group["runs"], metrics, result["about"]), ""]
    return lines


def _plain(name: str) -> str:
    """A name that does not end the cell of a table."""
    return " ".join(name.split()).replace("|", "\\|")


def _clips(audit: dict[str, Any]) -> str:
    """Number of clips, and of recordings; audits of 0.1 do not have the latter."""
    clips, recordings = audit["clips"], audit.get("recordings")
    return f"{clips} clips" if recordings in (None, clips) else f"{clips} clips of {counted(recordings, 'recording')}"


def _audit_lines(name: str, audit: dict[str, Any]) -> list[str]:
    """The section of a run's audit."""
    lines = [
        f"## Does {_plain(name)} listen?",
        "",
        f"{'; '.join(audit['verdicts'])}. ({_clips(audit)}; another seed changes the wrists' motion by"
        f" {audit['sampling_cm']:.1f} cm.)",
        "",
        "| audio | change of the motion, cm | as a share of another seed's | agreement with the true audio |",
        "| --- | --- | --- | --- |",
    ]
    for audio, row in audit["conditions"].items():
        share, agreement = f"{row['change_of_sampling']:.2f}", f"{row['agreement']:.3f}"
        if row.get("agreement_interval"):
            agreement += f" [{row['agreement_interval'][0]:.3f}, {row['agreement_interval'][1]:.3f}]"
        elif "agreement_interval" in row:
            agreement += " [-]"
        lines.append(f"| {audio} | {row['change_cm']:.1f} | {share} | {agreement} |")
    return [*lines, ""]
