"""``a2g prepare``: a corpus from recordings, or a generated one."""

import argparse
import dataclasses
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from a2g_jax.cli.paths import existing_file, existing_folder, existing_run, writable_folder
from a2g_jax.cli.prepare_flags import add_arguments as add_arguments
from a2g_jax.data.data_set_names import NAMES
from a2g_jax.errors import InputError

if TYPE_CHECKING:
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.data.generated import TalkerOptions
    from a2g_jax.data.prepare import Work
    from a2g_jax.data.settings import Features
    from a2g_jax.geometry.skeleton import Skeleton

DESCRIPTION = "Make a corpus from recordings, or generate one. Interruptible: the same command resumes."
#: The generated corpus, and the data sets of this package.
READERS = ("talker", *NAMES)
#: Flags that only generated corpora have, and those that only recorded ones have.
_GENERATED = (
    *("minutes", "speakers", "emotions", "languages", "equal_emotions"),
    *("jitter", "fingers", "view", "on_demand"),
)
_RECORDED = (
    *("source", "joints", "random_split", "skip_broken", "limit", "labels", "confidence", "labelled", "for_run"),
    *("channel", "tier", "smooth"),
)
#: Flags that a run decides with ``--for``.
_OF_RUN = ("features", "fps", "pose", "joints")


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """Prepare or generate the corpus, and print its size.

    Raises:
        InputError: flags that exclude each other, an unknown name, or a source or folder that cannot be used.
    """
    if options.list:
        _list_data_sets()
        return
    if options.merge is not None:
        print(_summary(_merged(options)))
        return
    if options.reader is None:
        raise InputError("name what to prepare: 'a2g prepare talker', or a data set ('a2g prepare --list').")
    if options.out is None:
        raise InputError("--out is needed: the folder to make.")
    writable_folder(str(Path(options.out).parent))
    if options.shard is not None:
        from a2g_jax.data.shards import Share, prepare_shard

        share = Share.parse(options.shard)
    work = _generated(options) if options.reader == "talker" else _recorded(options)
    if options.shard is not None:
        made = prepare_shard(options.out, work, share, options.workers)
        print(
            f"{made.path}: shard {options.shard}, {made.recordings} recordings, {made.seconds / 60:.1f} minutes; when"
            " all are there: a2g prepare --merge SHARD ... --out CORPUS"
        )
        return

    from a2g_jax.data.prepare import prepare_work

    corpus = prepare_work(options.out, work, options.workers)
    print(_summary(corpus))
    if corpus.on_demand:
        roles = [role for part in corpus.later["parts"] for role in part]
        minutes = sum(role["seconds"] for role in roles) / 60
        print(
            f"{len(roles)} more training recordings, {minutes:.1f} minutes in {corpus.parts - 1} parts, are generated"
            " in training (a2g train --part-steps: steps on each part)"
        )


def _summary(corpus: "Corpus") -> str:
    """Name, length and splits of a corpus in a line."""
    seconds = {name: sum(part.frames for part in parts) / corpus.fps for name, parts in corpus.splits.items()}
    return (
        f"{corpus.path}: {len(corpus.recordings)} recordings, {corpus.frames / corpus.fps / 60:.1f} minutes,"
        f" {corpus.space.rows} {corpus.space.noun} at {corpus.fps:g} fps ("
        + ", ".join(f"{name} {value:.0f} s" for name, value in seconds.items())
        + ")"
    )


def _merged(options: argparse.Namespace) -> "Corpus":
    """The corpus of all shards."""
    others = {name: value for name, value in vars(options).items() if name not in ("merge", "out", "command", "debug")}
    if any(value not in (None, False, 0) for value in others.values()):
        raise InputError("--merge: takes the folders of the shards and --out alone; their settings are in them.")
    if options.out is None:
        raise InputError("--out is needed: the folder to make.")
    for shard in options.merge:
        existing_folder(shard)
    writable_folder(str(Path(options.out).parent))

    from a2g_jax.data.shards import merge_shards

    return merge_shards(options.merge, options.out)


def _generated(options: argparse.Namespace) -> "Work":
    if options.source is not None:
        raise InputError("'a2g prepare talker' takes no source; it generates its recordings.")
    _refuse(options, _RECORDED, "recordings; a generated corpus has the joints of --view and --fingers.")

    from a2g_jax.data.on_demand import OnDemand
    from a2g_jax.data.prepare import talker_work, view_poses

    view = options.view or "body"
    if options.pose and options.pose not in view_poses(view):
        raise InputError(f"--pose {options.pose}: the view {view!r} shows {' or '.join(view_poses(view))}.")
    return talker_work(_talker_options(options, view), _features(options), OnDemand() if options.on_demand else None)


