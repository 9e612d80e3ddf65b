"""Bits per dimension on held-out motion: flows compared with the conditional Gaussian with the same context.

    python -m experiments.stylized_flow.likelihood RUN [RUN ...] --corpus CORPUS

Poses have the training's noise; test split; less is better. With 95 % intervals over recordings, and of the paired
difference from the Gaussian. Writes ``results/likelihood.json``. Runs can be compared only where clips, history,
lookahead and noise are the same.
"""

import argparse
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.evaluation.likelihood import bits_per_dim, gaussian_bits_per_dim
from a2g_jax.io.files import write_json
from a2g_jax.metrics.intervals import difference_interval
from a2g_jax.training.run import Run, open_run
from experiments.tables.records import results


def measure(run: Run, corpus: Corpus, seed: int) -> dict[str, Any]:
    """Bits of a run and of its Gaussian."""
    ours, gaussian = bits_per_dim(run, corpus, seed=seed), gaussian_bits_per_dim(run.config, corpus, seed=seed)
    difference = difference_interval(ours.noisy_clips, gaussian.noisy_clips, ours.recordings)
    return {
        "steps": run.steps,
        "settings": {"cell": run.config.model_config.cell, "predictor": run.config.model_config.predictor},
        "noisy": ours.noisy.to_json(),
        "clean": ours.clean.to_json(),
        "gaussian_noisy": gaussian.noisy.to_json(),
        "gaussian_clean": gaussian.clean.to_json(),
        "difference_noisy": difference.to_json(),
        "floor": ours.floor,
    }


def main() -> None:
    """Measure runs and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", help="folders of runs, or 'demo-flow'")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    corpus, figures = Corpus.open(options.corpus), {}
    for name in options.runs:
        figures[Path(name).name] = measure(open_run(name), corpus, options.seed)
        print(Path(name).name, figures[Path(name).name], flush=True)
    about = {"corpus": corpus.fingerprint[:16], "seed": options.seed}
    write_json(results("stylized_flow") / "likelihood.json", {**about, "runs": figures})


if __name__ == "__main__":
    main()
