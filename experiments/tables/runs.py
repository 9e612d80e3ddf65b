"""Common part of the tables: train a variant with a seed if there is no record, score it, keep the record."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from a2g_jax.evaluation.evaluate import evaluate
from a2g_jax.training.run import Run
from experiments.tables.records import all_tables, append, records
from experiments.tables.ruler import Ruler, measure
from experiments.tables.setting import Setting, Variant
from experiments.tables.training import described, trained

#: ``score(name, run, ruler, seed) -> fields of a record in addition to its conditions``: "scores", and others.
Score = Callable[[str, Run, Ruler, int], dict[str, Any]]


#: Name of :func:`whole_recordings` in records.
WHOLE = "whole recordings"


def whole_recordings(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
    """Scores and listening audit on whole test recordings, as by ``a2g evaluate --audit``."""
    result = evaluate(
        {name: run},
        ruler.corpus,
        samples=ruler.samples,
        seed=seed,
        network=ruler.network,
        audit=True,
        baselines=False,
        units=ruler.units,
        split=ruler.split,
    )
    return {
        "clips": result["about"]["clips"],
        "scores": result["rows"][0]["scores"],
        "audit": result["audits"][name],
    }


def run_table(
    table: str,
    variants: Mapping[str, Variant],
    where: Setting,
    only: Sequence[str] | None = None,
    score: Score = whole_recordings,
    scored: str = WHOLE,
) -> None:
    """Train and score every variant with every seed that has no record yet, seed by seed.

    Args:
        scored: what ``score`` is called; records of one run that were scored alike serve several tables.
    """
    began = time.monotonic()
    ruler, measured = measure(table, where)
    corpus = ruler.corpus
    conditions = {**measured, "steps": where.steps}
    for seed in where.seeds:
        for name, variant in variants.items():
            if only is not None and name not in only:
                continue
            fields = {"variant": name, "seed": seed, **conditions}
            if any(all(record.get(key) == value for key, value in fields.items()) for record in records(table)):
                continue
            if (time.monotonic() - began) / 60 > where.minutes:
                print(f"{table}: the budget of {where.minutes:g} minutes is used up; run the command again to continue")
                return
            digest, config = described(name, variant, variants, seed, corpus, where)
            twin = _same(table, digest, conditions, scored)
            if twin is not None:
                append(table, {**twin, "variant": name})
                continue
            run, seconds, computing = trained(config, variant, corpus, where)
            if variant.trained_as:
                seconds = computing = 0.0  # counted with the variant that was trained
            record = {
                **fields,
                "settings": digest,
                "scored": scored,
                "model": variant.model,
                "unit": corpus.space.unit,
                "perceptual_network": None if config.perceptual is None else config.perceptual.fingerprint[:16],
                "changes": {**variant.changes, **(variant.generation or {})},
                "trained_steps": config.train_config.steps,
                "train_seconds": seconds,
                "train_cpu_seconds": computing,
                **score(name, run, ruler, seed),
            }
            append(table, record)
            print(f"{table}: {name}, seed {seed}: {_line(record)}", flush=True)


def baselines(table: str, where: Setting) -> None:
    """Score the truth and the other baselines, once for a corpus and a feature network."""
    ruler, fields = measure(table, where)

    def found(name: str) -> list[dict[str, Any]]:
        return [
            record
            for record in records(name)
            if record["steps"] == 0 and all(record.get(key) == value for key, value in fields.items())
        ]

    if found(table):
        return
    # Records of another table on the same corpus are valid here.
    rows = next((found(name) for name in all_tables(table.split("/")[0]) if found(name)), None)
    if rows is None:
        result = evaluate(
            {}, ruler.corpus, samples=where.samples, seed=0, network=ruler.network, units=ruler.units, split=ruler.split
        )
        rows = [
            {"variant": row["name"], "seed": 0, **fields, "steps": 0, "scores": row["scores"]} for row in result["rows"]
        ]
    for row in rows:
        append(table, row)


def _same(table: str, digest: str, conditions: Mapping[str, Any], scored: str) -> dict[str, Any] | None:
    """Record of an identical variant with the same scoring in any table of the paper, whatever its name."""
    for name in all_tables(table.split("/")[0]):
        for record in records(name):
            same = record.get("settings") == digest and record.get("scored", WHOLE) == scored
            if same and all(record[key] == value for key, value in conditions.items()):
                return record
    return None


def _line(record: Mapping[str, Any]) -> str:
    shown = ("position_l1", "fgd", "multimodality", "beat_alignment")
    scores = record["scores"]
    return ", ".join(f"{name} {scores[name]['mean']:.3f}" for name in shown if name in scores)
