"""The command line of ``a2g evaluate``; imports nothing heavy, for ``a2g --help``."""

import argparse

DESCRIPTION = (
    "Score runs on a held-out split, each score beside what the truth, other right motions, noise, a neighbour's motion"
    " and the mean pose get."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g evaluate``."""
    parser.add_argument("runs", nargs="*", metavar="RUN", help="run folders, demo or demo-flow; none: baselines alone")
    parser.add_argument("--corpus", metavar="CORPUS", help="made by 'a2g prepare'")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for report.json, .md, .tex and .png")
    parser.add_argument(
        "--features",
        metavar="RUN",
        help="a run of motion_autoencoder, or 'demo' for the one that comes along; for FGD and LPIPS (default: none)",
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
        help="also see whether each run listens: late audio, other audio, silence, loudness",
    )
    parser.add_argument("--split", default="test", help="of the corpus (default: test)")
    parser.add_argument("--samples", type=int, default=20, help="motions of each run for each clip (default: 20)")
    parser.add_argument("--seed", type=int, default=0, help="of all that is drawn (default: 0)")
