"""The window loop: motions of any length from a model, window by window."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import fields
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.compilations import release_after_compiling
from a2g_jax.errors import InputError
from a2g_jax.generation.controls import check_rows, check_stored, stored_rows
from a2g_jax.models.base import Condition, Model
from a2g_jax.nn.blocks import BLOCK
from a2g_jax.progress import checkpoint
from a2g_jax.training.run import Run, RunConfig

Rows = Float[np.ndarray, "T R D"]

#: Frames that one call of a compiled function gives at most; speech of more frames is made in windows of so many.
WINDOW = 1024
#: Smallest window. Speech that fits gets the smallest window of this times a power of two: few sizes, since each of
#: them compiles, and at most twice the frames that are needed.
_LEAST = 2 * BLOCK
#: Samples that an autoregressive model generates side by side: one reading of its weights serves all of them. Always as
#: many, also for a single one, so that a sample does not depend on how many are requested.
LANES = 4
#: Windows that are computed while the caller works on those before them: enough to keep other cores busy, and few,
#: since each takes the memory of a window.
_AHEAD = 4
#: Fields of a condition with a row for each frame.
_BY_FRAME = ("emotion", "words", "controls", "latents")


def check_generates(run: Run) -> Model:
    """The model of a run.

    Raises:
        InputError: it does not generate motion from audio.
    """
    model = run.config.build()
    if model.condition is None or model.sample is None:
        raise InputError(f"{run.config.model}: generates no motion from audio; name a run of a model that does.")
    return model


class Engine:
    """A run ready to generate; compiles on first use and serves any audio after that.

    Audio is processed in windows with as much context on either side as an output frame can depend on, so the motion is
    the same as from one pass over the whole audio. Before the first and after the last frame the audio is silent.
    """

    _params: Any
    _summary: Any
    _condition: Any
    _sample: Any
    _advance: Any
    _begin: Any

    def __init__(self, run: Run, window: int = WINDOW, like: "Engine | None" = None) -> None:
        """
        Args:
            window: frames of one call of a compiled function at most, a multiple of 128.
            like: another engine, whose compiled functions serve this one if only requests differ
                (:attr:`a2g_jax.models.base.Model.programs`).

        Raises:
            InputError: the run's model does not generate motion from audio.
        """
        self.run, self.window = run, window
        model = self.model = check_generates(run)
        assert model.condition is not None
        assert model.sample is not None
        self.halo = -(-model.halo // BLOCK) * BLOCK
        #: Requests of the sampling settings.
        self.lines: Sequence[str] = getattr(run.config.sampling_settings, "controls", ())
        if model.controls is not None and self.lines:
            check_stored(run, model.controls)
        if like is not None and like._serves(self):
            self._params, self._summary, self._condition = like._params, like._summary, like._condition
            self._sample, self._advance, self._begin = like._sample, like._advance, like._begin
            return
        release_after_compiling()
        self._params = jax.device_put(run.params)
        self._summary = jax.device_put(run.summary)
        self._condition = jax.jit(model.condition)
        self._sample, self._advance = jax.jit(self.sample), jax.jit(self.advance)
        self._begin = None if model.begin is None else jax.jit(self.begin)

    def _serves(self, other: "Engine") -> bool:
        """Whether the functions of this engine compute what those of another one do."""
        if self.model.programs is None or self.model.programs != other.model.programs or self.window != other.window:
            return False
        own, its = self.run, other.run
        settings = (field.name for field in fields(RunConfig) if field.name != "sampling")
        same = (getattr(own.config, name) is getattr(its.config, name) for name in settings)
        return own.params is its.params and own.summary is its.summary and all(same)

    def sample(self, params, summary, key, condition, start) -> Any:
        """Poses (window, R, D) of a window of a model that is not autoregressive."""
        assert self.model.sample is not None
        pose = self.model.sample(params, summary, key, condition, start)
        return self.run.config.space.valid(jax.lax.dynamic_slice_in_dim(pose, self.halo, len(pose) - 2 * self.halo))

    def begin(self, params, summary, keys, seed_poses) -> Any:
        """States of an autoregressive model before the first frame, one for each of :data:`LANES` keys."""
        assert self.model.begin is not None
        return jax.vmap(self.model.begin, in_axes=(None, None, 0, None))(params, summary, keys, seed_poses)

    def advance(self, params, summary, keys, condition, start, state) -> tuple[Any, Any]:
        """Poses (lanes, window, R, D) of a window of an autoregressive model, and the states after it."""
        assert self.model.proceed is not None
        # All parts of the condition of an autoregressive model have a row for each frame.
        rows = len(jax.tree.leaves(condition)[0]) - 2 * self.halo + self.model.overlap
        cut = jax.tree.map(lambda array: jax.lax.dynamic_slice_in_dim(array, self.halo, rows), condition)
        lanes = jax.vmap(self.model.proceed, in_axes=(None, None, 0, None, None, 0))
        pose, state = lanes(params, summary, keys, cut, start + self.halo, state)
        return self.run.config.space.valid(pose), state

    def rows(self, given: Condition, samples: int, seed: int = 0) -> Iterator[Rows]:
        """Different motions in the run's pose space, one after another.

        Sample k depends on the condition, the run, the seed and k alone, not on how many samples are requested.

        Args:
            given: conditioning of the whole motion; log-mel features as corpora hold them, not normalised. Fields that
                the model does not use have to be None; ``controls`` are those of the sampling settings if None
                (:func:`a2g_jax.generation.controls.control_rows` makes others).

        Raises:
            InputError: a field that the model does not use, or too few seed poses.
        """
        self._check(given)
        given = self._with_requests(given)
        frames, key = len(given.audio), jax.random.key(seed)
        windows = list(self._windows(given))
        if self._begin is not None:
            yield from self._in_lanes(windows, key, samples, frames, self._seeds(given))
            return
        drawn = self._drawn(windows, key, samples)
        for _ in range(samples):
            parts = [np.asarray(next(drawn)) for _ in windows]
            yield self.run.finished(np.concatenate(parts)[:frames])

    def _drawn(self, windows: list[tuple[int, Any]], key: Any, samples: int) -> Iterator[Any]:
        """Poses of every window of every sample; the next :data:`_AHEAD` windows are computed meanwhile, in vain if the
        caller stops."""
        pending: deque[Any] = deque()
        for number in range(samples):
            draw = partial(self._sample, self._params, self._summary, jax.random.fold_in(key, number))
            for start, condition in windows:
                checkpoint()
                pending.append(draw(condition, jnp.int32(start)))
                if len(pending) > _AHEAD:
                    yield pending.popleft()
        while pending:
            checkpoint()
            yield pending.popleft()

    def _check(self, given: Condition) -> None:
        for name, value in given._asdict().items():
            if value is not None and name not in self.model.condition_fields:
                raise InputError(
                    f"{self.run.config.model}: takes no {name.replace('_', ' ')}; it is conditioned on"
                    f" {', '.join(self.model.condition_fields)}."
                )
        frames = len(given.audio)
        for name in _BY_FRAME:
            for part in jax.tree.leaves(getattr(given, name)):
                if len(part) != frames:
                    raise InputError(f"{name}: expected a row for each of {frames} frames; got {len(part)}.")
        seeds = given.seed_poses
        if seeds is not None and len(seeds) < self.model.seed_frames:
            raise InputError(f"the seed poses are {len(seeds)} frames; the run needs {self.model.seed_frames} or more.")

    def _with_requests(self, given: Condition) -> Condition:
        """The condition with the requests of the sampling settings, where it has none."""
        if self.model.requested is None:
            return given
        fields = self.model.requested(len(given.audio))
        return given._replace(**{name: value for name, value in fields.items() if getattr(given, name) is None})

    def _seeds(self, given: Condition) -> Any:
        """The last seed poses, as many as the model takes."""
        if given.seed_poses is None:
            return None
        return np.asarray(given.seed_poses[len(given.seed_poses) - self.model.seed_frames :], np.float32)

    def _in_lanes(self, windows, key, samples: int, frames: int, seeds: Any) -> Iterator[Rows]:
        """Motions of an autoregressive model: each window starts from the state after the one before."""
        assert self._begin is not None
        for first in range(0, samples, LANES):
            keys = jax.vmap(lambda number: jax.random.fold_in(key, number))(first + jnp.arange(LANES))
            state, parts = self._begin(self._params, self._summary, keys, seeds), []
            for start, condition in windows:
                checkpoint()
                pose, state = self._advance(self._params, self._summary, keys, condition, jnp.int32(start), state)
                parts.append(np.asarray(pose))
            yield from map(self.run.finished, np.concatenate(parts, axis=1)[: samples - first, :frames])

    def _windows(self, given: Condition) -> Iterator[tuple[int, Any]]:
        """First frame (context included) of each window, and what the model makes of its condition."""
        for start, cut in self.cuts(given):
            yield start, self._condition(self._params, self._summary, cut)

    def window_of(self, frames: int) -> int:
        """Frames of the windows in which speech of so many frames is made: the smallest size that holds all of them, or
        the largest; the largest alone for models whose last bits depend on it."""
        size = self.window if self.model.fixed_window else _LEAST
        while size < min(frames, self.window):
            size *= 2
        return min(size, self.window)

    def cuts(self, given: Condition) -> Iterator[tuple[int, Condition]]:
        """First frame (context included) and condition of each window."""
        frames, halo, window = len(given.audio), self.halo, self.window_of(len(given.audio))
        count = -(-frames // window)
        around = (halo, count * window - frames + halo)
        # The quietest value is what silence looks like after the features' floor.
        padded = np.pad(given.audio, (around, (0, 0)), constant_values=float(np.min(given.audio)))
        audio: Any = np.asarray(self.run.config.statistics["audio"].normalise(padded), np.float32)
        controls = self._controls(given)
        hold = lambda array: np.pad(np.asarray(array), (around, (0, 0)), mode="edge")  # noqa: E731
        held = jax.tree.map(hold, {"emotion": given.emotion, "latents": given.latents, "controls": controls})
        words: Any = None if given.words is None else np.pad(given.words, (around,))
        for start in range(0, count * window, window):
            checkpoint()
            rows = slice(start, start + window + 2 * halo)
            cut = Condition(
                audio=audio[rows],
                waveform=self._waveform(given, start - halo, window + 2 * halo),
                speaker=given.speaker,
                words=None if words is None else words[rows],
                seed_poses=self._seeds(given),
                style=given.style,
                **jax.tree.map(lambda array, rows=rows: array[rows], held),
            )
            yield start - halo, cut

    def _controls(self, given: Condition) -> Any:
        """Requested controls, frame by frame; None where there are none and the model needs none."""
        found = self.model.controls
        if found is None or given.controls is None:
            return stored_rows(self.run, found, len(given.audio))
        check_stored(self.run, found)
        check_rows(np.asarray(given.controls), found)
        return given.controls

    def _waveform(self, given: Condition, start: int, frames: int) -> Any:
        """Samples of the frames of a window; silence before and after the audio."""
        if given.waveform is None:
            return None
        rate = self.run.config.mel.sample_rate / self.run.config.fps
        first, count = round(start * rate), round(frames * rate)
        inside = given.waveform[max(first, 0) : max(first + count, 0)]
        before = min(max(-first, 0), count)
        return np.pad(inside, (before, count - before - len(inside))).astype(np.float32)
