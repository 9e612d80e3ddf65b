"""Preparation of a whole corpus with a progress bar: generated, or from the recordings of a data set."""

import os
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from a2g_jax.data.body_json import skeleton_to_json
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
from a2g_jax.geometry.skeleton import Skeleton
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
    """Write a generated corpus; the same for any number of workers.

    Args:
        features: audio features, and the representation of rotations where the view has them; the frame rate and
            other poses are those of the options.
        workers: number of processes; one for every core if None.
        on_demand: store only a first part of the training recordings; the rest is generated during training.

    Raises:
        InputError: the folder exists, or there are too few minutes.
        Interrupted: by Ctrl-C; the same call resumes.
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
    """Representations of the poses of a view of the talker, the default first."""
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
    skeleton: Skeleton | None = None,
) -> Corpus:
    """Write a corpus from recordings on disk, in any layout that :mod:`a2g_jax.data.datasets` reads.

    Args:
        name: of the data set, as for :func:`~a2g_jax.data.datasets.find_data_set`.
        source: its folder.
        seed: of the split, where the data set has no official one.
        official: use the official split.
        skip_broken: leave out recordings that cannot be prepared, and note them in the manifest.
        limit: largest number of recordings, spread evenly over all.
        workers: number of processes; one for every core if None.
        skeleton: the body to retarget every recording to, such as that of a run that is to be fine-tuned.

    Raises:
        InputError: the folder exists, the source has another layout, or a recording cannot be prepared.
        Interrupted: by Ctrl-C; the same call resumes.
    """
    reader, folder = find_data_set(name), Path(source)
    takes = reader.find(folder)
    if limit is not None and limit < len(takes):
        takes = [takes[number * len(takes) // limit] for number in range(limit)]
    if official and takes and all(take.split in ("validation", "test") for take in takes):
        raise InputError(
            f"{folder}: all {len(takes)} recordings are for validation and testing in the official split, none for"
            " training; add training recordings, or split by the seed with --random-split."
        )
    read = partial(_read_rows, name=name, features=features, skip_broken=skip_broken, skeleton=skeleton)
    items = [Item(take.name, take.sources) for take in takes]
    recipe: dict[str, Any] = {"reader": name, "source": os.fspath(source), "seed": seed, "limit": limit}
    if skeleton is not None:
        recipe["body"] = skeleton_to_json(skeleton)
    plan = Plan(features, recipe, seed, official=official, skip_broken=skip_broken)
    return prepare_corpus(out, items, partial(_make, "preparing", read, takes, workers), plan, say)


def _make(
    what: str, work: Callable[[Any], Prepared | Skipped], inputs: Sequence[Any], workers: int | None, done: int
) -> Generator[Prepared | Skipped, None, None]:
    """Rows of the inputs after the finished ones, in order, with a progress bar."""
    rest = inputs[done:]
    # Starting a process costs as much as a few recordings.
    count = min(os.cpu_count() or 1, len(rest) // 4) if workers is None else min(workers, len(rest))
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar(len(inputs), what, "recording"))
        # Recordings finished before do not count for the rate.
        bar.initial = bar.n = done
        rows: Iterable[Prepared | Skipped] = map(work, rest)
        if count > 1:
            pool = stack.enter_context(
                worker_pool(count, "run the same command to resume, with fewer --workers if necessary")
            )
            rows = in_order(pool, work, rest, 2 * count + 2)
        for prepared in rows:
            yield prepared
            bar.update()


def _read_rows(
    take: Take, name: str, features: Features, skip_broken: bool, skeleton: Skeleton | None
) -> Prepared | Skipped:
    try:
        recording = find_data_set(name).read(take, features.mel.sample_rate)
        # In a corpus a recording has the name and the files of its take.
        recording = replace(recording, name=take.name, sources=take.sources)
        return prepare_recording(recording, features, take.split, skeleton)
    except InputError as error:
        if not skip_broken:
            raise
        return Skipped(take.name, take.sources, str(error))
