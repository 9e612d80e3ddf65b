"""Runs of rows: their configuration, the digest that names them, and training."""

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.io.files import write_json
from a2g_jax.models import find_model
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.training.loop import train
from a2g_jax.training.perceptual import load_perceptual
from a2g_jax.training.run import Run, RunConfig, load_run, run_to_json
from experiments.tables.records import name_of
from experiments.tables.setting import Setting, Variant


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
    return digest_of(run, corpus, variant.generation), run


#: Settings of generation by their names in the digests of records, which date from version 0.1.
_OLD_NAMES = {"controls": "control_curves"}


def digest_of(config: RunConfig, corpus: Corpus, generation: Mapping[str, Any] | None) -> str:
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


def trained(config: RunConfig, variant: Variant, corpus: Corpus, where: Setting) -> tuple[Run, float, float]:
    """Run of a variant, trained if necessary, and the seconds of the call that finished it: wall clock and
    processor."""
    folder = where.runs / digest_of(config, corpus, None)
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
    return where.runs / digest_of(config, corpus, None)
