"""The training loop: one for every model."""

import hashlib
import json
import os
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import numpy as np

from a2g_jax import __version__
from a2g_jax.data.batch import ClipShape, clip_shape
from a2g_jax.data.batches import find_crops
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_integrity import verify_corpus
from a2g_jax.data.on_demand import PartStream
from a2g_jax.errors import A2GError, InputError, Interrupted
from a2g_jax.geometry.mirror_poses import pose_mirror
from a2g_jax.io.files import make_folder
from a2g_jax.io.locks import locked
from a2g_jax.io.temporary import sweep
from a2g_jax.models.base import Model, Params, finished
from a2g_jax.progress import say
from a2g_jax.training.averaging import weight_average
from a2g_jax.training.body_extremes import corpus_extremes
from a2g_jax.training.checkpoint import Checkpoints, sweep_unfinished
from a2g_jax.training.devices import Devices, find_devices
from a2g_jax.training.dynamics import corpus_dynamics
from a2g_jax.training.early_stopping import Validations, ended, read_metrics, validations
from a2g_jax.training.extension import extended
from a2g_jax.training.fine_tuning import training_model, with_validation
from a2g_jax.training.folder import LOCK, check_folder
from a2g_jax.training.log import MetricsLog, NoLog
from a2g_jax.training.processes import check_same, is_first, of_first, several, together
from a2g_jax.training.run import Run, RunConfig, keep_sampling, load_run, run_to_json, save_run
from a2g_jax.training.run_hashes import Written, write_description
from a2g_jax.training.speech_range import corpus_speech_range, write_speech_range
from a2g_jax.training.stages import span_at, stage_spans
from a2g_jax.training.state import TrainState, init_state
from a2g_jax.training.steps import Steps
from a2g_jax.training.steps import step_programs as step_programs
from a2g_jax.training.stopping import StopVote, stop_requested
from a2g_jax.training.validation import Validator, collect_summary
from a2g_jax.training.vanished import ZeroGradients

_Average = Callable[[Params], Params]


class TrainingError(A2GError):
    """Training cannot continue: the message has the step, the reason and a remedy."""


def train(
    config: RunConfig,
    corpus: Corpus,
    out: str | os.PathLike[str],
    *,
    resume: bool,
    progress: bool = True,
    start: Params | None = None,
    verify: bool = False,
    devices: int | str | None = None,
) -> Run:
    """Train a model on a corpus; the run folder can generate at any time after the first checkpoint.

    Interruptible and resumable: killed at any moment and resumed, it ends with the same parameters, bit for bit.

    With ``--patience`` the last stage ends when its validation loss has not improved for that many validations, and
    the run has the weights of the lowest loss.

    Args:
        out: the run folder. It must not hold a run, unless resuming.
        resume: continue from the latest checkpoint; starts again if there is none.
        progress: show a progress bar on standard error.
        start: weights of the run that ``config.source`` names, for training that starts from it.
        verify: read all files of the corpus to compare their hashes, also those that seem unchanged since last time.
        devices: how many share the clips of each batch, or ``"all"``; None for one in a single process, and all of
            several. A run may resume on any number of them. Of several processes the first one writes.

    Raises:
        InputError: the folder holds a run, another run than the one to resume, or one that another process trains; a
            file of the corpus or the checkpoint was damaged or changed; or the corpus holds NaN.
        OutputError: the disk is full; what was written before stays.
        TrainingError: a loss or gradient was not finite; the last good checkpoint stays.
        Interrupted: SIGINT or SIGTERM came; a checkpoint was saved.
    """
    out = Path(out)
    settings = config.train_config
    # Errors are found before anything is written.
    shared, first = find_devices(devices, settings.batch_size), is_first()
    verify_corpus(corpus, verify)
    model = training_model(config)
    if resume:
        settings, extension = extended(settings, model, out)
        config = replace(config, train_config=settings)
        if extension and first:
            say(extension)
    extremes, recordings = corpus_extremes(corpus, config), corpus
    if config.source is not None:
        corpus, note = with_validation(corpus, model.clip_frames)
        if note and progress and first:
            say(f"{corpus.path}: {note}.")
    find_crops(corpus, "train", model.clip_frames)
    if model.needs_perceptual and config.data().perceptual is None:
        raise InputError(
            f"{config.model}: its perceptual loss needs a feature network; train one with 'a2g train"
            " motion_autoencoder' on this corpus and name it with --features, or set the loss's weight to 0."
        )
    shape = clip_shape(model.batch_fields, model.clip_frames, corpus.fps, corpus.mel.sample_rate)
    for name in shape.arrays:
        corpus.array(name)
    if settings.mirror > 0:
        pose_mirror(config.space)
    created = first and not out.exists()
    if first:
        make_folder(out)
    try:
        with locked(out / LOCK, f"{out}: is being trained") if first else nullcontext():
            config = replace(config, body_extremes=extremes, speech_range=corpus_speech_range(recordings, config))
            return _train(config, corpus, recordings, out, model, shape, resume, progress, start, shared)
    except InputError:
        # Some errors are found in a locked folder only, such as word vectors of another length.
        if created:
            with suppress(OSError):  # it is not empty
                out.rmdir()
        raise


