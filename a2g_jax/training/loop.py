"""The training loop: one for every model."""

import json
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np

from a2g_jax.data.batches import Crops, Dressing, crops_in, draw_starts, find_crops, gather, gather_from_disk
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.on_demand import Part, PartStream
from a2g_jax.errors import A2GError, InputError, Interrupted
from a2g_jax.io.files import make_folder, read_json, write_json
from a2g_jax.models.base import Model
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.checkpoint import Checkpoints, sweep_unfinished
from a2g_jax.training.log import MetricsLog
from a2g_jax.training.run import FORMAT, RUN_FILE, WEIGHTS_FILE, Run, RunConfig, run_to_json, save_run
from a2g_jax.training.state import Metrics, TrainState, advance, init_state, step_keys
from a2g_jax.training.validation import collect_summary, validate

#: Settings that may change between parts of a run, because they do not touch what is computed in a step.
_FREE = frozenset({"checkpoint_every", "validate_every", "log_every", "keep_checkpoints", "tensorboard"})


class TrainingError(A2GError):
    """Training cannot go on: the message says at which step, why, and what to try."""


def train(
    config: RunConfig, corpus: Corpus, out: str | os.PathLike[str], *, resume: bool, progress: bool = True
) -> Run:
    """Train a model on a corpus; the run folder can generate at any time after the first checkpoint.

    Killed at any moment and resumed, it ends with the same parameters, bit for bit, as if it had not been.

    Args:
        out: the run folder. It must not hold a run, unless resuming.
        resume: go on from the latest checkpoint; starts anew where there is none.
        progress: show a progress bar on standard error.

    Raises:
        InputError: the folder holds a run, or another run than the one to resume.
        TrainingError: a loss or gradient was not finite; the last good checkpoint stays.
        Interrupted: SIGINT or SIGTERM came; a checkpoint was saved.
    """
    out = Path(out)
    settings = config.train_config
    # Whatever can be wrong is found before anything is written.
    find_crops(corpus, "train", config.model_config.clip_frames)
    model = config.build()
    state = init_state(model, settings)
    checkpoints = Checkpoints(out / "checkpoints", settings.keep_checkpoints)
    _check_folder(out, config, checkpoints, resume, corpus.on_demand)
    if resume and (restored := checkpoints.restore(state)) is not None:
        state = restored
    done = int(state.step)
    export = partial(_export, config, model, corpus, out)
    make_folder(out)
    sweep_unfinished(checkpoints.folder)
    with (
        _stop_requested() as stop,
        PartStream(corpus, settings.part_steps, settings.steps) as parts,
        MetricsLog(out, done, settings, progress) as log,
    ):
        write_json(out / RUN_FILE, run_to_json(config, done))
        run = None
        steps = _Steps(model, settings, config)
        while done < settings.steps:
            part = parts.get(done, stop)
            if part is None:
                checkpoints.save(state)
                export(state)
                raise _interrupted(out, done, settings)
            state, metrics = steps.of(part)(state)
            done += 1
            if done % settings.log_every == 0 or done == settings.steps:
                values = {name: float(value) for name, value in jax.device_get(metrics).items()}
                _check_finite(state, done, values, checkpoints)
                log.write(done, values)
            else:
                log.tick(done)
            if done % settings.validate_every == 0 or done == settings.steps:
                log.write_validation(done, validate(model, state.params, corpus, config))
            if done % settings.checkpoint_every == 0 or done == settings.steps or stop.is_set():
                _check_finite(state, done, {}, checkpoints)
                checkpoints.save(state)
                run = export(state)
            if stop.is_set():
                raise _interrupted(out, done, settings)
    # A run that was finished before has nothing to do but may lack its weights, if it was killed while writing them.
    return run if run is not None else export(state)


def _interrupted(out: Path, done: int, settings: TrainConfig) -> Interrupted:
    return Interrupted(f"{out}: stopped after step {done} of {settings.steps}; go on with --resume.")


def _check_folder(out: Path, config: RunConfig, checkpoints: Checkpoints, resume: bool, on_demand: bool) -> None:
    if out.is_file():
        raise InputError(f"{out}: is a file; name a folder for the run.")
    if not (out / RUN_FILE).exists():
        if out.is_dir() and any(out.iterdir()):
            raise InputError(f"{out}: is not empty and holds no run; choose another folder.")
        return
    if not checkpoints.steps() and not (out / WEIGHTS_FILE).exists():
        return  # stopped before its first checkpoint: nothing is lost by starting anew
    if not resume:
        raise InputError(f"{out}: holds a run already; go on with it by --resume, or choose another folder.")
    values = read_json(out / RUN_FILE)
    if not isinstance(values, dict) or values.get("format") != FORMAT or not isinstance(values.get("corpus"), dict):
        raise InputError(f"{out / RUN_FILE}: is not the description of a run; restore it or choose another folder.")
    now = json.loads(json.dumps(run_to_json(config, 0)))
    changed = [
        f"{key.replace('_', ' ')}: {values.get(key)}, now {now[key]}"
        for key in ("model", "fps", "feature_network")
        if values.get(key) != now[key]
    ]
    free_settings = _FREE if on_demand else _FREE | {"part_steps"}
    for part, free in (("model_config", frozenset()), ("train_config", free_settings), ("mel", frozenset())):
        before: dict[str, Any] = values[part] if isinstance(values.get(part), dict) else {}
        changed += [
            f"{name}: {before.get(name)}, now {value}"
            for name, value in now[part].items()
            if name not in free and before.get(name, value) != value
        ]
    if values["corpus"].get("fingerprint") != config.corpus["fingerprint"]:
        changed.append("the corpus")
    if changed:
        raise InputError(f"{out}: was trained with other settings ({'; '.join(changed)}); resume with the same ones.")


