"""Clips pinned in samples of the shipped runs: how closely they are followed, and how smooth the transitions are.

    python -m experiments.pins [RUN ...] [--pins 45] [--seed 0] [--no-picture]

Clips come from the real takes in ``A2G_SHARED_DATA``, where they are, and from ten generated recordings. Writes
``results/pins.json``, ``results/pins.md`` and ``results/pins.png``.
"""

import argparse
from pathlib import Path

from a2g_jax.compilations import keep_compilations
from a2g_jax.io.files import atomic_path, write_json
from a2g_jax.training.run import open_run
from experiments.motion.speeches import shared_folder
from experiments.pins.absurd import outcomes
from experiments.pins.clips import generated_takes, real_takes
from experiments.pins.measure import corpus_limit, measure, plain_samples
from experiments.pins.picture import picture
from experiments.pins.table import markdown

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Measure and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", metavar="RUN", default=["demo", "demo-flow"])
    parser.add_argument("--pins", type=int, default=45, help="clips of each source (default: 45)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--no-picture", action="store_true", help="without the film strips")
    options = parser.parse_args()
    keep_compilations()
    generated, real = generated_takes(options.seed), real_takes(shared_folder())
    limit = corpus_limit(options.seed)
    figures: dict = {"seed": options.seed, "jerk_limit": limit, "runs": {}}
    shown = []
    for name in options.runs:
        run = open_run(name)
        plains = plain_samples(run, options.seed)
        rows = {}
        for source in dict.fromkeys(take.source for take in [*real, *generated]):
            takes = [take for take in [*real, *generated] if take.source == source]
            rows[source] = measure(run, plains, takes, options.pins, limit, options.seed)
            print(name, source, {key: value for key, value in rows[source].items() if key != "rows"}, flush=True)
        absurd = outcomes(run, plains[0], generated[0], shared_folder(), limit)
        figures["runs"][name] = {"sources": rows, "absurd": absurd}
        shown.append((name, run, plains[1]))
    RESULTS.mkdir(exist_ok=True)
    write_json(RESULTS / "pins.json", figures)
    with atomic_path(RESULTS / "pins.md") as temporary:
        temporary.write_text(markdown(figures), encoding="utf-8")
    if not options.no_picture:
        # Not the people's own motion, which may not be published.
        picture(RESULTS / "pins.png", shown, generated[2:5], limit)


if __name__ == "__main__":
    main()
