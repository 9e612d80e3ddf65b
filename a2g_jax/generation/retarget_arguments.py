"""The command line of ``a2g retarget``; imports nothing heavy, for ``a2g --help``."""

import argparse

DESCRIPTION = "The motion of one rig on another: any humanoid BVH to any other, or to the body joints models train on."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g retarget``."""
    parser.add_argument("source", metavar="IN.bvh", help="the motion")
    parser.add_argument(
        "--to",
        required=True,
        metavar="TARGET",
        help="a BVH file with the rig to move, or body (22 joints) or upper-body (47), with the source's own bones",
    )
    parser.add_argument("--out", required=True, metavar="OUT.bvh", help="file to write, laid out as the target is")
    parser.add_argument("--mirror", action="store_true", help="exchange left and right")
    parser.add_argument(
        "--fps", type=float, metavar="F", help="frames per second of the result (default: the source's)"
    )
