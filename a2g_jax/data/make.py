"""Whole corpora, with progress: generated, or from a folder of recordings."""

import os
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.folder import find_pairs, read_pair
from a2g_jax.data.prepare import Prepared, prepare_recording, refuse_existing, write_corpus
from a2g_jax.data.talker.recordings import cast, talk
from a2g_jax.features.mel import MelConfig
from a2g_jax.geometry.body import find_body
from a2g_jax.progress import counted, progress_bar, say


def prepare_talker(out: str | os.PathLike[str], minutes: float, seed: int, fps: float) -> Corpus:
    """A generated corpus of so many minutes; recordings are made on all cores and come in order."""
    mel = MelConfig()
    roles = cast(minutes, seed)
    workers = min(os.cpu_count() or 1, len(roles) // 4)
    make = partial(_generate_recording, fps=fps, mel=mel)
    recipe = {"reader": "talker", "minutes": minutes, "seed": seed, "roles": roles}
    refuse_existing(Path(out))
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar(len(roles), "generating", "recording"))
        rows: Iterable[Prepared] = map(make, roles)
        if workers > 1:  # starting a process costs as much as a few recordings
            pool = stack.enter_context(ProcessPoolExecutor(workers, mp_context=get_context("spawn")))
            rows = pool.map(make, roles)
        return write_corpus(out, counted(rows, bar), fps=fps, mel=mel, recipe=recipe, seed=seed, report=say)


def _generate_recording(role: dict[str, Any], fps: float, mel: MelConfig) -> Prepared:
    return prepare_recording(talk(**role, fps=fps, sample_rate=mel.sample_rate), fps, mel)


def prepare_folder(
    source: str | os.PathLike[str], out: str | os.PathLike[str], seed: int, fps: float, joints: str
) -> Corpus:
    """A corpus from the user's own WAV and BVH files; ``joints`` as in :func:`prepare_recording`."""
    mel = MelConfig()
    pairs = find_pairs(source)

    def rows() -> Iterator[Prepared]:
        for audio, bvh in pairs:
            name = bvh.relative_to(source).with_suffix("").as_posix()
            prepared = prepare_recording(read_pair(audio, bvh, mel.sample_rate, name), fps, mel, joints)
            if audio is pairs[0][0]:
                say(_joints_line(prepared, joints))
            yield prepared

    recipe = {"reader": "folder", "source": os.fspath(source), "seed": seed, "joints": joints}
    refuse_existing(Path(out))
    with progress_bar(len(pairs), "preparing", "recording") as bar:
        return write_corpus(out, counted(rows(), bar), fps=fps, mel=mel, recipe=recipe, seed=seed, report=say)


def _joints_line(prepared: Prepared, joints: str) -> str:
    count = prepared.skeleton.joints
    if joints == "all":
        return f"training on all {count} joints of the rig"
    if find_body(prepared.skeleton) is not None:
        return "found the 22 body joints by name; fingers and other joints are left out (--joints all keeps them)"
    return f"the 22 body joints cannot all be found by name: training on all {count} joints of the rig"