def _talker_options(options: argparse.Namespace, view: str) -> "TalkerOptions":
    speakers, emotions = _names("speakers", options.speakers), _names("emotions", options.emotions)
    languages = _names("languages", options.languages)

    from a2g_jax.data.generated import TalkerOptions
    from a2g_jax.data.settings import find_features
    from a2g_jax.talker.views.catalogue import find_view

    fps = options.fps or (find_features(options.features).fps if options.features else find_view(view).fps)
    return TalkerOptions(
        minutes=options.minutes or 30.0,
        seed=options.seed,
        fps=fps,
        speakers=speakers,
        emotions=emotions,
        languages=languages,
        equal_emotions=options.equal_emotions,
        jitter=options.jitter or 0.0,
        fingers=options.fingers,
        view=view,
    )


def _recorded(options: argparse.Namespace) -> "Work":
    if options.source is None:
        raise InputError(f"name the folder: a2g prepare {options.reader} SOURCE --out CORPUS.")
    _refuse(options, _GENERATED, "'a2g prepare talker'; recordings are prepared as they are.")
    if options.reader.endswith(".py"):
        existing_file(options.reader, "name a Python file that defines DATASET")
    existing_folder(options.source)
    existing_file(options.labels, "make it with 'a2g label'")
    existing_run(options.for_run)
    for name in _OF_RUN if options.for_run is not None else ():
        if getattr(options, name) is not None:
            raise InputError(f"--{name}: is decided by --for {options.for_run}; leave one of them out.")

    from a2g_jax.data.datasets import find_data_set
    from a2g_jax.data.prepare import data_set_work

    reader, skeleton = find_data_set(options.reader), None
    features = _features(options)
    if options.for_run is not None:
        features, skeleton = _of_run(options)
    elif options.features is None:
        features = dataclasses.replace(features, fps=options.fps or reader.fps, pose=options.pose or reader.pose)
    return data_set_work(
        options.reader,
        options.source,
        features,
        seed=options.seed,
        official=not options.random_split,
        skip_broken=options.skip_broken,
        limit=options.limit,
        labels=options.labels,
        confidence=options.confidence,
        labelled=options.labelled,
        skeleton=skeleton,
        channel=options.channel,
        tier=options.tier,
        smooth=options.smooth,
    )


def _of_run(options: argparse.Namespace) -> "tuple[Features, Skeleton | None]":
    """The features and the body of a run."""
    from a2g_jax.data.settings import Features
    from a2g_jax.training.run import open_run

    config = open_run(options.for_run).config
    space = config.space
    features = Features(config.fps, config.mel, space.kind, "all", options.waveform)
    return features, space.skeleton if space.has_rotations else None


def _features(options: argparse.Namespace) -> "Features":
    """The settings of a paper, changed by the flags."""
    from a2g_jax.data.settings import Features, find_features

    features = find_features(options.features) if options.features else Features()
    flags = {name: getattr(options, name) for name in ("fps", "pose", "joints", "waveform")}
    return dataclasses.replace(features, **{name: value for name, value in flags.items() if value})


def _refuse(options: argparse.Namespace, names: tuple[str, ...], reason: str) -> None:
    for name in names:
        if getattr(options, name) not in (None, False):
            raise InputError(f"--{name.removesuffix('_run').replace('_', '-')} is for {reason}")


def _names(flag: str, text: str | None) -> tuple[str, ...]:
    names = tuple(name.strip() for name in (text or "").split(",") if name.strip())
    if text is not None and not names:
        raise InputError(f"--{flag}: empty list; leave it out{'' if flag == 'languages' else ' for all'}.")
    return names


def _list_data_sets() -> None:
    from a2g_jax.data.datasets import data_set_lines
    from a2g_jax.data.settings import PRESETS

    for line, about in data_set_lines():
        print(line)
        if about:
            print(textwrap.indent(textwrap.fill(about, 96), "    "))
    print("talker: generated recordings with ground truth (see 'a2g talk')")
    print("\nfeatures of the papers (--features):")
    for name, features in PRESETS.items():
        mel = f"{features.mel.bands} mel bands" + (f" x {features.mel.stack}" if features.mel.stack > 1 else "")
        wave = ", waveform" if features.waveform else ""
        print(f"{name}: {features.fps:g} fps, {mel}, {features.pose}, joints: {features.joints}{wave}")
