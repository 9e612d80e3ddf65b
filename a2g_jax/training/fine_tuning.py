"""Training that starts from the weights of a run: what is adapted to the new recordings, and what is kept."""

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import jax
import numpy as np
from flax.traverse_util import flatten_dict

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.files import sha256_file
from a2g_jax.models.base import Model
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.run_config import Perceptual, Run, RunConfig, Source
from a2g_jax.training.run_file import WEIGHTS_FILE, run_folder
from a2g_jax.training.shapes import parameter_shapes

#: Standard deviation up to which a value of a run's poses counts as constant: the lower bound of a corpus's.
_CONSTANT = 0.01
#: Largest difference of joints' offsets, metres, of one body.
_SAME_BODY = 1e-4
#: Share at the end of every training recording that is held out where the validation split is too short for a clip.
_HELD_OUT = 0.2


@dataclass(frozen=True, eq=False)
class Start:
    """Where a training starts."""

    run: Run
    source: Source


def start_from(name: str | os.PathLike[str], run: Run) -> Start:
    """The start of a training from a run, as its run folder records it.

    Args:
        name: the folder of the run, or the name of a shipped one.
    """
    tuning = run.config.entry.fine_tuning
    return Start(
        run,
        Source(
            run=str(name),
            steps=run.steps,
            weights=sha256_file(run_folder(name) / WEIGHTS_FILE),
            corpus=str(run.config.corpus.get("fingerprint")),
            stages=tuning.stages,
            frozen=tuning.frozen,
            pose_statistics=tuning.pose_statistics,
            audio_statistics=tuning.audio_statistics,
            keep_constant=tuning.keep_constant,
            share=tuning.share,
            dynamics=tuning.dynamics,
        ),
    )


def tuned_config(
    start: Start, model_config: Any, train_config: TrainConfig, corpus: Corpus, perceptual: Perceptual | None = None
) -> RunConfig:
    """The description of a run that starts from another one: its body, rate and features, with adapted statistics.

    Raises:
        InputError: a corpus with other features or another body, or settings that change the networks.
    """
    source, run = start.source, start.run
    check_fits(source.run, run.config, corpus)
    about = RunConfig.of(run.config.model, run.config.preset, model_config, train_config, corpus, perceptual)
    config = replace(
        about,
        space=run.config.space,
        statistics=adapted_statistics(run.config.statistics, corpus.statistics, source),
        sampling=without_measured(run.config.sampling),
        body_extremes=run.config.body_extremes,
        source=source,
    )
    _check_networks(config, run, corpus)
    return config


def without_measured(sampling: Any) -> Any:
    """Sampling settings with the defaults of those that were measured on the run's weights, such as gains of controls.

    They are the fields whose metadata have ``measured``; each has a default value, not a factory.
    """
    if sampling is None:
        return None
    return replace(
        sampling, **{field.name: field.default for field in fields(sampling) if "measured" in field.metadata}
    )


def check_fits(name: str, config: RunConfig, corpus: Corpus) -> None:
    """Refuse a corpus whose features or body are not those of a run.

    Raises:
        InputError: the message has the command that prepares the recordings anew.
    """
    differences = []
    if corpus.fps != config.fps:
        differences.append(f"{corpus.fps:g} frames a second in place of {config.fps:g}")
    ours, theirs = asdict(corpus.mel), asdict(config.mel)
    differences += [f"{key} {ours[key]} in place of {theirs[key]}" for key in ours if ours[key] != theirs[key]]
    if corpus.space.kind != config.space.kind:
        differences.append(f"poses as {corpus.space.kind} in place of {config.space.kind}")
    elif not _same_body(corpus.space.body, config.space.body):
        differences.append("another body")
    if not differences:
        return
    recipe = corpus.recipe
    source = f" {recipe['source']}" if "source" in recipe else ""
    remedy = f"a2g prepare {recipe.get('reader', 'folder')}{source} --out CORPUS --for {name}"
    raise InputError(f"{corpus.path}: does not fit {name} ({'; '.join(differences)}); prepare it anew: {remedy}.")


def _same_body(ours: Any, theirs: Any) -> bool:
    if isinstance(ours, Skeleton) and isinstance(theirs, Skeleton):
        gap = np.abs(np.asarray(ours.offsets)[1:] - np.asarray(theirs.offsets)[1:]) if ours.same_tree(theirs) else None
        return gap is not None and bool(np.all(gap < _SAME_BODY))
    # Lengths of bones are those of the corpus; the rows have to mean the same.
    return type(ours) is type(theirs) and ours.names == theirs.names and ours.bones == theirs.bones


