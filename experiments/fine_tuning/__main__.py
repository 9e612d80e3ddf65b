"""Fine-tuning on four fifths of each real take, scored on the fifth that was left out, for all fifths.

Three seeds; the table gives their number where it is another.

    python -m experiments.fine_tuning                        # Audio2Gestures, from the weights of a2g demo
    python -m experiments.fine_tuning --run demo-flow        # the flow
    python -m experiments.fine_tuning --only fine-tuned      # one method; the others are taken from the records
    python -m experiments.fine_tuning --develop              # other parts and another seed, for choosing settings

The takes are the BVH files with a WAV file beside them in ``A2G_SHARED_DATA``. Every take, method and seed is a record
in ``results/RUN/``, to which each fold is added as soon as it is measured, so the command is resumable; trainings are
resumed where they stopped. Weights trained on research-only recordings, and their motion, stay in ``--cache``.
"""

import argparse
import os
from pathlib import Path

from a2g_jax.compilations import keep_compilations
from a2g_jax.training.run import open_run
from experiments.fine_tuning.methods import METHODS
from experiments.fine_tuning.records import Campaign, Record, references
from experiments.fine_tuning.table import render
from experiments.fine_tuning.takes import find_takes, prepare_folds
from experiments.motion.speeches import shared_folder

RESULTS = Path(__file__).parent / "results"
SEEDS = (0, 1, 2)
#: Settings are chosen on parts that begin half a part later, with another seed.
DEVELOPMENT_SHIFT, DEVELOPMENT_SEEDS = 0.5, (10,)


def main() -> None:
    """Measure what is missing, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", default="demo", help="the shipped run to start from (default: %(default)s)")
    parser.add_argument("--only", help="methods, comma-separated, that may be trained and measured")
    parser.add_argument("--takes", help="takes, comma-separated (default: all)")
    parser.add_argument("--seeds", default=",".join(map(str, SEEDS)), help="comma-separated (default: %(default)s)")
    parser.add_argument("--cache", type=Path, default=Path("build/fine_tuning"), help="folder of corpora and runs")
    parser.add_argument("--develop", action="store_true", help="other parts and another seed; records in --cache")
    parser.add_argument("--picture", type=Path, help="also draw the statistics relative to the person's")
    parser.add_argument(
        "--strips", type=Path, metavar="DIR", help="also draw film strips; they show research-only motion"
    )
    options = parser.parse_args()
    keep_compilations()
    start, takes = open_run(options.run), find_takes(shared_folder())
    if not takes:
        raise SystemExit("no BVH files with WAV files in the folder of A2G_SHARED_DATA.")
    seeds = DEVELOPMENT_SEEDS if options.develop else tuple(map(int, options.seeds.split(",")))
    results = options.cache / "development" if options.develop else RESULTS
    methods = options.only.split(",") if options.only else list(METHODS)
    campaign = Campaign(options.run, start, results / options.run, options.cache / options.run)
    records: list[Record] = []
    for name in options.takes.split(",") if options.takes else list(takes):
        shift = DEVELOPMENT_SHIFT if options.develop else 0.0
        folds = prepare_folds(name, takes[name], start.config, campaign.cache / name, shift)
        records += references(folds)
        for method in METHODS:
            for seed in seeds:
                found = campaign.record(folds, method, seed, method in methods)
                records += [found] if found else []
        if options.strips is not None:
            from experiments.fine_tuning.picture import strips

            strips(options.strips / f"{options.run}_{name}.png", folds[0], campaign, seeds[0])
    text = render(options.run, records, os.cpu_count() or 1)
    (results / f"{options.run}.md").write_text(text, encoding="utf-8")
    if options.picture is not None:
        from experiments.fine_tuning.picture import draw

        draw(options.picture, records)
    print(text)


if __name__ == "__main__":
    main()
