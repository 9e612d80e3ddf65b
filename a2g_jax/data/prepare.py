"""Preparation of a whole corpus with a progress bar: generated, or from the recordings of a data set."""

import os
import warnings
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from a2g_jax.data.body_json import skeleton_to_json
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_writer import Item, Plan, prepare_corpus
from a2g_jax.data.datasets import LabelRule, Take, find_data_set
from a2g_jax.data.datasets.cut import cut
from a2g_jax.data.emotion_table import labelled_takes, read_table
from a2g_jax.data.featurise import Prepared, Skipped, prepare_recording
from a2g_jax.data.generated import TalkerOptions, generate_rows
from a2g_jax.data.on_demand import OnDemand, split_roles
from a2g_jax.data.settings import Features
from a2g_jax.data.workers import in_order, worker_pool
from a2g_jax.errors import InputError, InputWarning
from a2g_jax.features.speech_likeness import why_no_speech
from a2g_jax.geometry.pose_rows import interchangeable
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.files import sha256_file
from a2g_jax.io.reading import reading
from a2g_jax.progress import progress_bar, say
from a2g_jax.recording import PoseRecording, Recording
from a2g_jax.talker.views.catalogue import find_view

Result = TypeVar("Result")


class Work(NamedTuple):
    """The recordings of a corpus that is to be written, in order."""

    what: str
    """For the progress bar, such as ``"preparing"``."""
    items: list[Item]
    inputs: list[Any]
    """What each is made of."""
    make: Callable[[Any], Any]
    """From one of ``inputs`` to rows; processes can import it."""
    plan: Plan

    def maker(self, workers: int | None) -> Callable[[int], Generator[Prepared | Skipped, None, None]]:
        """Rows of the recordings after those that are finished; see :func:`make_rows`."""
        return partial(make_rows, self.what, self.make, self.inputs, workers)


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
    return prepare_work(out, talker_work(options, features, on_demand), workers)


def talker_work(options: TalkerOptions, features: Features | None = None, on_demand: OnDemand | None = None) -> Work:
    """The work of :func:`prepare_talker`, recording by recording."""
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
    return Work("generating", items, roles, generate, Plan(features, recipe, options.seed, parts))


def prepare_work(out: str | os.PathLike[str], work: Work, workers: int | None = None) -> Corpus:
    """Write a corpus; see :func:`prepare_talker` and :func:`prepare_data_set`."""
    return prepare_corpus(out, work.items, work.maker(workers), work.plan, say)


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
    workers: int | None = None,
    **choices: Any,
) -> Corpus:
    """Write a corpus from recordings on disk, in any layout that :mod:`a2g_jax.data.datasets` reads.

    Args:
        name: see :func:`data_set_work`, as for ``source`` and ``choices``.
        workers: number of processes; one for every core if None.

    Raises:
        InputError: the folder exists, the source has another layout, or a recording cannot be prepared.
        Interrupted: by Ctrl-C; the same call resumes.
    """
    return prepare_work(out, data_set_work(name, source, features, **choices), workers)


