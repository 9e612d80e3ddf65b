"""The training loop: one for every model."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np

from a2g_jax.data.batch import ClipShape, clip_shape, gather, gather_clips, gather_from_disk
from a2g_jax.data.batches import BatchMaker, Crops, crops_in, draw_others, draw_starts, find_crops
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_integrity import verify_corpus
from a2g_jax.data.on_demand import Part, PartStream
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
from a2g_jax.training.dynamics import corpus_dynamics
from a2g_jax.training.early_stopping import ended, read_metrics, validations
from a2g_jax.training.fine_tuning import training_model, with_validation
from a2g_jax.training.folder import LOCK, check_folder
from a2g_jax.training.log import MetricsLog
from a2g_jax.training.run import Run, RunConfig, keep_sampling, run_to_json, save_run
from a2g_jax.training.run_hashes import write_description
from a2g_jax.training.speech_range import corpus_speech_range, write_speech_range
from a2g_jax.training.stages import StageSpan, span_at, stage_spans
from a2g_jax.training.state import Metrics, TrainState, advance, init_state, step_keys
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
    verify_corpus(corpus, verify)
    model = training_model(config)
    extremes, recordings = corpus_extremes(corpus, config), corpus
    if config.source is not None:
        corpus, note = with_validation(corpus, model.clip_frames)
        if note and progress:
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
    created = not out.exists()
    make_folder(out)
    try:
        with locked(out / LOCK, f"{out}: is being trained"):
            config = replace(config, body_extremes=extremes, speech_range=corpus_speech_range(recordings, config))
            return _train(config, corpus, recordings, out, model, shape, resume, progress, start)
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
) -> Run:
    """Train in a locked folder.

    Args:
        recordings: the corpus with nothing of its training split held out.
    """
    settings, extremes = config.train_config, config.body_extremes
    spans = stage_spans(model, settings)
    total = spans[-1].stop
    checkpoints = Checkpoints(out / "checkpoints", settings.keep_checkpoints)
    before = check_folder(out, config, checkpoints, resume, corpus.on_demand)
    sweep(out)
    sweep_unfinished(checkpoints.folder)
    state = init_state(model, spans, settings.seed, start)
    restored = checkpoints.restore(state) if resume else None
    if restored is not None:
        state = restored
        config = keep_sampling(config, out)
    elif start is None and model.use_words is not None:
        state = state._replace(params=model.use_words(state.params, corpus.vocabulary))
    done = int(state.step)
    config = replace(config, body_extremes=extremes)
    average = weight_average(config.source, model.stages, start, out, restored is not None)
    description = run_to_json(config, done)
    # Without the hash of a log from which lines are about to be removed.
    write_description(out, description, before._replace(log=None))
    write_speech_range(out, config.speech_range)
    with (
        _stop_requested() as stop,
        PartStream(corpus, settings.part_steps, total, arrays=shape.arrays) as parts,
        MetricsLog(out, done, settings, progress, total) as log,
    ):
        write_description(out, description, before._replace(log=log.written))
        export = partial(_export, config, model, corpus, out, average, log)
        run = None
        steps, zeros = _Steps(config, shape), ZeroGradients(out)
        validate = Validator(model, corpus, config)
        ends = {span.stop for span in spans}
        checked = validations(read_metrics(log.path), spans[-1].first, done)
        while done < total and not ended(settings, checked):
            span = span_at(spans, done)
            part = parts.get(done, stop)
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
                zeros.note(done, values)
            else:
                log.tick(done)
            if done % settings.validate_every == 0 or done in ends:
                found = validate(average(state.params), span.stage)
                log.write_validation(done, found)
                if found and span is spans[-1]:
                    checked = checked.after(done, found["loss"])
            better = settings.patience > 0 and checked.best == done
            if done % settings.checkpoint_every == 0 or done in ends or better or stop.is_set():
                _check_finite(state, done, {}, checkpoints)
                checkpoints.save(state, checked.best if settings.patience else None)
                run = export(state)
            if stop.is_set():
                raise _interrupted(out, done, total)
    if settings.patience and checked.best not in (None, int(state.step)):
        best = checkpoints.restore(state, checked.best)
        assert best is not None
        return export(best, recordings)
    # A finished run may lack its weights, if it was killed while writing them.
    adapts = config.source is not None and config.source.dynamics
    return export(state, recordings) if run is None or adapts else run


def _interrupted(out: Path, done: int, total: int) -> Interrupted:
    return Interrupted(f"{out}: stopped after step {done} of {total}; resume with --resume.")


#: A whole step of training.
_Step = Callable[[TrainState], tuple[TrainState, Metrics]]


class _Steps:
    """Steps on the parts of a corpus; parts with recordings of the same lengths share compiled programs."""

    def __init__(self, config: RunConfig, shape: ClipShape) -> None:
        self._config, self._shape = config, shape
        self._programs: dict[tuple[Any, ...], Callable[[Any], _Step]] = {}
        self._last: tuple[StageSpan, Part, _Step] | None = None

    def of(self, span: StageSpan, part: Part) -> _Step:
        """The step of a stage on a part; kept until another one is requested."""
        if self._last is None or self._last[0] is not span or self._last[1] is not part:
            crops = crops_in(part.segments, self._shape.frames, "the longest recording of a part")
            key = (span.stage.name, *(np.asarray(array).tobytes() for array in crops))
            if key not in self._programs:
                self._programs[key] = step_programs(span, self._shape, crops, self._config)
            self._last = None  # frees the part before, before the next one is put on the device
            self._last = span, part, self._programs[key](part)
        return self._last[2]


def step_programs(span: StageSpan, shape: ClipShape, crops: Crops, config: RunConfig) -> Callable[[Part], _Step]:
    """A function from parts to whole steps: choose clips, augment, compute, update; the same for data on disk."""
    settings = config.train_config
    mirror_pose = pose_mirror(config.space) if settings.mirror > 0 else None
    make_batch = BatchMaker(config.statistics["audio"], settings.augmentation, settings.mirror, mirror_pose)

    def finish(state: TrainState, clips: dict[str, Any]) -> tuple[TrainState, Metrics]:
        _, augment_key, model_key = step_keys(state.key, state.step)
        return advance(span, state, make_batch(augment_key, clips), model_key)

    def starts(state: TrainState):
        key = step_keys(state.key, state.step)[0]
        chosen = draw_starts(key, crops, settings.batch_size)
        return chosen, draw_others(jax.random.fold_in(key, 0), crops, chosen) if shape.paired else None

    @partial(jax.jit, donate_argnums=0)
    def on_device(state: TrainState, arrays: dict[str, Any]):
        chosen, others = starts(state)
        return finish(state, gather_clips(arrays, shape, chosen, gather, others))

    choose = jax.jit(starts)
    compute = jax.jit(finish, donate_argnums=0)

    def on(part: Part) -> _Step:
        size = sum(array.nbytes for array in part.arrays.values()) / 1e6
        # Rows of the device are counted in 32 bits.
        if size <= settings.device_megabytes and max(len(array) for array in part.arrays.values()) < 2**31:
            arrays = {name: jax.device_put(np.asarray(array)) for name, array in part.arrays.items()}
            return lambda state: on_device(state, arrays)

        def from_disk(state: TrainState) -> tuple[TrainState, Metrics]:
            chosen, others = jax.tree.map(np.asarray, choose(state))
            clips = gather_clips(part.arrays, shape, chosen, gather_from_disk, others)
            return compute(state, clips)

        return from_disk

    return on


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
    log: MetricsLog,
    state: TrainState,
    recordings: Corpus | None = None,
) -> Run:
    """Write weights and the latent summary to the run folder, for generation.

    Args:
        recordings: of a finished training, whose dynamics its motion takes on if the run says so.
    """
    params = jax.device_get(finished(model, average(state.params)))
    summary = collect_summary(model, params, corpus, config)
    dynamics = None if recordings is None else corpus_dynamics(model, config, params, summary, recordings)
    run = Run(config, params, summary, int(state.step), dynamics)
    save_run(out, run, log.written)
    return run


@contextmanager
def _stop_requested() -> Iterator[threading.Event]:
    """An event that SIGINT and SIGTERM set, so that a step is never interrupted; a second signal ends at once."""
    event = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield event
        return

    def stop(number: int, _frame: Any) -> None:
        event.set()
        signal.signal(number, before[signal.Signals(number)])

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield event
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
