"""Cost of evaluation at the papers' size: 20 samples of 4 test sequences of 5000 frames, all metrics.

    python -m experiments.benchmarks.evaluation [--sequences 4] [--frames 5000] [--samples 20] [--seed 0]

Generates the corpus (not timed); then scores the included run with the included feature network and every baseline, and
once more with the listening audit.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

from experiments.benchmarks import measure

CONTENDERS = {"demo weights and baselines": False, "the same with the listening audit": True}
_SOURCE = "corpus to score on"


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sequences", type=int, default=4)
    parser.add_argument("--frames", type=int, default=5000)
    parser.add_argument("--samples", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--contender", choices=[*CONTENDERS, _SOURCE], help=argparse.SUPPRESS)
    parser.add_argument("--corpus", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help="JSON file to write (default: in results/)")
    options = parser.parse_args()
    if options.contender == _SOURCE:
        _write_corpus(options)
        measure.report({})
        return
    if options.contender:
        measure.report(_evaluate(options))
        return
    with tempfile.TemporaryDirectory() as folder:
        names = ("sequences", "frames", "samples", "seed")
        arguments = [f"--corpus={folder}/corpus", *(f"--{name}={getattr(options, name)}" for name in names)]
        # In a process of its own: a child inherits its parent's peak, and this one would count in every row.
        measure.run_alone("experiments.benchmarks.evaluation", _SOURCE, arguments)
        rows = [
            {"contender": name, **measure.run_alone("experiments.benchmarks.evaluation", name, arguments)}
            for name in CONTENDERS
        ]
    columns = {
        "contender": "scored",
        "seconds": "seconds",
        "metrics": "metrics",
        "motions": "motions scored",
        "peak_mb": "peak memory, MB",
        "others": "share of the cores others took",
    }
    measure.print_table(rows, columns)
    settings = {name: getattr(options, name) for name in names}
    print(f"\nwritten to {measure.write_results('evaluation', settings, rows, options.out)}")


def _write_corpus(options: argparse.Namespace) -> None:
    """Write the requested number of test recordings, and as many to look up neighbours in."""
    from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
    from a2g_jax.data.settings import Features
    from a2g_jax.talker.recordings import cast, talk

    count = 10 * options.sequences  # a tenth of a corpus is its test split
    roles = [{**role, "seconds": options.frames / 30.0} for role in cast(float(count), options.seed)]
    features = Features()
    recipe = {"reader": "talker", "roles": roles, "fingers": False, "jitter": 0.0, "view": "body"}
    rows = (prepare_recording(talk(**role), features) for role in roles)
    write_corpus(options.corpus, rows, features=features, recipe=recipe)


def _evaluate(options: argparse.Namespace) -> dict[str, Any]:
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.evaluation.evaluate import evaluate
    from a2g_jax.evaluation.feature_network import load_feature_network
    from a2g_jax.training.run import demo_run

    corpus = Corpus.open(options.corpus)
    test = corpus.splits["test"][: options.sequences]
    corpus = replace(corpus, splits={**corpus.splits, "test": test})
    network = load_feature_network("demo", corpus)
    watch, start = measure.Stopwatch(), perf_counter()
    result = evaluate(
        {"demo": demo_run()},
        corpus,
        samples=options.samples,
        seed=options.seed,
        network=network,
        audit=CONTENDERS[options.contender],
    )
    seconds = perf_counter() - start
    return {
        "seconds": seconds,
        "metrics": len(result["rows"][0]["scores"]),
        "clips": result["about"]["clips"],
        "motions": sum(row["samples"] for row in result["rows"]) * result["about"]["clips"],
        "others": watch.others(),
    }


if __name__ == "__main__":
    main()
