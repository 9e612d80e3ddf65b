"""What ``a2g evaluate`` does; its flags are in :mod:`a2g_jax.evaluation.arguments`."""

import argparse
from pathlib import Path

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.emotion_judge import load_emotion_judge
from a2g_jax.evaluation.evaluate import evaluate
from a2g_jax.evaluation.feature_network import load_feature_network
from a2g_jax.evaluation.report import markdown, merge, read_report, write_report
from a2g_jax.progress import progress_bar
from a2g_jax.training.run import Run, open_run


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """``a2g evaluate``: writes the report and prints its table.

    Raises:
        InputError: a run, the corpus or the feature network cannot be used, or do not belong together.
    """
    if not 1 <= options.samples <= 1000:
        raise InputError(f"--samples: expected a number from 1 to 1000; got {options.samples}.")
    if not 0 <= options.seed < 2**31:
        raise InputError(f"--seed: expected a number from 0 to 2147483647; got {options.seed}.")
    if options.compare:
        _compare(options)
        return
    if options.corpus is None:
        raise InputError("--corpus is needed: what the runs are scored on; or --compare reports that there are.")
    runs: dict[str, Run] = {}
    for name in options.runs:
        if name in runs:
            raise InputError(f"{name}: is named twice.")
        runs[name] = open_run(name)
    corpus = Corpus.open(options.corpus)
    network = load_feature_network(options.features, corpus) if options.features else None
    judge = load_emotion_judge(options.emotion_classifier, corpus) if options.emotion_classifier else None
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
            judge=judge,
            audit=options.audit,
            report=report,
        )
    written = write_report(result, Path(options.out))
    print(markdown(result))
    print(f"{options.out}: {', '.join(path.name for path in written)}")


def _compare(options: argparse.Namespace) -> None:
    """One table of several reports."""
    if options.runs or options.corpus or options.features or options.audit or options.emotion_classifier:
        raise InputError("--compare takes reports as they are; leave out runs, --corpus, --features and --audit.")
    if len(set(options.compare)) < len(options.compare):
        raise InputError("--compare: a report is named twice.")
    result = merge({str(Path(folder)): read_report(Path(folder)) for folder in options.compare})
    written = write_report(result, Path(options.out))
    print(markdown(result))
    print(f"{options.out}: {', '.join(path.name for path in written)}")
