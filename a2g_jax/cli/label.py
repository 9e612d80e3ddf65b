"""``a2g label``: emotions of a data set's recordings by a classifier of audio."""

import argparse
from pathlib import Path

from a2g_jax.cli.argument_types import count, natural
from a2g_jax.cli.paths import existing_file, existing_folder, existing_run, writable_file
from a2g_jax.cli.prepare_flags import reader_name
from a2g_jax.errors import InputError

DESCRIPTION = "Label recordings with emotions by a classifier of audio. Interruptible: the same command resumes."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g label``."""
    parser.add_argument(
        "reader", type=reader_name, metavar="NAME", help="a data set (see 'a2g prepare --list'), such as ted-expressive"
    )
    parser.add_argument("source", metavar="DIR", help="the data set's folder")
    parser.add_argument(
        "--classifier", required=True, metavar="RUN", help="a run of emotion_classifier --input audio, such as of BEAT"
    )
    parser.add_argument(
        "--out",
        metavar="TABLE",
        help="CSV file of windows with their emotion and its probability, for 'a2g prepare --labels' (default:"
        " DIR/emotions.csv, where 'a2g prepare ted-emotion DIR' reads it)",
    )
    parser.add_argument("--stride", type=natural, help="frames from a window to the next (default: half a window)")
    parser.add_argument("--skip-broken", action="store_true", help="leave out recordings that cannot be read")
    parser.add_argument("--limit", type=natural, help="maximum number of recordings")
    parser.add_argument("--workers", type=count, help="processes that read (default: one a core)")


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """Write the table, and print the number of windows of each emotion.

    Raises:
        InputError: a data set, folder, run or table that cannot be used.
    """
    if options.reader == "talker":
        raise InputError("talker: generated recordings have emotions already; name a data set.")
    if options.reader.endswith(".py"):
        existing_file(options.reader, "name a Python file that defines DATASET")
    existing_folder(options.source)
    existing_run(options.classifier, ())
    out = Path(options.out) if options.out else Path(options.source) / "emotions.csv"
    writable_file(str(out))

    from a2g_jax.compilations import keep_compilations
    from a2g_jax.evaluation.emotion_labels import label_data_set, load_audio_classifier

    keep_compilations()
    counts = label_data_set(
        options.reader,
        options.source,
        load_audio_classifier(options.classifier),
        out,
        stride=options.stride,
        skip_broken=options.skip_broken,
        limit=options.limit,
        workers=options.workers,
    )
    emotions = ", ".join(f"{name} {number}" for name, number in sorted(counts.items()))
    print(f"{out}: {sum(counts.values())} windows: {emotions}")
    print(f"next: a2g prepare {options.reader} {options.source} --labels {out} --confidence 0.9 --out CORPUS")
