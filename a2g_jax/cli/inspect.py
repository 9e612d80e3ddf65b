"""``a2g inspect``: the contents of a file, folder, corpus or run, and its likely faults."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from a2g_jax.cli.argument_types import CHANNEL, TIER, VERIFY, channel
from a2g_jax.cli.paths import existing_file, existing_run, writable_file
from a2g_jax.cli.speech import warn_of_speech
from a2g_jax.errors import InputError
from a2g_jax.io.reading import reading
from a2g_jax.training.run_file import SHIPPED

if TYPE_CHECKING:
    from a2g_jax.inspection.report import Report

DESCRIPTION = "Describe a file, a folder of recordings, a corpus or a run, and warn of what may be wrong with it."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g inspect``."""
    parser.add_argument(
        "path",
        metavar="FILE|FOLDER|CORPUS|RUN",
        help="BVH, audio, TextGrid or other transcript, NPZ; WAV and BVH pairs; made by 'a2g prepare' or 'a2g train';"
        " demo, demo-flow or demo-emotion",
    )
    parser.add_argument("--audio", metavar="FILE", help="the speech that belongs to a motion or a transcript")
    parser.add_argument(
        "--score",
        metavar="MOTION",
        help="log-likelihood of a BVH or NPZ under a RUN of stylized_flow, given the speech of --audio, and its least"
        " likely moments; with --json for every frame",
    )
    parser.add_argument("--picture", metavar="FILE.png", help="with --score: plot it over time (needs Matplotlib)")
    parser.add_argument("--channel", type=channel, metavar="left|right|N", help=CHANNEL)
    parser.add_argument("--tier", metavar="NAME", help=TIER)
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.add_argument("--verify", action="store_true", help=VERIFY)
    parser.add_argument("--strict", action="store_true", help="exit with status 1 if there are warnings")


def run(options: argparse.Namespace, _extra: list[str]) -> int:
    """Inspect or score, and print the report.

    Returns:
        The exit status: 1 for warnings with ``--strict``, else 0.

    Raises:
        InputError: a file, folder, corpus or run that cannot be used, or flags that do not belong together.
    """
    if options.score is None:
        report = _inspect(options)
    else:
        report = _score(options)
    document = report.to_json()
    print(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) if options.json else report.text())
    return 1 if options.strict and report.warnings else 0


def _inspect(options: argparse.Namespace) -> "Report":
    if options.picture is not None:
        raise InputError("--picture: plots a score; add --score MOTION, or leave it out.")
    if options.path not in SHIPPED:
        existing_file(options.path)
    existing_file(options.audio)

    from a2g_jax.inspection.inspect import inspect

    return inspect(options.path, options.audio, options.verify, channel=options.channel, tier=options.tier)


def _score(options: argparse.Namespace) -> "Report":
    if options.audio is None:
        raise InputError("--score: needs the speech that belongs to the motion; add --audio FILE.")
    picture = None if options.picture is None else Path(options.picture)
    if picture is not None and picture.suffix.lower() != ".png":
        raise InputError(f"--picture {picture}: expected a name that ends in .png.")
    existing_run(options.path)
    existing_file(options.score)
    existing_file(options.audio)
    writable_file(options.picture)

    from a2g_jax.inspection.likelihood import file_likelihood, likelihood_report

    motion = Path(options.score)
    warn_of_speech(options.audio, options.channel)
    with reading(options.channel):
        likelihood = file_likelihood(Path(options.path), motion, Path(options.audio))
    if picture is not None:
        # Only here, since Matplotlib is optional.
        from a2g_jax.inspection.likelihood_plot import save_likelihood

        save_likelihood(picture, likelihood.seconds, likelihood.log_likelihood, likelihood.moments)
    return likelihood_report(likelihood, motion, curve=options.json)
