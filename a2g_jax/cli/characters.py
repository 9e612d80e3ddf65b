"""Flags of ``a2g generate`` for a character, and for the frame rate, unit and axes of files."""

import argparse
from typing import TYPE_CHECKING

from a2g_jax.cli.argument_types import frame_rate
from a2g_jax.cli.paths import existing_file
from a2g_jax.errors import InputError
from a2g_jax.generation.formats import format_names
from a2g_jax.io.character import character_suffix

if TYPE_CHECKING:
    from a2g_jax.generation.delivery import Delivery
    from a2g_jax.training.run import Run

#: Directions of ``--facing``.
DIRECTIONS = ("+z", "-z", "+x", "-x")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--to``, ``--fps``, ``--scale``, ``--facing`` and ``--fingers``."""
    group = parser.add_argument_group("my character, my program (docs/character.md)")
    group.add_argument(
        "--to",
        metavar="CHARACTER",
        help="a BVH, GLB or VRM file of a humanoid: every sample is written for its rig, a BVH in the layout of that"
        " file, or the GLB itself with the motion as an animation, in place of the BVH of the run's skeleton",
    )
    group.add_argument(
        "--fps", type=frame_rate, metavar="F", help="frames per second of the files (default: the run's)"
    )
    group.add_argument(
        "--scale",
        choices=("auto", "cm", "m"),
        default="auto",
        help="unit of BVH files (default: auto, the character's own; centimetres without one)",
    )
    group.add_argument(
        "--facing",
        choices=DIRECTIONS,
        metavar="+z|-z|+x|-x",
        help="where the figure faces in files without a character, with y up (default: +z)",
    )
    group.add_argument(
        "--fingers",
        choices=("relaxed", "none"),
        help="fingers of the character that the run does not move: relaxed (default), or none, as in its rest pose",
    )


def check(options: argparse.Namespace) -> None:
    """Refuse a character that does not exist or is of another kind, and flags that do not fit; set ``options.formats``
    where none were requested. Nothing heavy is imported.

    Raises:
        InputError: such a flag or file.
    """
    names = format_names()
    if options.to is not None:
        suffix = character_suffix(options.to)
        existing_file(options.to)
        if options.facing is not None:
            raise InputError("--facing is for files without a character, which keeps its own axes; leave one out.")
        names = (suffix.removeprefix("."), *names[1:])
    elif options.fingers is not None:
        raise InputError("--fingers is for the fingers of a character; name it with --to.")
    if options.formats is None:
        options.formats = names


def delivery(options: argparse.Namespace) -> "Delivery":
    """How the flags of a command write motions.

    Raises:
        InputError: a character that cannot be read or has no human body.
    """
    from a2g_jax.generation.delivery import Delivery
    from a2g_jax.io.character import UNITS, read_character

    return Delivery(
        character=None if options.to is None else read_character(options.to, options.scale),
        fps=options.fps,
        fingers=options.fingers != "none",
        scale=1 / UNITS.get(options.scale, UNITS["cm"]),
        direction=options.facing or DIRECTIONS[0],
    )


def lines(made: "Delivery", run: "Run") -> list[str]:
    """How the joints of a run move the character, and what is doubtful; empty without one.

    Raises:
        InputError: the run and the character have no arm in common.
    """
    match = made.match(run.config.skeleton)
    if match is None or made.character is None:
        return []
    rig = match.target
    moved = {pair.target for pair in match.pairs} | {share.target for share in match.shares}
    fingers = [joint for role, joint in rig.roles.items() if role[-1:] in "123" and joint not in moved]
    text = f"{made.character.path}: {len(moved)} of {rig.skeleton.joints} joints move"
    if fingers:
        text += f", {len(fingers)} of fingers are {'relaxed' if match.still is not None else 'as in the rest pose'}"
    doubts = [*made.character.notes(), *match.warnings()]
    return [f"{text}; 'a2g retarget' prints which", *(f"warning: {doubt}." for doubt in doubts)]