def _train(
    config: RunConfig,
    corpus: Corpus,
    recordings: Corpus,
    out: Path,
    model: Model,
    shape: ClipShape,
    resume: bool,
    progress: bool,
    start: Params | None,
    devices: Devices,
) -> Run:
    """Train in a locked folder.

    Args:
        recordings: the corpus with nothing of its training split held out.
    """
    settings, extremes, first = config.train_config, config.body_extremes, is_first()
    spans = stage_spans(model, settings)
    total = spans[-1].stop
    checkpoints = Checkpoints(out / "checkpoints", settings.keep_checkpoints)
    before = Written()
    if first:
        before = check_folder(out, config, checkpoints, resume, corpus.on_demand)
        sweep(out)
        sweep_unfinished(checkpoints.folder)
    check_same("other settings or another corpus", _digest(config))
    resume = bool(*of_first([resume and bool(checkpoints.steps())]))
    state = init_state(model, spans, settings.seed, start)
    if not resume and start is None and model.use_words is not None:
        state = state._replace(params=model.use_words(state.params, corpus.vocabulary))
    state = devices.first_copies(state)
    if resume:
        restored = checkpoints.restore(state)
        assert restored is not None
        state = restored
        config = keep_sampling(config, out)
    done = int(state.step)
    config = replace(config, body_extremes=extremes)
    average: _Average = lambda params: params  # noqa: E731
    if first:
        average = weight_average(config.source, model.stages, start, out, resume)
        description = run_to_json(config, done)
        # Without the hash of a log from which lines are about to be removed.
        write_description(out, description, before._replace(log=None))
        write_speech_range(out, config.speech_range)
    with (
        stop_requested() as stop,
        PartStream(corpus, settings.part_steps, total, arrays=shape.arrays) as parts,
        MetricsLog(out, done, settings, progress, total) if first else NoLog(out) as log,
    ):
        if first:
            write_description(out, description, before._replace(log=log.written))
        export = partial(_export, config, model, corpus, out, average, log, devices)
        run = None
        steps, zeros, stops = Steps(config, shape, devices), ZeroGradients(out), StopVote(stop, devices)
        validate = Validator(model, corpus, config)
        ends = {span.stop for span in spans}
        checked = _of_first(validations(read_metrics(log.path), spans[-1].first, done))
        while done < total and not ended(settings, checked):
            span = span_at(spans, done)
            # One of several processes does not stop alone.
            part = parts.get(done, None if several() else stop)
            if part is None:
                checkpoints.save(state, checked.best if settings.patience else None)
                export(state)
                raise _interrupted(out, done, total)
            state, metrics = steps.of(span, part)(state)
            done += 1
            if done % settings.log_every == 0 or done in ends:
                values = {name: float(value) for name, value in jax.device_get(metrics).items()}
                _check_finite(state, done, values, checkpoints)
                log.write(done, values)
                zeros.note(done, values if first else {})
            else:
                log.tick(done)
            if done % settings.validate_every == 0 or done in ends:
                found = validate(average(devices.host(state.params)), span.stage) if first else {}
                log.write_validation(done, found)
                if found and span is spans[-1]:
                    checked = checked.after(done, found["loss"])
                checked = _of_first(checked)
            stopping = stops()
            better = settings.patience > 0 and checked.best == done
            if done % settings.checkpoint_every == 0 or done in ends or better or stopping:
                _check_finite(state, done, {}, checkpoints)
                checkpoints.save(state, checked.best if settings.patience else None)
                run = export(state)
            if stopping:
                raise _interrupted(out, done, total)
    if settings.patience and checked.best not in (None, int(state.step)):
        best = checkpoints.restore(state, checked.best)
        assert best is not None
        run = export(best, recordings)
    # A finished run may lack its weights, if it was killed while writing them.
    elif run is None or (config.source is not None and config.source.dynamics):
        run = export(state, recordings)
    together("trained")
    return load_run(out) if run is None else run


def _digest(config: RunConfig) -> bytes:
    """A hash of what all processes have to agree on."""
    # Extremes are measured by each process, and rounded by its processor.
    description = json.dumps([__version__, run_to_json(replace(config, body_extremes=None), 0)], sort_keys=True)
    return hashlib.sha256(description.encode()).digest()


def _of_first(checked: Validations) -> Validations:
    """The validations of the first process, which alone has their losses."""
    if not several():
        return checked
    best, since = of_first([-1 if checked.best is None else checked.best, checked.since])
    return checked._replace(best=None if best < 0 else best, since=since)


def _interrupted(out: Path, done: int, total: int) -> Interrupted:
    return Interrupted(f"{out}: stopped after step {done} of {total}; resume with --resume.")


def _check_finite(state: TrainState, step: int, values: dict[str, float], checkpoints: Checkpoints) -> None:
    if bool(state.good):
        return
    broken = ", ".join(name for name, value in values.items() if not np.isfinite(value))
    last = max(checkpoints.steps(), default=None)
    hint = "there is no checkpoint yet" if last is None else f"the checkpoint of step {last} is good"
    raise TrainingError(
        f"training failed at or shortly before step {step}: {broken or 'loss or gradient'} not finite; {hint};"
        " try a lower --learning-rate or a --clip-norm."
    )


def _export(
    config: RunConfig,
    model: Model,
    corpus: Corpus,
    out: Path,
    average: _Average,
    log: MetricsLog | NoLog,
    devices: Devices,
    state: TrainState,
    recordings: Corpus | None = None,
) -> Run | None:
    """Write weights and the latent summary to the run folder, for generation; of several processes the first one does.

    Args:
        recordings: of a finished training, whose dynamics its motion takes on if the run says so.
    """
    if not is_first():
        return None
    params = jax.device_get(finished(model, average(devices.host(state.params))))
    summary = collect_summary(model, params, corpus, config)
    dynamics = None if recordings is None else corpus_dynamics(model, config, params, summary, recordings)
    run = Run(config, params, summary, int(state.step), dynamics)
    save_run(out, run, log.written)
    return run
