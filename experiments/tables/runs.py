"""Common part of the tables: train a variant with a seed if there is no record, score it, keep the record."""

import argparse
import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.emotion_judge import EmotionJudge, load_emotion_judge
from a2g_jax.evaluation.evaluate import evaluate
from a2g_jax.evaluation.feature_network import FeatureNetwork, load_feature_network
from a2g_jax.io.files import write_json
from a2g_jax.metrics.units import OURS, UNITS, Units
from a2g_jax.models import find_model
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.training.loop import train
from a2g_jax.training.perceptual import load_perceptual
from a2g_jax.training.run import Run, RunConfig, load_run, run_to_json
from experiments.tables.records import all_tables, append, name_of, records


@dataclass(frozen=True)
class Variant:
    """A row of a table: a model, its preset and changes of its settings."""

    changes: Mapping[str, Any]
    model: str = "audio2gestures"
    preset: str = "tiny"
    training: Mapping[str, Any] | None = None
    """Changes of the tiny preset's training settings."""
    generation: Mapping[str, Any] | None = None
    """Changes of settings that act only in generation, applied after training."""
    trained_as: str = ""
    """Variant whose weights are used; empty for its own."""
    steps: float = 1.0
    """Training steps relative to the table's: above 1 for cheaper steps at equal computing."""


@dataclass(frozen=True)
class Ruler:
    """Means of measurement, the same for all rows of a table."""

    corpus: Corpus
    network: FeatureNetwork | None
    samples: int
    units: Units = OURS
    split: str = "test"
    judge: EmotionJudge | None = None
    """For emotion accuracy."""


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


@dataclass(frozen=True)
class Setting:
    """Folder of runs, corpus, and length of training."""

    corpus: Path
    features: Path | None
    """The network that scores; without one there is no FGD and no LPIPS."""
    runs: Path
    steps: int
    samples: int
    seeds: tuple[int, ...]
    minutes: float
    """Minutes after which no new training starts."""
    perceptual: Path | None = None
    """The network of perceptual losses, which is not the one that scores."""
    split: str = "test"
    """The split that is scored."""
    judge: Path | None = None
    """A classifier of emotions in motion; without one there is no emotion accuracy."""


def arguments(description: str, steps: int = 1000, seeds: str = "0,1,2") -> argparse.ArgumentParser:
    """Command line of all tables.

    Args:
        steps: of the committed records, so that the plain command continues from them.
        seeds: the default of ``--seeds``.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--corpus", type=Path, help="made by 'a2g prepare'; without one, the table is only rendered")
    parser.add_argument("--features", type=Path, help="a run of motion_autoencoder on it, for FGD and LPIPS")
    parser.add_argument(
        "--perceptual", type=Path, help="another such run, of another seed, for rows with a perceptual loss"
    )
    parser.add_argument("--runs", type=Path, default=Path("runs"), help="folder for trained runs (default: runs)")
    parser.add_argument("--steps", type=int, default=steps, help="training steps of each run (default: %(default)s)")
    parser.add_argument("--samples", type=int, default=20)
    parser.add_argument("--seeds", default=seeds, help="comma-separated (default: %(default)s)")
    parser.add_argument("--budget", type=float, default=1e9, help="minutes after which no new training starts")
    parser.add_argument("--only", help="variants, comma-separated (default: all)")
    return parser


def setting(options: argparse.Namespace) -> Setting:
    """The setting given by the flags."""
    seeds = tuple(int(seed) for seed in options.seeds.split(","))
    return Setting(
        options.corpus,
        options.features,
        options.runs,
        options.steps,
        options.samples,
        seeds,
        options.budget,
        options.perceptual,
    )


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


def measure(table: str, where: Setting) -> tuple[Ruler, dict[str, Any]]:
    """The ruler of a setting, in the units of the table's paper, and the fields that identify it in records.

    Raises:
        InputError: the perceptual loss would use the network that scores.
    """
    corpus = Corpus.open(where.corpus)
    network = None if where.features is None else load_feature_network(where.features, corpus)
    measured = {
        "corpus": name_of(corpus),
        "feature_network": None if network is None else network.fingerprint[:16],
        "samples": where.samples,
        "units": units_of(table).key,
        "split": where.split,
    }
    judge = None if where.judge is None else load_emotion_judge(where.judge, corpus)
    if judge is not None:
        measured["emotion_classifier"] = judge.fingerprint[:16]
    ruler = Ruler(corpus, network, where.samples, units_of(table), where.split, judge)
    check_networks(where, ruler)
    return ruler, measured


def units_of(table: str) -> Units:
    """The units of a table's paper, so that its figures can be compared with ours; ours where it has none."""
    return UNITS.get(table.split("/")[0].replace("_", "-"), OURS)