#: A whole step of training.
_Step = Callable[[TrainState], tuple[TrainState, Metrics]]


class _Steps:
    """Steps on the parts of a corpus; parts alike in the lengths of their recordings share their compiled programs."""

    def __init__(self, model: Model, settings: TrainConfig, config: RunConfig) -> None:
        self._arguments = model, settings, config
        self._programs: dict[tuple[bytes, ...], Callable[[Any], _Step]] = {}
        self._last: tuple[Part, _Step] | None = None

    def of(self, part: Part) -> _Step:
        """The step on a part; kept until another part is asked for."""
        if self._last is None or self._last[0] is not part:
            model, settings, config = self._arguments
            crops = crops_in(part.segments, model.clip_frames, "the longest recording of a part")
            key = tuple(np.asarray(array).tobytes() for array in crops)
            if key not in self._programs:
                self._programs[key] = _programs(model, settings, crops, config)
            self._last = None  # lets go of the part before, before the next one is put on the device
            self._last = part, self._programs[key](part)
        return self._last[1]


def _step_function(model: Model, settings: TrainConfig, corpus: Corpus, crops: Crops, config: RunConfig) -> _Step:
    """The step on an ordinary corpus."""
    return _programs(model, settings, crops, config)(corpus)


def _programs(model: Model, settings: TrainConfig, crops: Crops, config: RunConfig) -> Callable[[Corpus | Part], _Step]:
    """One whole step: choose clips, augment, compute, update. The same clips wherever the data lies."""
    frames = model.clip_frames
    dressing = Dressing(config.statistics["audio"], settings.augmentation)

    def finish(state: TrainState, audio, pose, labels) -> tuple[TrainState, Metrics]:
        _, dress_key, model_key = step_keys(state.key, state.step)
        return advance(model, settings, state, dressing(dress_key, audio, pose, labels), model_key)

    def starts(state: TrainState):
        return draw_starts(step_keys(state.key, state.step)[0], crops, settings.batch_size)

    @partial(jax.jit, donate_argnums=0)
    def on_device(state: TrainState, audio, pose, labels):
        rows = starts(state)
        return finish(state, gather(audio, rows, frames), gather(pose, rows, frames), labels[rows])

    choose = jax.jit(starts)
    compute = jax.jit(finish, donate_argnums=0)

    def on(data: Corpus | Part) -> _Step:
        if (data.audio.nbytes + data.pose.nbytes) / 1e6 <= settings.device_megabytes:
            held = [jax.device_put(np.asarray(array)) for array in (data.audio, data.pose, data.labels)]
            return lambda state: on_device(state, *held)

        def from_disk(state: TrainState) -> tuple[TrainState, Metrics]:
            rows = np.asarray(choose(state))
            clips = [gather_from_disk(array, rows, frames) for array in (data.audio, data.pose)]
            return compute(state, *clips, data.labels[rows])

        return from_disk

    return on


def _check_finite(state: TrainState, step: int, values: dict[str, float], checkpoints: Checkpoints) -> None:
    if bool(state.good):
        return
    broken = ", ".join(name for name, value in values.items() if not np.isfinite(value))
    last = max(checkpoints.steps(), default=None)
    kept = "there is no checkpoint yet" if last is None else f"the checkpoint of step {last} is good"
    raise TrainingError(
        f"training went wrong at or shortly before step {step}: {broken or 'loss or gradient'} not finite; {kept};"
        " try a lower --learning-rate or a --clip-norm."
    )


def _export(config: RunConfig, model: Model, corpus: Corpus, out: Path, state: TrainState) -> Run:
    """Weights and latent statistics where generation finds them."""
    params = jax.device_get(state.params)
    summary = collect_summary(model, state.params, corpus, config)
    run = Run(config, params, summary, int(state.step))
    save_run(out, run)
    return run


@contextmanager
def _stop_requested() -> Iterator[threading.Event]:
    """An event that SIGINT and SIGTERM set, so that a step is never cut in half; a second signal ends at once."""
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
