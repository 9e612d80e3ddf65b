"""Inspection of a run made by ``a2g train``."""

import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from flax.traverse_util import flatten_dict

from a2g_jax.inspection.finding import Finding
from a2g_jax.inspection.report import Report
from a2g_jax.inspection.tree import body_facts
from a2g_jax.training.early_stopping import ended, read_metrics, validations
from a2g_jax.training.fine_tuning import training_model
from a2g_jax.training.run import Run, open_run
from a2g_jax.training.run_file import LOG_FILE, SHIPPED
from a2g_jax.training.run_hashes import check_log
from a2g_jax.training.stages import span_at, stage_spans
from a2g_jax.training.vanished import zero_gradient, zero_message

#: Ratio of the last to the best validation loss from which the difference is no fluctuation.
_WORSE = 1.25


def inspect_run(name: str | os.PathLike[str]) -> Report:
    """Model, settings, corpus, size and progress of a run.

    Args:
        name: a run folder, or the name of a run that comes with the package.

    Raises:
        InputError: not a run, or a damaged one.
    """
    run = open_run(name)
    log = [] if str(name) in SHIPPED else read_metrics(Path(name) / LOG_FILE)
    findings = [] if str(name) in SHIPPED else _check_log(Path(name))
    return Report(str(name), "run", run_facts(run, log), findings + check_run(run, log))


def _check_log(folder: Path) -> list[Finding]:
    wrong = check_log(folder)
    return [Finding("warning", "damaged", f"{wrong}.")] if wrong else []


def check_run(run: Run, log: list[dict[str, Any]]) -> list[Finding]:
    """Findings on unfinished training, losses that are not numbers, and rising validation loss."""
    findings = []
    settings = run.config.train_config
    spans = stage_spans(training_model(run.config), settings)
    wanted, stage = spans[-1].stop, span_at(spans, max(run.steps - 1, 0))
    if run.steps < wanted and not ended(settings, validations(log, spans[-1].first, wanted)):
        message = f"{run.steps} of {wanted} steps are done."
        findings.append(
            Finding("info", "unfinished", message, "Continue with 'a2g train ... --resume'.", value=run.steps / wanted)
        )
    losses = [line.get("loss") for line in log if "loss" in line]
    if None in losses:
        message = f"{losses.count(None)} logged losses are not numbers."
        findings.append(Finding("warning", "nan", message, "Lower the learning rate, or inspect the corpus."))
    if (zero := zero_gradient(log)) is not None:
        fix = "Train again with a lower learning rate or another seed."
        findings.append(Finding("warning", "zero-gradient", f"{zero_message(*zero)}.", fix, value=float(zero[0])))
    # Losses of different stages cannot be compared.
    checked = [
        line["loss"]
        for line in log
        if line.get("split") == "validation" and line.get("loss") is not None and line.get("step", 0) > stage.first
    ]
    # Losses below zero, as of likelihoods, have no ratio; those of players of a game rise and fall with one another.
    if len(stage.stage.updates) == 1 and len(checked) > 2 and min(checked) > 0 and checked[-1] > _WORSE * min(checked):
        message = f"the last validation loss, {checked[-1]:.4g}, is {checked[-1] / min(checked):.2f} times the best."
        fix = "It overfits: train on more recordings, or for fewer steps."
        findings.append(Finding("info", "overfitting", message, fix, value=checked[-1] / min(checked)))
    return findings


def run_facts(run: Run, log: list[dict[str, Any]]) -> dict[str, Any]:
    """The facts of a run."""
    config = run.config
    sizes = {name: int(np.size(value)) for name, value in flatten_dict(run.params, sep="/").items()}
    parts: dict[str, int] = {}
    for name, size in sizes.items():
        parts[name.split("/")[0]] = parts.get(name.split("/")[0], 0) + size
    facts: dict[str, Any] = {
        "run": {
            "model": config.model,
            "preset": config.preset,
            "steps": run.steps,
            "parameters": sum(sizes.values()),
            "of which": parts,
            "fps": config.fps,
            "pose": f"{config.space.kind}, {config.space.rows} rows",
            "audio": f"{config.mel.width} values a frame at {config.mel.sample_rate} Hz",
        },
        "corpus": {
            "fingerprint": config.corpus.get("fingerprint"),
            "minutes": round(config.corpus.get("seconds", 0.0) / 60, 2),
            "made by": {
                name: value
                for name, value in config.corpus.get("recipe", {}).items()
                if name in ("reader", "source", "seed", "minutes")
            },
        },
        **({} if config.source is None else {"trained from": _plain(asdict(config.source))}),
        "model settings": _plain(asdict(config.model_config)),
        "sampling settings": _plain(asdict(config.sampling_settings)),
        "training settings": _plain(asdict(config.train_config)),
    }
    last = {line["split"]: line for line in log if "split" in line}
    if last:
        facts["last losses"] = {
            split: {name: value for name, value in line.items() if name != "split"} for split, line in last.items()
        }
    return facts | body_facts(config.space.body)


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}
