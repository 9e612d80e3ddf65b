"""Fine-tuning on the first 80 % of each real take, scored on the rest, over three seeds.

    python -m experiments.fine_tuning                        # Audio2Gestures, from the weights of a2g demo
    python -m experiments.fine_tuning --run demo-flow        # the flow
    python -m experiments.fine_tuning --only fine-tuned      # one method; the others are taken from the records

The takes are the BVH files with a WAV file beside them in ``A2G_SHARED_DATA``. Every take, method and seed is a record
in ``results/RUN/``, kept as soon as it is measured, so the command is resumable; trainings are resumed where they
stopped. Weights trained on research-only recordings stay in ``--cache``.
"""

import argparse
import os
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.compilations import keep_compilations
from a2g_jax.generation.generator import Generator
from a2g_jax.io.files import read_json, sha256_file, write_json
from a2g_jax.training.run import Run, open_run
from a2g_jax.training.run_file import WEIGHTS_FILE, run_folder
from experiments.fine_tuning.measure import measure, posture_distance
from experiments.fine_tuning.methods import METHODS
from experiments.fine_tuning.table import render
from experiments.fine_tuning.takes import TakeData, find_takes, prepare_take
from experiments.motion.resampling import smooth_resample
from experiments.motion.speeches import code_digest, digest, shared_folder

RESULTS = Path(__file__).parent / "results"
SEEDS = (0, 1, 2)
#: Motions of each run for the held-out speech.
SAMPLES = 8


def main() -> None:
    """Measure what is missing, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", default="demo", help="the shipped run to start from (default: %(default)s)")
    parser.add_argument("--only", help="methods, comma-separated, that may be trained and measured")
    parser.add_argument("--takes", help="takes, comma-separated (default: all)")
    parser.add_argument("--seeds", type=int, default=len(SEEDS), help="number of seeds (default: %(default)s)")
    parser.add_argument("--cache", type=Path, default=Path("build/fine_tuning"), help="folder of corpora and runs")
    parser.add_argument("--picture", type=Path, help="also draw the statistics relative to the person's")
    parser.add_argument(
        "--strips", type=Path, metavar="DIR", help="also draw film strips; they show research-only motion"
    )
    options = parser.parse_args()
    keep_compilations()
    run, takes = open_run(options.run), find_takes(shared_folder())
    if not takes:
        raise SystemExit("no BVH files with WAV files in the folder of A2G_SHARED_DATA.")
    chosen = options.takes.split(",") if options.takes else list(takes)
    methods = options.only.split(",") if options.only else list(METHODS)
    records: list[dict[str, Any]] = []
    for name in chosen:
        take = prepare_take(name, takes[name], run.config, options.cache / options.run / name)
        records += [_reference(take, part) for part in ("held out", "first 80 %")]
        drawn = None
        for method in METHODS:
            for seed in SEEDS[: options.seeds]:
                found = _record(options.run, run, take, method, seed, options.cache, method in methods)
                records += [found] if found else []
                if found and method == "fine-tuned" and seed == 0:
                    drawn = _folder(options.cache, options.run, take, method, seed, found["identity"])
        if options.strips is not None and drawn is not None and drawn.is_dir():
            from experiments.fine_tuning.picture import strips

            strips(options.strips / f"{options.run}_{name}.png", options.run, take, drawn)
    text = render(options.run, records, SAMPLES, os.cpu_count() or 1)
    (RESULTS / f"{options.run}.md").write_text(text, encoding="utf-8")
    if options.picture is not None:
        from experiments.fine_tuning.picture import draw

        draw(options.picture, records)
    print(text)


def _stem(take: TakeData, method: str, seed: int) -> str:
    return f"{take.name}_{method.replace(' ', '-')}_{seed}"


def _folder(cache: Path, name: str, take: TakeData, method: str, seed: int, identity: str) -> Path:
    """The folder of a trained run."""
    return cache / name / "runs" / f"{_stem(take, method, seed)}_{identity}"


def _reference(take: TakeData, part: str) -> dict[str, Any]:
    """The person's own statistics."""
    speech = take.held_out if part == "held out" else take.trained
    values = measure(take.person(speech), speech)
    posture = posture_distance(take.person(speech), take.person(take.held_out))
    return {"take": take.name, "method": f"the person, {part}", "seed": None, "values": {**values, "posture": posture}}


def _record(
    name: str, start: Run, take: TakeData, method: str, seed: int, cache: Path, measured: bool
) -> dict[str, Any] | None:
    """The record of a method and a seed; None where it is missing and may not be made."""
    place = RESULTS / name / f"{_stem(take, method, seed)}.json"
    tuning = start.config.entry.fine_tuning
    identity = digest(sha256_file(run_folder(name) / WEIGHTS_FILE), take.corpus.fingerprint, repr(tuning))
    measured_by = code_digest([Path(__file__).parent / "measure.py", Path(__file__).parent / "takes.py"])
    if place.is_file():
        found: dict[str, Any] = read_json(place)
        if (found["identity"], found.get("measured_by")) == (identity, measured_by):
            return found
    if not measured:
        return None
    made = METHODS[method](name, take, seed, _folder(cache, name, take, method, seed, identity))
    motions = [
        take.at_rate(smooth_resample(motion, take.corpus.fps))
        for motion in Generator(made.run).generate(take.held_out.audio, SAMPLES, seed)
    ]
    values = measure(motions, take.held_out)
    record = {
        "identity": identity,
        "measured_by": measured_by,
        "take": take.name,
        "method": method,
        "seed": seed,
        "steps": made.run.steps,
        "cpu_minutes": made.cpu_minutes,
        "values": {**values, "posture": posture_distance(motions, take.person(take.held_out))},
    }
    assert all(np.isfinite(value) for value in record["values"].values())
    place.parent.mkdir(parents=True, exist_ok=True)
    write_json(place, record)
    print(place.stem, {key: round(value, 3) for key, value in record["values"].items()}, flush=True)
    return record


if __name__ == "__main__":
    main()
