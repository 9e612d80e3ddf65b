"""Command of a table: train and score what is missing, and render it; without a corpus, only render it."""

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from a2g_jax.training.run import Run
from experiments.emotion_gesture.bench import NULLS, TRUTH, Bench
from experiments.emotion_gesture.requests import requested, takes_requests, true_emotions
from experiments.emotion_gesture.scores import scores_of
from experiments.emotion_gesture.settings import scaled
from experiments.tables.claims import Claim
from experiments.tables.records import append, records
from experiments.tables.ruler import Ruler, measure
from experiments.tables.runs import run_table
from experiments.tables.setting import Setting, Variant, arguments, setting

#: Name of :func:`continued` in records.
SCORED = "continued clips"
#: Training steps of the committed records.
STEPS = 400


@dataclass(frozen=True)
class Table:
    """A table of the paper: its rows, columns and claims, and the paper's own figures."""

    key: str
    title: str
    variants: Mapping[str, Variant]
    columns: tuple[str, ...]
    claims: tuple[Claim, ...] = ()
    paper: Mapping[str, str] | None = None
    notes: tuple[str, ...] = ()
    requests: bool = True
    """Whether rows that take requested emotions are scored on them too."""

    @property
    def name(self) -> str:
        """Name of its records."""
        return f"emotion_gesture/{self.key}"


def command(table: Table) -> None:
    """Parse the flags, compute what is missing, and write the page."""
    from experiments.emotion_gesture.page import show  # which has tables as its argument

    options = parser(table.title).parse_args()
    if options.corpus is not None:
        where = setting_of(options)
        compute(table, where, options.only.split(",") if options.only else None)
    show(table)


def parser(title: str) -> argparse.ArgumentParser:
    """Flags of all tables."""
    made = arguments(title, STEPS)
    made.set_defaults(samples=2)
    made.add_argument(
        "--judge", type=Path, help="a run of emotion_classifier on other recordings, for emotion accuracy"
    )
    return made


def setting_of(options: argparse.Namespace) -> Setting:
    """The setting given by the flags."""
    return replace(setting(options), judge=options.judge)


def compute(table: Table, where: Setting, only: Sequence[str] | None) -> None:
    """Train and score what is missing."""
    ruler, measured = measure(table.name, where)
    bench = Bench(ruler)
    score_nulls(table, bench, measured, where.seeds)
    run_table(table.name, scaled(table.variants, where.steps), where, only, continued(bench, table.requests), SCORED)


def continued(bench: Bench, requests: bool) -> Callable[[str, Run, Ruler, int], dict[str, Any]]:
    """A score of runs for :func:`experiments.tables.runs.run_table`."""

    def score(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
        del name
        began = time.process_time()
        found = scores_of(bench.generate(run, ruler.samples, seed), bench, seed)
        found["scores"] |= of_other_speech(run, bench, seed)
        if requests and ruler.judge is not None and takes_requests(run):
            of_requests = requested(run, bench, seed)
            found["scores"] |= of_requests["scores"]
            found["requests"] = of_requests["requests"]
        return {**found, "score_cpu_seconds": time.process_time() - began}

    return score


def of_other_speech(run: Run, bench: Bench, seed: int) -> dict[str, Any]:
    """The scores that should depend on the speech, of motions for the speech of another recording."""
    found = scores_of(bench.generate(run, 1, seed, shuffled=True), bench, seed)["scores"]
    names = ("position_l2", "beat_alignment", "emotion_accuracy", "emotion_balanced")
    return {f"{name} shuffled": found[name] for name in names if name in found}


def score_nulls(table: Table, bench: Bench, measured: Mapping[str, Any], seeds: Sequence[int]) -> None:
    """Score the rows without training that have no record yet, with each seed, so that differences are paired."""
    for seed in seeds:
        for name in NULLS:
            fields = {"variant": name, "seed": seed, **measured, "steps": 0}
            if any(all(record.get(key) == value for key, value in fields.items()) for record in records(table.name)):
                continue
            twin = _twin(fields)
            if twin is not None:
                append(table.name, twin)
                continue
            made = bench.null(name, seed)
            if made is None:
                continue
            record = {**fields, "unit": bench.corpus.space.unit, **scores_of(made, bench, seed)}
            if name == TRUTH and bench.ruler.judge is not None and bench.corpus.recipe.get("reader") == "talker":
                of_requests = true_emotions(bench)
                record["scores"] |= of_requests["scores"]
                record["requests"] = of_requests["requests"]
            append(table.name, record)


def _twin(fields: Mapping[str, Any]) -> dict[str, Any] | None:
    """The same record in another table."""
    for key in ("table2", "table3", "table4"):
        for record in records(f"emotion_gesture/{key}"):
            if all(record.get(name) == value for name, value in fields.items()):
                return record
    return None
