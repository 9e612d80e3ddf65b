"""The command line of ``a2g inspect``; imports nothing heavy, for ``a2g --help``."""

import argparse

DESCRIPTION = "What is in a file, a folder of recordings, a corpus or a run, and what may be wrong with it."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g inspect``."""
    parser.add_argument(
        "path",
        metavar="FILE|FOLDER|CORPUS|RUN",
        help="BVH, audio, TextGrid or other transcript, NPZ; WAV and BVH pairs; made by 'a2g prepare' or 'a2g train'",
    )
    parser.add_argument("--audio", metavar="FILE", help="the speech that belongs to a motion or a transcript")
    parser.add_argument(
        "--score",
        metavar="MOTION",
        help="how likely a RUN of stylized_flow finds a BVH or NPZ for the speech of --audio, and when the least;"
        " with --json for every frame",
    )
    parser.add_argument("--picture", metavar="FILE.png", help="with --score: draw it over time (needs Matplotlib)")
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.add_argument("--strict", action="store_true", help="exit with status 1 if there are warnings")