def data_set_work(
    name: str,
    source: str | os.PathLike[str],
    features: Features,
    *,
    seed: int = 0,
    official: bool = True,
    skip_broken: bool = False,
    limit: int | None = None,
    labels: str | os.PathLike[str] | None = None,
    confidence: float | None = None,
    labelled: bool = False,
    skeleton: Skeleton | None = None,
    channel: int | None = None,
    tier: str | None = None,
    smooth: float | None = None,
) -> Work:
    """The work of :func:`prepare_data_set`, recording by recording.

    Args:
        name: of the data set, as for :func:`~a2g_jax.data.datasets.find_data_set`.
        source: its folder.
        seed: of the split, where the data set has no official one.
        official: use the official split.
        skip_broken: leave out recordings that cannot be prepared, and note them in the manifest.
        limit: largest number of recordings, spread evenly over all.
        labels: table of emotions by window (:mod:`a2g_jax.data.emotion_table`); the corpus then has the pieces of
            recordings in which an emotion is sure. Some data sets bring their own.
        confidence: least probability of a window's emotion in the table; of the data set, or 0.9, if None.
        labelled: leave out recordings without an emotion, and note them in the manifest.
        skeleton: the body to retarget every recording to, such as that of a run that is to be fine-tuned.
        channel: of audio files with several, from 1 on; the mean of all if None.
        tier: of TextGrids with several, or the speaker it is of; the first one of words if None.
        smooth: frequency in Hz above which motions are filtered (:func:`~a2g_jax.geometry.smooth.smooth`); None: not.

    Raises:
        InputError: the source has another layout.
    """
    reader, folder = find_data_set(name), Path(source)
    takes = reader.find(folder)
    if limit is not None and limit < len(takes):
        takes = [takes[number * len(takes) // limit] for number in range(limit)]
    recipe: dict[str, Any] = {"reader": name, "source": os.fspath(source), "seed": seed, "limit": limit}
    takes = _pieces(takes, reader.labels, folder, labels, confidence, recipe)
    if official and takes and all(take.split in ("validation", "test") for take in takes):
        raise InputError(
            f"{folder}: all {len(takes)} recordings are for validation and testing in the official split, none for"
            " training; add training recordings, or split by the seed with --random-split."
        )
    if labelled:
        recipe["labelled"] = True
    recipe |= {name: value for name, value in (("channel", channel), ("tier", tier)) if value is not None}
    if skeleton is not None:
        recipe["body"] = skeleton_to_json(skeleton)
    if smooth is not None:
        recipe["smooth"] = smooth
    read = partial(
        _read_rows,
        name=name,
        features=features,
        skip_broken=skip_broken,
        labelled=labelled,
        skeleton=skeleton,
        channel=channel,
        tier=tier,
        smooth=smooth,
    )
    items = [Item(take.name, take.sources) for take in takes]
    groups = {take.name: take.group for take in takes if take.group}
    plan = Plan(features, recipe, seed, official=official, groups=groups, skip_broken=skip_broken)
    return Work("preparing", items, takes, read, plan)


def _pieces(
    takes: list[Take],
    rule: LabelRule | None,
    folder: Path,
    labels: str | os.PathLike[str] | None,
    confidence: float | None,
    recipe: dict[str, Any],
) -> list[Take]:
    """The labelled pieces of takes, where there is a table of emotions; it becomes part of the recipe."""
    if rule is None and labels is None:
        if confidence is not None:
            raise InputError("--confidence is for tables of emotions; add --labels TABLE (see 'a2g label').")
        return takes
    rule = rule or LabelRule()
    rule = rule if confidence is None else replace(rule, confidence=confidence)
    table = Path(labels) if labels is not None else folder / rule.table
    if labels is None and not table.is_file():
        raise InputError(
            f"{table}: there is no such table of emotions; make it with 'a2g label', or name one with --labels."
        )
    found = labelled_takes(takes, read_table(table), rule, table)
    say(f"{table}: {found.describe()}")
    recipe["labels"] = {
        "table": os.fspath(table),
        "sha256": sha256_file(table),
        "confidence": rule.confidence,
        "emotions": list(rule.emotions),
        **{name: getattr(found, name) for name in ("windows", "kept", "doubtful", "contested", "unlabelled")},
        "other": dict(found.other),
    }
    return list(found.takes)


def make_rows(
    what: str, work: Callable[[Any], Result], inputs: Sequence[Any], workers: int | None, done: int
) -> Generator[Result, None, None]:
    """Results of the inputs after the finished ones, in order, with a progress bar.

    Args:
        what: for the bar, such as ``"preparing"``.
        work: a function that processes can import, of one input.
        workers: number of processes; one for every core if None.
        done: number of inputs that are finished.
    """
    rest = inputs[done:]
    # Starting a process costs as much as a few recordings.
    count = min(os.cpu_count() or 1, len(rest) // 4) if workers is None else min(workers, len(rest))
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar(len(inputs), what, "recording"))
        # Recordings finished before do not count for the rate.
        bar.initial = bar.n = done
        rows: Iterable[Result] = map(work, rest)
        if count > 1:
            pool = stack.enter_context(
                worker_pool(count, "run the same command to resume, with fewer --workers if necessary")
            )
            rows = in_order(pool, work, rest, 2 * count + 2)
        for prepared in rows:
            for note in getattr(prepared, "notes", ()):
                say(note)
            yield prepared
            bar.update()


def read_take(take: Take, name: str, sample_rate: int) -> Recording | PoseRecording:
    """A recording of a data set, or the labelled piece of it, with the name and the files of its take.

    Args:
        name: of the data set.
    """
    recording = replace(find_data_set(name).read(take, sample_rate), name=take.name, sources=take.sources)
    if take.piece is None:
        return recording
    piece = take.piece
    annotations = {**recording.annotations, "piece": {"from": piece.start, "confidence": piece.confidence}}
    return replace(cut(recording, piece.start, piece.end), emotion=piece.emotion, annotations=annotations)


def _read_rows(
    take: Take,
    name: str,
    features: Features,
    skip_broken: bool,
    labelled: bool,
    skeleton: Skeleton | None,
    channel: int | None = None,
    tier: str | None = None,
    smooth: float | None = None,
) -> Prepared | Skipped:
    try:
        # Doubts about a file are shown by the process that has the progress bar.
        with reading(channel, tier) as choices, warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always", InputWarning)
            recording = read_take(take, name, features.mel.sample_rate)
        if labelled and not recording.emotion:
            return Skipped(take.name, take.sources, f"{take.sources[0]}: has no emotion label.")
        if reason := why_no_speech(recording.audio, recording.sample_rate):
            choices.notes.append(f"{take.sources[0]}: no speech is found: {reason}.")
        prepared = prepare_recording(recording, features, take.split, skeleton, smooth)
    except InputError as error:
        if not skip_broken:
            raise
        return Skipped(take.name, take.sources, str(error))
    doubts = tuple(str(one.message) for one in found if issubclass(one.category, InputWarning))
    return replace(prepared, notes=(*choices.notes, *doubts, *prepared.notes))
