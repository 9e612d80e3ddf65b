"""Flags of ``a2g prepare``."""

import argparse

from a2g_jax.cli.argument_types import (
    CHANNEL,
    SMOOTH_HELP,
    TIER,
    channel,
    count,
    cutoff,
    frame_rate,
    natural,
    positive,
    seed,
    share,
)
from a2g_jax.data.data_set_names import all_names, is_reference
from a2g_jax.geometry.cutoff import CUTOFF
from a2g_jax.geometry.pose_kinds import WIDTHS


def reader_name(text: str) -> str:
    """A name of a data set, the path of a Python file, or ``module:name``."""
    known = ("talker", *all_names())
    if text not in known and not is_reference(text):
        raise argparse.ArgumentTypeError(
            f"expected one of {', '.join(known)}, a reader.py or package.module:READER; got {text!r}"
        )
    return text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g prepare``."""
    parser.add_argument(
        "reader",
        nargs="?",
        type=reader_name,
        metavar="NAME",
        help="folder (WAV and BVH of equal names), talker, a data set (see --list), a reader.py, or"
        " package.module:READER",
    )
    parser.add_argument("source", nargs="?", metavar="DIR", help="the data set's folder")
    parser.add_argument("--list", action="store_true", help="list what can be prepared, and exit")
    parser.add_argument("--out", metavar="CORPUS", help="folder to make")
    parser.add_argument(
        "--shard",
        metavar="I/N",
        help="prepare the I-th of N shares of the recordings, on one of N machines; --out is the shard's folder",
    )
    parser.add_argument(
        "--merge", nargs="+", metavar="SHARD", help="make the corpus of all of its shards, with --out CORPUS alone"
    )
    parser.add_argument("--seed", type=seed, default=0, help="of the generated talk and of the splits (default: 0)")
    parser.add_argument(
        "--workers", type=count, help="processes; the corpus does not depend on it (default: one a core)"
    )
    parser.add_argument(
        "--features",
        metavar="PAPER",
        help="rate, mel bands and poses of a paper; see --list (default: those of audio2gestures, with a range of 60 dB"
        " as the included weights have)",
    )
    parser.add_argument("--fps", type=frame_rate, help="frames per second (default: of the paper or the data set)")
    parser.add_argument(
        "--waveform", action="store_true", help="store the audio too, for models that compute their own features"
    )
    parser.add_argument(
        "--pose",
        choices=tuple(WIDTHS),
        help="representation of poses (default: of the paper, the data set or the view)",
    )
    recorded = parser.add_argument_group("recordings")
    recorded.add_argument(
        "--joints",
        choices=("body", "upper-body", "all"),
        help="body: any rig on 22 joints; upper-body: on 47 with fingers; all: the rig as it is (default: body)",
    )
    recorded.add_argument(
        "--for",
        dest="for_run",
        metavar="RUN",
        help="rate, mel bands, poses and body of a run, for 'a2g train --from RUN': a run folder, demo, demo-flow or"
        " demo-emotion",
    )
    recorded.add_argument("--random-split", action="store_true", help="split by the seed, not as the authors did")
    recorded.add_argument("--skip-broken", action="store_true", help="leave out recordings that cannot be read")
    recorded.add_argument("--limit", type=natural, help="maximum number of recordings")
    recorded.add_argument(
        "--labels", metavar="TABLE", help="emotions by window of 'a2g label'; only labelled stretches are prepared"
    )
    recorded.add_argument(
        "--confidence", type=share, help="with a table: least probability of a window's emotion (default: 0.9)"
    )
    recorded.add_argument("--channel", type=channel, metavar="left|right|N", help=CHANNEL)
    recorded.add_argument("--tier", metavar="NAME", help=TIER)
    recorded.add_argument("--smooth", type=cutoff, nargs="?", const=CUTOFF, metavar="HZ", help=SMOOTH_HELP)
    recorded.add_argument("--labelled", action="store_true", help="leave out recordings without an emotion")
    generated = parser.add_argument_group("generated talk")
    generated.add_argument("--minutes", type=positive, help="minutes of talk to generate (default: 30)")
    generated.add_argument("--speakers", metavar="NAMES", help="speakers, comma-separated (default: all)")
    generated.add_argument("--emotions", metavar="NAMES", help="emotions, comma-separated (default: all)")
    generated.add_argument(
        "--equal-emotions",
        action="store_true",
        help="emotions in equal shares; by default half of the recordings are neutral",
    )
    generated.add_argument(
        "--languages",
        metavar="NAMES",
        help="in equal shares, any of invented, en, de, es, fr, it (default: invented; others need a2g_jax[voices])",
    )
    generated.add_argument(
        "--jitter",
        type=positive,
        metavar="DEGREES",
        help="capture noise on the generated motion; the same command without it gives the clean motion",
    )
    generated.add_argument("--fingers", action="store_true", help="52 joints with fingers instead of the body's 22")
    generated.add_argument(
        "--view",
        choices=("body", "beat", "ted", "ted-expressive", "s2g"),
        help="show the speakers as a data set does: joints, bone directions or keypoints (default: body)",
    )
    generated.add_argument(
        "--on-demand",
        action="store_true",
        help="store the first 60 minutes; the rest is for training and generated in training, 30 minutes at a time",
    )
