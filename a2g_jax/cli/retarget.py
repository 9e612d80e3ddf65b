"""``a2g retarget``: the motion of one rig on another."""

import argparse
from pathlib import Path

from a2g_jax.cli.argument_types import SMOOTH_HELP, cutoff, frame_rate
from a2g_jax.cli.paths import existing_file, writable_file
from a2g_jax.errors import InputError
from a2g_jax.geometry.cutoff import CUTOFF
from a2g_jax.io.character import SUFFIXES, character_suffix

DESCRIPTION = (
    "Transfer a motion from one rig to another: any humanoid BVH to any other, to a GLB or VRM character, or to the"
    " body joints that models train on."
)
#: Targets other than a file: skeletons with the source's own bones.
_OWN = ("body", "upper-body")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g retarget``."""
    parser.add_argument("source", metavar="IN.bvh", help="the motion")
    parser.add_argument(
        "--to",
        required=True,
        metavar="TARGET",
        help="a BVH, GLB or VRM file with the rig to move, or body (22 joints) or upper-body (47), with the source's"
        " own bones",
    )
    parser.add_argument(
        "--out",
        required=True,
        metavar="OUT.bvh|OUT.glb",
        help="file to write: a BVH in the target's layout, or the GLB of the target with the motion as an animation",
    )
    parser.add_argument(
        "--fingers",
        choices=("relaxed", "none"),
        default="none",
        help="fingers of the target that the source does not move: none, as in its rest pose (default), or relaxed",
    )
    parser.add_argument("--mirror", action="store_true", help="exchange left and right")
    parser.add_argument(
        "--fps", type=frame_rate, metavar="F", help="frames per second of the result (default: the source's)"
    )
    parser.add_argument("--smooth", type=cutoff, nargs="?", const=CUTOFF, metavar="HZ", help=SMOOTH_HELP)


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """Match the joints, write the motion on the target, and print both.

    Raises:
        InputError: a file that cannot be read, or a rig that is not recognised.
    """
    out = Path(options.out)
    suffix = ".bvh"
    if options.to not in _OWN:
        existing_file(options.to)
        if Path(options.to).suffix.lower() in SUFFIXES:
            suffix = character_suffix(options.to)
    if out.suffix.lower() != suffix:
        raise InputError(f"{out}: not written: a {suffix[1:].upper()} file's name ends in {suffix}.")
    existing_file(options.source)
    writable_file(options.out)

    from a2g_jax.geometry.mirror import mirror
    from a2g_jax.geometry.motion import resample
    from a2g_jax.geometry.retarget import (
        body_skeleton,
        find_rig,
        match_rigs,
        retarget,
        upper_body_rig,
        with_relaxed_hands,
    )
    from a2g_jax.geometry.retarget.calibration import calibration_frames
    from a2g_jax.geometry.smooth import smooth
    from a2g_jax.io.bvh import read_bvh, write_bvh
    from a2g_jax.io.bvh_character import BvhCharacter
    from a2g_jax.io.character import Character, read_character

    source_path = Path(options.source)
    motion = read_bvh(source_path)
    source = find_rig(motion, name=str(source_path))
    character: Character | None = None
    if options.to in _OWN:
        target = find_rig(body_skeleton(source), name="body") if options.to == "body" else upper_body_rig(source)
    else:
        character = read_character(options.to) if suffix != ".bvh" else BvhCharacter(options.to)
        target = character.rig
    match = match_rigs(source, target)
    if options.fingers == "relaxed":
        match = with_relaxed_hands(match)
    moved = mirror(motion, source) if options.mirror else motion
    moved = retarget(moved, match)
    if options.smooth is not None:
        moved = smooth(moved, options.smooth, calibration_frames(motion))
    moved = moved if options.fps is None else resample(moved, options.fps)
    errors: dict[str, float] = {}
    if character is None:
        write_bvh(out, moved)
    else:
        errors = character.write(out, moved)
    print(match.table())
    for doubt in match.warnings():
        print(f"warning: {doubt}.")
    print(f"{out}: {moved.frames} frames of {moved.skeleton.joints} joints at {moved.fps:g} fps")
    for joint, degrees in errors.items():
        print(f"{joint} has too few rotation channels in the target: off by up to {degrees:.1f} degrees")
