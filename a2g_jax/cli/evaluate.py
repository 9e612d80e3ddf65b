"""``a2g evaluate``: scores of runs on a corpus as a report."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2g_jax.cli.argument_types import VERIFY, count, number, seed
from a2g_jax.cli.paths import existing_corpus, existing_features, existing_report, existing_run, writable_folder
from a2g_jax.errors import InputError

if TYPE_CHECKING:
    from a2g_jax.training.run import Run

DESCRIPTION = (
    "Score runs on a held-out split, beside the scores of the ground truth, other right motions, noise, a neighbour's"
    " motion, a held pose and the mean pose. Of emotion classifiers: confusion matrices."
)
#: Frames, as papers give them, are refused: 5 would be five seconds.
_TOLERANCE = number(float, 0.01, 2.0, "seconds from 0.01 to 2")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g evaluate``."""
    parser.add_argument(
        "runs",
        nargs="*",
        metavar="RUN",
        help="run folders, demo, demo-flow or demo-emotion, or runs of emotion_classifier; none: baselines only; runs"
        " that differ only in their seed become one row, with an interval over seeds",
    )
    parser.add_argument("--corpus", metavar="CORPUS", help="made by 'a2g prepare'")
    parser.add_argument(
        "--out", required=True, metavar="DIR", help="folder for report.json, .md, .tex and, with Matplotlib, .png"
    )
    parser.add_argument(
        "--features",
        metavar="RUN",
        help="a run of motion_autoencoder, or 'demo' for the one in the package; for FGD and LPIPS (default: none)",
    )
    parser.add_argument(
        "--emotion-classifier", metavar="RUN", help="a run of emotion_classifier --input motion, for emotion accuracy"
    )
    parser.add_argument(
        "--compare", nargs="+", metavar="REPORT", help="instead of scoring: folders of reports, as one table"
    )
    parser.add_argument(
        "--audit",
        action="store_true",
        help="also test whether each run depends on the audio: late audio, other audio, silence, loudness",
    )
    parser.add_argument(
        "--metric", action="append", metavar="MODULE:NAME", help="a metric of another package; may be repeated"
    )
    parser.add_argument(
        "--units",
        default="ours",
        metavar="PAPER",
        help="units of distances and speeds: ours, or those of the tables of audio2gestures or stylized-flow (default:"
        " ours)",
    )
    parser.add_argument(
        "--beat-sigma",
        type=_TOLERANCE,
        metavar="SECONDS",
        help="tolerance of beat alignment from motion to audio (default: 0.167, with --units stylized-flow the paper's"
        " 5 frames at the corpus's frame rate)",
    )
    parser.add_argument("--split", default="test", help="split of the corpus (default: test)")
    parser.add_argument("--samples", type=count, default=20, help="motions of each run for each clip (default: 20)")
    parser.add_argument("--verify", action="store_true", help=VERIFY)
    parser.add_argument("--seed", type=seed, default=0, help="seed of the random numbers (default: 0)")


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """Score or compare, write the report and print its table.

    Raises:
        InputError: a run, corpus, report or feature network that cannot be used, or that do not belong together.
    """
    result = _compare(options) if options.compare else _score(options)
    if "classifiers" in result:
        from a2g_jax.evaluation import confusion_report

        print(confusion_report.markdown(result))
        written = confusion_report.write_confusion(result, Path(options.out))
        print(f"{options.out}: {', '.join(path.name for path in written)}")
        return

    from a2g_jax.evaluation.report import markdown, write_report

    print(markdown(result))
    written = write_report(result, Path(options.out))
    print(f"{options.out}: {', '.join(path.name for path in written)}")


def _score(options: argparse.Namespace) -> dict[str, Any]:
    if options.corpus is None:
        raise InputError("--corpus is needed: what the runs are scored on; or --compare existing reports.")
    for place, name in enumerate(options.runs):
        if name in options.runs[:place]:
            raise InputError(f"{name}: is named twice.")
        existing_run(name)
    existing_corpus(options.corpus)
    existing_features(options.features)
    existing_run(options.emotion_classifier, ())
    writable_folder(options.out)

    from a2g_jax.compilations import keep_compilations
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.data.corpus_integrity import verify_corpus
    from a2g_jax.evaluation.confusion import classify_split, is_classifier
    from a2g_jax.evaluation.emotion_judge import load_emotion_judge
    from a2g_jax.evaluation.evaluate import evaluate
    from a2g_jax.evaluation.feature_network import load_feature_network
    from a2g_jax.metrics.catalogue import METRICS
    from a2g_jax.metrics.registry import find_metrics
    from a2g_jax.metrics.units import find_units
    from a2g_jax.progress import progress_bar
    from a2g_jax.training.run import open_run

    units = find_units(options.units)
    if options.beat_sigma is not None:
        units = replace(units, beat_sigma=options.beat_sigma, beat_sigma_frames=None)
    keep_compilations()
    runs: dict[str, Run] = {name: open_run(name) for name in options.runs}
    corpus = Corpus.open(options.corpus)
    verify_corpus(corpus, options.verify)
    if any(is_classifier(run) for run in runs.values()):
        for flag in ("features", "emotion_classifier", "audit", "metric", "beat_sigma"):
            if getattr(options, flag):
                raise InputError(f"--{flag.replace('_', '-')} is for runs that generate motion; leave it out.")
        return classify_split(runs, corpus, split=options.split)
    network = load_feature_network(options.features, corpus) if options.features else None
    judge = load_emotion_judge(options.emotion_classifier, corpus) if options.emotion_classifier else None
    with progress_bar(1, "scoring", "motion") as bar:

        def report(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        return evaluate(
            runs,
            corpus,
            split=options.split,
            samples=options.samples,
            seed=options.seed,
            network=network,
            judge=judge,
            audit=options.audit,
            extra_metrics=find_metrics(options.metric or (), tuple(METRICS)),
            units=units,
            report=report,
        )


def _compare(options: argparse.Namespace) -> dict[str, Any]:
    """One table of several reports."""
    scored = (options.runs, options.corpus, options.features, options.audit, options.emotion_classifier)
    if any(scored) or options.units != "ours" or options.beat_sigma is not None:
        raise InputError(
            "--compare takes reports as they are; leave out runs, --corpus, --features, --units, --beat-sigma and"
            " --audit."
        )
    if len(set(options.compare)) < len(options.compare):
        raise InputError("--compare: a report is named twice.")
    for folder in options.compare:
        existing_report(folder)

    from a2g_jax.evaluation.report import merge, read_report

    return merge({str(Path(folder)): read_report(Path(folder)) for folder in options.compare})
