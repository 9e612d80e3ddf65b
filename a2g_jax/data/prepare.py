"""Whole corpora, with progress: generated, or from the recordings of a data set."""

import os
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_writer import Item, Plan, prepare_corpus
from a2g_jax.data.datasets import Take, find_data_set
from a2g_jax.data.featurise import Prepared, Skipped, prepare_recording
from a2g_jax.data.generated import TalkerOptions, generate_rows
from a2g_jax.data.on_demand import OnDemand, split_roles
from a2g_jax.data.settings import Features
from a2g_jax.data.workers import in_order, worker_pool
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_space import interchangeable
from a2g_jax.progress import progress_bar, say
from a2g_jax.talker.views.catalogue import find_view


def prepare_talker(
    out: str | os.PathLike[str],
    options: TalkerOptions,
    features: Features | None = None,
    *,
    workers: int | None = None,
    on_demand: OnDemand | None = None,
) -> Corpus:
    """A generated corpus; the same for any number of workers.

    Args:
        features: how audio is looked at, and how rotations are written down where the view has them; the rate and
            other poses are those of the options.
        workers: processes that generate; one for every core if None.
        on_demand: store only a first part, and leave the rest of the training recordings to be generated in training.

    Raises:
        InputError: the folder exists, or there are too few minutes.
        Interrupted: by Ctrl-C; the same call goes on.
    """
    features, poses = features or Features(), view_poses(options.view)
    pose = features.pose if features.pose in poses else poses[0]
    features = replace(features, fps=options.fps, pose=pose, joints="all")
    roles, parts, recipe = options.roles(), {}, options.recipe()
    if on_demand is None:
        recipe["roles"] = roles
    else:
        parts = split_roles(options, roles, on_demand)
        roles, recipe = parts["stored"], {**recipe, **on_demand.recipe()}
    generate = partial(
        generate_rows, jitter=options.jitter, fingers=options.fingers, view=options.view, features=features
    )
    items = [Item(role["name"], ()) for role in roles]
    make = partial(_make, "generating", generate, roles, workers)
    return prepare_corpus(out, items, make, Plan(features, recipe, options.seed, parts), say)


def view_poses(view: str) -> tuple[str, ...]:
    """How the poses of a view of the talker can be written down, the usual way first."""
    pose = find_view(view).pose
    return interchangeable(pose)


def prepare_data_set(
    name: str,
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    features: Features,
    *,
    seed: int = 0,
    official: bool = True,
    skip_broken: bool = False,
    limit: int | None = None,
    workers: int | None = None,
) -> Corpus:
    """A corpus from recordings on disk, in any of the layouts that :mod:`a2g_jax.data.datasets` reads.

    Args:
        name: of the data set.
        source: its folder.
        seed: of the split, where the data set's authors made none.
        official: keep to the authors' split.
        skip_broken: note recordings that cannot be prepared in the manifest and leave them out.
        limit: take only so many recordings, spread evenly over all.
        workers: processes that prepare; one for every core if None.

    Raises:
        InputError: the folder exists, the source is not laid out so, or something is wrong with a recording.
        Interrupted: by Ctrl-C; the same call goes on.
    """
    reader, folder = find_data_set(name), Path(source)
    takes = reader.find(folder)
    if limit is not None and limit < len(takes):
        takes = [takes[number * len(takes) // limit] for number in range(limit)]
    if official and takes and all(take.split in ("validation", "test") for take in takes):
        raise InputError(
            f"{folder}: by the authors' split all {len(takes)} recordings are for testing and validation, none for"
            " training; add training recordings, or split by the seed with --random-split."
        )
    read = partial(_read_rows, name=name, features=features, skip_broken=skip_broken)
    items = [Item(take.name, take.sources) for take in takes]
    recipe = {"reader": name, "source": os.fspath(source), "seed": seed, "limit": limit}
    plan = Plan(features, recipe, seed, official=official, skip_broken=skip_broken)
    return prepare_corpus(out, items, partial(_make, "preparing", read, takes, workers), plan, say)


def _make(
    what: str, work: Callable[[Any], Prepared | Skipped], inputs: Sequence[Any], workers: int | None, done: int
) -> Generator[Prepared | Skipped, None, None]:
    """Rows of the inputs after those that are done, in order, with progress."""
    rest = inputs[done:]
    # Starting a process costs as much as a few recordings.
    count = min(os.cpu_count() or 1, len(rest) // 4) if workers is None else min(workers, len(rest))
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar(len(inputs), what, "recording"))
        # What was done before does not count for the rate.
        bar.initial = bar.n = done
        rows: Iterable[Prepared | Skipped] = map(work, rest)
        if count > 1:
            pool = stack.enter_context(worker_pool(count, "the same command goes on, with fewer --workers if need be"))
            rows = in_order(pool, work, rest, 2 * count + 2)
        for prepared in rows:
            yield prepared
            bar.update()


def _read_rows(take: Take, name: str, features: Features, skip_broken: bool) -> Prepared | Skipped:
    try:
        recording = find_data_set(name).read(take, features.mel.sample_rate)
        # A corpus knows a recording by the name and the files of its take.
        recording = replace(recording, name=take.name, sources=take.sources)
        return prepare_recording(recording, features, take.split)
    except InputError as error:
        if not skip_broken:
            raise
        return Skipped(take.name, take.sources, str(error))
