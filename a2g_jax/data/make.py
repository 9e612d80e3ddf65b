"""Whole corpora, with progress: generated, or from a folder of recordings."""

import os
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.folder import find_pairs, read_pair
from a2g_jax.data.generated import TalkerOptions, generate_rows
from a2g_jax.data.on_demand import OnDemand, split_roles
from a2g_jax.data.prepare import Item, Plan, prepare_corpus
from a2g_jax.data.rows import Prepared, prepare_recording
from a2g_jax.data.workers import in_order, worker_pool
from a2g_jax.features.mel import MelConfig
from a2g_jax.geometry.body import find_body
from a2g_jax.progress import progress_bar, say


def prepare_talker(
    out: str | os.PathLike[str],
    options: TalkerOptions,
    *,
    workers: int | None = None,
    on_demand: OnDemand | None = None,
) -> Corpus:
    """A generated corpus; the same for any number of workers.

    Args:
        workers: processes that generate; one for every core if None.
        on_demand: store only a first part, and leave the rest of the training recordings to be generated in training.

    Raises:
        InputError: the folder exists, or there are too few minutes.
        Interrupted: by Ctrl-C; the same call goes on.
    """
    mel = MelConfig()
    roles, parts, recipe = options.roles(), {}, options.recipe()
    if on_demand is None:
        recipe["roles"] = roles
    else:
        parts = split_roles(options, roles, on_demand)
        roles, recipe = parts["stored"], {**recipe, **on_demand.recipe()}
    generate = partial(generate_rows, fps=options.fps, jitter=options.jitter, fingers=options.fingers, mel=mel)
    items = [Item(role["name"], ()) for role in roles]
    make = partial(_make, "generating", generate, roles, workers)
    return prepare_corpus(out, items, make, Plan(options.fps, mel, recipe, options.seed, parts), say)


def prepare_folder(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    seed: int,
    fps: float,
    joints: str,
    workers: int | None = None,
) -> Corpus:
    """A corpus from the user's own WAV and BVH files; ``joints`` as in :func:`prepare_recording`.

    Raises:
        InputError: the folder exists, or something is wrong with the recordings.
        Interrupted: by Ctrl-C; the same call goes on.
    """
    mel = MelConfig()
    pairs = find_pairs(source)
    read = partial(_read_rows, source=Path(source), fps=fps, mel=mel, joints=joints)
    items = [Item(_name(bvh, Path(source)), (str(audio), str(bvh))) for audio, bvh in pairs]
    recipe = {"reader": "folder", "source": os.fspath(source), "seed": seed, "joints": joints}

    def make(done: int) -> Generator[Prepared, None, None]:
        for number, prepared in enumerate(_make("preparing", read, pairs, workers, done), done):
            if number == 0:
                say(_joints_line(prepared, joints))
            yield prepared

    return prepare_corpus(out, items, make, Plan(fps, mel, recipe, seed), say)


def _make(
    what: str, work: Callable[[Any], Prepared], inputs: Sequence[Any], workers: int | None, done: int
) -> Generator[Prepared, None, None]:
    """Rows of the inputs after those that are done, in order, with progress."""
    rest = inputs[done:]
    # Starting a process costs as much as a few recordings.
    count = min(os.cpu_count() or 1, len(rest) // 4) if workers is None else min(workers, len(rest))
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar(len(inputs), what, "recording"))
        # What was done before does not count for the rate.
        bar.initial = bar.n = done
        rows: Iterable[Prepared] = map(work, rest)
        if count > 1:
            pool = stack.enter_context(worker_pool(count, "the same command goes on, with fewer --workers if need be"))
            rows = in_order(pool, work, rest, 2 * count + 2)
        for prepared in rows:
            yield prepared
            bar.update()


def _read_rows(pair: tuple[Path, Path], source: Path, fps: float, mel: MelConfig, joints: str) -> Prepared:
    audio, bvh = pair
    return prepare_recording(read_pair(audio, bvh, mel.sample_rate, _name(bvh, source)), fps, mel, joints)


def _name(bvh: Path, source: Path) -> str:
    return bvh.relative_to(source).with_suffix("").as_posix()


def _joints_line(prepared: Prepared, joints: str) -> str:
    count = prepared.skeleton.joints
    if joints == "all":
        return f"training on all {count} joints of the rig"
    if find_body(prepared.skeleton) is not None:
        return "found the 22 body joints by name; fingers and other joints are left out (--joints all keeps them)"
    return f"the 22 body joints cannot all be found by name: training on all {count} joints of the rig"