def adapted_statistics(
    run: Mapping[str, Statistics], corpus: Mapping[str, Statistics], source: Source
) -> dict[str, Statistics]:
    """Statistics of a tuned run: those of the new recordings where the model wants them.

    A model that leaves constant values of poses out has to leave out the same ones: with ``keep_constant`` those of the
    run's corpus keep their small standard deviation, and others stay above it.
    """
    pose = run["pose"] if source.pose_statistics == "run" else corpus["pose"]
    if source.pose_statistics == "corpus" and source.keep_constant:
        new, old = corpus["pose"], np.asarray(run["pose"].std)
        least = np.minimum(old, 2.0 * _CONSTANT)
        std = np.where(old <= _CONSTANT * 1.001, old, np.maximum(np.asarray(new.std), least))
        pose = Statistics(np.asarray(new.mean), std.astype(np.float32))
    audio = corpus["audio"] if source.audio_statistics == "corpus" else run["audio"]
    return {"audio": audio, "pose": pose, "root": corpus["root"]}


def _check_networks(config: RunConfig, run: Run, corpus: Corpus) -> None:
    """Refuse settings or labels with which the weights would be those of other networks."""
    model = config.build()
    found = {name: tuple(array.shape) for name, array in flatten_dict(run.params, sep="/").items()}
    if parameter_shapes(config) != found:
        assert config.source is not None
        changed = [
            f"--{field.name.replace('_', '-')}"
            for field in fields(config.model_config)
            if getattr(config.model_config, field.name) != getattr(run.config.model_config, field.name)
        ]
        reason = f"{', '.join(changed)}: changes the networks" if changed else f"{corpus.path}: needs other networks"
        remedy = "leave the flag out" if changed else "use a corpus with as many emotions and speakers"
        raise InputError(f"{reason}, whose weights come from {config.source.run}; {remedy}, or train without --from.")
    uses = {*model.batch_fields, *model.condition_fields}
    for field, names in (("emotion", "emotions"), ("speaker", "speakers")):
        if field in uses and list(config.corpus[names]) != list(run.config.corpus.get(names, ())):
            raise InputError(
                f"{corpus.path}: has the {names} {', '.join(config.corpus[names])}; the run has"
                f" {', '.join(run.config.corpus.get(names, ()))}; give the recordings the same ones."
            )


def training_model(config: RunConfig) -> Model:
    """The model as it is trained: from another run's weights, and without frozen networks, if the run says so."""
    model = config.build()
    if config.source is not None:
        model = tuned_model(model, config.source)
    return without_frozen(model, config.train_config.frozen)


def tuned_model(model: Model, source: Source) -> Model:
    """The model with the stages and the trained networks of a fine-tuning; nothing is initialised from data."""
    stages = [stage for stage in model.stages if not source.stages or stage.name in source.stages] or model.stages
    tuned = model._replace(
        stages=tuple(
            stage._replace(warm_start=None, steps=None if len(stages) == 1 else stage.steps) for stage in stages
        )
    )
    networks = jax.eval_shape(model.init, jax.random.key(0)) if source.frozen else {}
    return without_frozen(tuned, tuple(name for name in source.frozen if name in networks))


def without_frozen(model: Model, frozen: tuple[str, ...]) -> Model:
    """The model without updates of frozen networks.

    Raises:
        InputError: no such network, or nothing is left to train.
    """
    if not frozen:
        return model
    names = sorted(jax.eval_shape(model.init, jax.random.key(0)))
    if unknown := sorted(set(frozen) - set(names)):
        raise InputError(f"--frozen: there is no network {unknown[0]!r}; there are: {', '.join(names)}.")
    stages = []
    for stage in model.stages:
        kept = [(update, [name for name in update.trains or names if name not in frozen]) for update in stage.updates]
        updates = tuple(update._replace(trains=tuple(left)) for update, left in kept if left)
        if not updates:
            raise InputError(f"--frozen: leaves nothing to train in the stage {stage.name}; name fewer networks.")
        stages.append(stage._replace(updates=updates))
    return model._replace(stages=tuple(stages))


def with_validation(corpus: Corpus, frames: int) -> tuple[Corpus, str]:
    """The corpus with a validation split that has room for clips, and a line about it.

    A split that is long enough stays. Otherwise the last fifth of each training recording, or a clip where that is
    longer, is held out, if two clips of training are left.

    Args:
        frames: of a clip.

    Returns:
        The corpus, and what was done; empty if the split stays.
    """
    if any(segment.frames >= frames for segment in corpus.splits.get("validation", ())):
        return corpus, ""
    train, validation = [], []
    for segment in corpus.splits.get("train", ()):
        held = max(round(_HELD_OUT * segment.frames), frames)
        if segment.frames - held >= 2 * frames:
            train.append(Segment(segment.recording, segment.start, segment.stop - held))
            validation.append(Segment(segment.recording, segment.stop - held, segment.stop))
        else:
            train.append(segment)
    if not validation:
        return corpus, "recordings are too short for a validation split; all steps are taken, without early stopping"
    seconds = sum(segment.frames for segment in validation) / corpus.fps
    line = (
        f"the validation split is shorter than a clip; the last {seconds:.0f} s of training are held out in its place"
    )
    return replace(corpus, splits={**corpus.splits, "train": train, "validation": validation}), line
