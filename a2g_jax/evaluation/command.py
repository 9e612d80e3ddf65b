"""What ``a2g evaluate`` does; its flags are in :mod:`a2g_jax.evaluation.arguments`."""

import argparse
from pathlib import Path

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.evaluate import evaluate
from a2g_jax.evaluation.feature_network import load_feature_network
from a2g_jax.evaluation.report import markdown, write_report
from a2g_jax.progress import progress_bar
from a2g_jax.training.run import Run, demo_run, load_run


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """``a2g evaluate``: writes the report and prints its table.

    Raises:
        InputError: a run, the corpus or the feature network cannot be used, or do not belong together.
    """
    if not 1 <= options.samples <= 1000:
        raise InputError(f"--samples: expected a number from 1 to 1000; got {options.samples}.")
    if not 0 <= options.seed < 2**31:
        raise InputError(f"--seed: expected a number from 0 to 2147483647; got {options.seed}.")
    runs: dict[str, Run] = {}
    for name in options.runs:
        if name in runs:
            raise InputError(f"{name}: is named twice.")
        runs[name] = demo_run() if name == "demo" else load_run(name)
    corpus = Corpus.open(options.corpus)
    network = load_feature_network(options.features, corpus) if options.features else None
    with progress_bar(1, "scoring", "motion") as bar:

        def report(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        result = evaluate(
            runs,
            corpus,
            split=options.split,
            samples=options.samples,
            seed=options.seed,
            network=network,
            audit=options.audit,
            report=report,
        )
    written = write_report(result, Path(options.out))
    print(markdown(result))
    print(f"{options.out}: {', '.join(path.name for path in written)}")