def check_networks(where: Setting, ruler: Ruler) -> None:
    """Refuse a perceptual loss on the network that scores.

    Raises:
        InputError: ``--perceptual`` and ``--features`` have the same weights.
    """
    if where.perceptual is None or ruler.network is None:
        return
    if load_perceptual(where.perceptual, ruler.corpus).fingerprint == ruler.network.fingerprint:
        raise InputError(
            f"--perceptual: {where.perceptual} has the weights of --features {where.features}, which would favour the"
            " rows with a perceptual loss; train another one (a2g train motion_autoencoder --seed 1)."
        )


def described(
    name: str, variant: Variant, variants: Mapping[str, Variant], seed: int, corpus: Corpus, where: Setting
) -> tuple[str, RunConfig]:
    """Configuration of a variant's run, and a digest of everything that its scores depend on."""
    made = variants.get(variant.trained_as or name, variant)
    steps = round(where.steps * made.steps)
    entry = find_model(made.model)
    of_sampling = {field.name for field in fields(entry.sampling)}
    config = replace(
        entry.presets[made.preset], **{name: value for name, value in made.changes.items() if name not in of_sampling}
    )
    sampling = {name: value for name, value in made.changes.items() if name in of_sampling}
    # Ramps must end before training does.
    ramps = {
        name: min(getattr(config, name), steps // 3)
        for name in ("kl_ramp_steps", "alignment_ramp_steps")
        if hasattr(config, name)
    }
    config = replace(config, **ramps)
    training = replace(
        TRAIN_PRESETS["tiny"],
        steps=steps,
        **{"warmup_steps": min(300, steps // 10), **(variant.training or {})},
        seed=seed,
        validate_every=steps,
    )
    needs = any(getattr(config, name, 0.0) > 0 for name in ("lpips_weight", "perceptual_weight"))
    if needs and where.perceptual is None:
        raise InputError(
            f"{name}: has a perceptual loss; give --perceptual a run of motion_autoencoder with another seed than that"
            " of --features."
        )
    perceptual = load_perceptual(where.perceptual, corpus) if needs and where.perceptual is not None else None
    run = RunConfig.of(made.model, made.preset, config, training, corpus, perceptual).with_sampling(**sampling)
    return _digest(run, corpus, variant.generation), run


#: Settings of generation by their names in the digests of records, which date from version 0.1.
_OLD_NAMES = {"controls": "control_curves"}


def _digest(config: RunConfig, corpus: Corpus, generation: Mapping[str, Any] | None) -> str:
    """A digest of everything that scores depend on, the same as in version 0.1, so that its records stay valid."""
    values = run_to_json(config, 0)
    sampling = {
        _OLD_NAMES.get(name, name): value
        for name, value in values.pop("sampling").items()
        if name not in ("keep_shared", "keep_specific", "control_gains")
    }
    if not sampling.get("rest_smoothing"):
        sampling = {name: value for name, value in sampling.items() if name not in ("rest_smoothing", "rest_speed")}
    # Records from before this setting existed equal those with it off.
    if not values["model_config"].get("recompute"):
        values["model_config"].pop("recompute", None)
    if "style_controls" not in values["model_config"]:
        sampling.pop("control_curves", None)
    values["model_config"] |= sampling
    values |= {"corpus": name_of(corpus), "generation": dict(generation or {}), "package": None}
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()[:16]


def _same(table: str, digest: str, conditions: Mapping[str, Any], scored: str) -> dict[str, Any] | None:
    """Record of an identical variant with the same scoring in any table of the paper, whatever its name."""
    for name in all_tables(table.split("/")[0]):
        for record in records(name):
            same = record.get("settings") == digest and record.get("scored", WHOLE) == scored
            if same and all(record[key] == value for key, value in conditions.items()):
                return record
    return None


def trained(config: RunConfig, variant: Variant, corpus: Corpus, where: Setting) -> tuple[Run, float, float]:
    """Run of a variant, trained if necessary, and the seconds of the call that finished it: wall clock and
    processor."""
    folder = where.runs / _digest(config, corpus, None)
    began, computed = time.monotonic(), time.process_time()
    train(config, corpus, folder, resume=True, progress=False)
    spent = folder / "seconds.json"
    # Another table may need the same run; its training time is that of the first call.
    if not spent.exists():
        write_json(spent, [time.monotonic() - began, time.process_time() - computed])
    seconds, computing = json.loads(spent.read_text(encoding="utf-8"))
    run = load_run(folder)
    if variant.generation:
        run = replace(run, config=run.config.with_sampling(**variant.generation))
    return run, seconds, computing


def folder_of(name: str, variants: Mapping[str, Variant], seed: int, corpus: Corpus, where: Setting) -> Path:
    """Folder of the run of a row of a table."""
    _, config = described(name, variants[name], variants, seed, corpus, where)
    return where.runs / _digest(config, corpus, None)


def _line(record: Mapping[str, Any]) -> str:
    shown = ("position_l1", "fgd", "multimodality", "beat_alignment")
    scores = record["scores"]
    return ", ".join(f"{name} {scores[name]['mean']:.3f}" for name in shown if name in scores)
