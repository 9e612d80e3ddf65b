"""The flags of ``a2g generate`` for styles and seeds; imports nothing heavy, for ``a2g --help``."""

import argparse
from collections.abc import Callable
from typing import Any

#: What is meant where nothing is said.
SHARE, MODE, MIX = 0.9, "repeat", 0.5


def add_arguments(parser: argparse.ArgumentParser, share: Callable[[str], Any]) -> None:
    """Flags of ``a2g generate`` for runs of the stylized flow.

    Args:
        share: reads a number from 0 to 1.
    """
    group = parser.add_argument_group("the style of a clip (runs of stylized_flow)")
    group.add_argument("--style", metavar="CLIP", help="a BVH or NPZ whose style the motions take on")
    group.add_argument("--style-audio", metavar="FILE", help="the clip's own speech (default: silence)")
    group.add_argument("--style-share", type=share, metavar="SHARE", help=f"of style beside chance (default: {SHARE})")
    group.add_argument(
        "--style-mode",
        choices=("repeat", "statistics"),
        help=f"the clip's latents there and back, or their mean and deviation alone (default: {MODE})",
    )
    group.add_argument("--style-with", metavar="CLIP", help="a second clip, to blend the style with")
    group.add_argument("--style-with-audio", metavar="FILE", help="its speech (default: silence)")
    group.add_argument("--style-mix", type=share, metavar="SHARE", help=f"of the second clip (default: {MIX})")
    group.add_argument("--seed-clip", metavar="CLIP", help="a BVH or NPZ that the motions go on from (its last poses)")
