"""What ``a2g retarget`` does; its flags are in :mod:`a2g_jax.generation.retarget_arguments`."""

import argparse
from pathlib import Path

from a2g_jax.errors import InputError
from a2g_jax.geometry.mirror import mirror
from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.retarget import body_skeleton, find_rig, match_rigs, retarget, upper_body_skeleton
from a2g_jax.io.bvh import read_bvh, read_with_layout, write_bvh, write_like

_OWN = {"body": body_skeleton, "upper-body": upper_body_skeleton}
_LOWEST, _HIGHEST = 1.0, 1000.0


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """``a2g retarget``: prints what was matched, and writes the motion on the target.

    Raises:
        InputError: a file cannot be read, or a rig in it is not understood.
    """
    source_path, out = Path(options.source), Path(options.out)
    if options.fps is not None and not _LOWEST <= options.fps <= _HIGHEST:
        raise InputError(f"--fps: expected a number from {_LOWEST:g} to {_HIGHEST:g}; got {options.fps:g}.")
    if out.suffix.lower() != ".bvh":
        raise InputError(f"{out}: not written: a BVH file's name ends in .bvh.")
    motion = read_bvh(source_path)
    source = find_rig(motion, name=str(source_path))
    layout = None
    if options.to in _OWN:
        target = find_rig(_OWN[options.to](source), name=options.to)
    else:
        seen, layout = read_with_layout(Path(options.to))
        target = find_rig(seen, name=options.to)
    match = match_rigs(source, target)
    moved = mirror(motion, source) if options.mirror else motion
    moved = retarget(moved, match)
    moved = moved if options.fps is None else resample(moved, options.fps)
    missed: dict[str, float] = {}
    if layout is None:
        write_bvh(out, moved)
    else:
        missed = write_like(out, moved, layout)
    print(match.table())
    print(f"{out}: {moved.frames} frames of {moved.skeleton.joints} joints at {moved.fps:g} fps")
    for joint, degrees in missed.items():
        print(f"{joint} has too few rotation channels in the target: off by up to {degrees:.1f} degrees")
