"""A model's poses a few frames at a time, from features that arrive row by row."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.generation.controls import check_stored, sampled
from a2g_jax.models.base import Condition
from a2g_jax.models.control_curves import parse_curves
from a2g_jax.nn.blocks import BLOCK
from a2g_jax.training.run import Run

#: Poses that the next ones are joined to, and the time constant in frames with which an offset at a join fades.
JOINED, FADE = 2, 3.0
#: Longest timeline of requests that is tried, seconds.
_LONGEST = 4 * 3600.0
#: Fields of a condition that are supplied while speech arrives; of others, a model gets None.
_SUPPLIED = {"audio", "controls", "emotion", "seed_poses", "latents", "style", "speaker"}


class Requests(NamedTuple):
    """What the sampling settings request of every frame."""

    curves: Any = None
    """Of controls; None without."""
    fields: Any = None
    """Rows of other fields of the condition, by name; the last one holds from there on."""


class PoseProgram:
    """The compiled functions of a run for any number of streams; without a state of its own."""

    def __init__(self, run: Run, hop: int, lookahead: int | None = None) -> None:
        """
        Args:
            hop: frames of a call.
            lookahead: frames of speech after its own that a frame waits for; None for those of the model. With fewer,
                the last row of features stands for what has not been said yet.

        Raises:
            InputError: the model generates no motion from audio, or needs more than audio, or the whole motion.
        """
        self.run, self.hop = run, hop
        config = run.config
        model = self.model = config.build()
        _check(run, model)
        # Whatever the model does with the frames around them is over after its halo.
        most = model.halo if model.begin is None else max(model.lookahead, model.overlap)
        least = 0 if model.begin is None else model.overlap
        #: Frames of speech that a frame can wait for: the fewest and the most.
        self.lookaheads = least, most
        self.lookahead = most if lookahead is None else max(least, min(lookahead, most))
        self.before = model.halo + (JOINED if model.begin is None else 0)
        autoregressive = model.begin is not None
        after = hop + most
        # Windows of ``sample`` begin at multiples of the block, and are blocks long.
        self.rows = self.before + after if autoregressive else -(-(BLOCK - 1 + self.before + after) // BLOCK) * BLOCK
        self._params, self._summary = jax.device_put(run.params), jax.device_put(run.summary)
        self._requests = _requests(run, model)
        space, condition, overlap = config.space, model.condition, model.overlap

        def step(params, summary, key, given, start, skipped, state):
            context = condition(params, summary, given)
            if model.proceed is None:
                pose = model.sample(params, summary, key, context, start)
                # With the frames before, which were shown with less of the speech, and are continued from.
                pose = space.valid(jax.lax.dynamic_slice_in_dim(pose, skipped - JOINED, hop + JOINED))
                pose = jnp.concatenate([state.before, continued(pose, state)])
                return space.valid(pose[JOINED:]), _State(jnp.bool_(False), pose[hop:])
            # Each frame has one context, that of its first call: windows that overlap would otherwise not agree.
            cut = jax.tree.map(lambda array: jax.lax.dynamic_slice_in_dim(array, skipped, hop + overlap), context)
            cut = jax.tree.map(
                lambda new, old: new.at[: len(old)].set(jnp.where(state.first, new[: len(old)], old)), cut, state.before
            )
            pose, own = model.proceed(params, summary, key, cut, start + skipped, state.own)
            return space.valid(pose), _State(jnp.bool_(False), jax.tree.map(lambda array: array[hop:], cut), own)

        def begin(params, summary, given, seed):
            key = jax.random.fold_in(jax.random.key(seed), 0)
            if model.begin is None:
                return key, _State(jnp.bool_(True), jnp.zeros((JOINED, *space.shape)))
            before = jax.tree.map(lambda array: array[:overlap], condition(params, summary, given))
            return key, _State(jnp.bool_(True), before, model.begin(params, summary, key, None))

        self._step, self._begin = jax.jit(step), jax.jit(begin)

    def begin(self, seed: int) -> tuple[Any, Any]:
        """Key and state before frame 0 of sample 0 of a seed."""
        window = np.zeros((self.rows, self.run.config.mel.width), np.float32)
        return self._begin(self._params, self._summary, self._given(window, 0), np.uint32(seed))

    def first_row(self, frame: int) -> int:
        """Number of the first row of the window of the frames from ``frame`` on."""
        first = frame - self.before
        return first if self.model.begin is not None else first // BLOCK * BLOCK

    def advance(
        self, key: Any, state: Any, window: Float[np.ndarray, "rows bands"], frame: int
    ) -> tuple[Float[np.ndarray, "hop R D"], Any]:
        """The poses of the frames from ``frame`` on, and the state after them.

        Args:
            window: normalised features from row ``first_row(frame)`` on.
        """
        first = self.first_row(frame)
        numbers = np.int32(first), np.int32(frame - first)
        given = self._given(window, first)
        pose, state = self._step(self._params, self._summary, key, given, *numbers, state)
        return np.asarray(pose), state

    def _given(self, window: Float[np.ndarray, "rows bands"], first: int) -> Condition:
        curves, fields = self._requests
        controls = None if curves is None else sampled(curves, first, self.rows, self.run.config.fps)
        rows = np.arange(first, first + self.rows)
        others = {name: array[np.clip(rows, 0, len(array) - 1)] for name, array in (fields or {}).items()}
        fields_of: dict[str, Any] = {"audio": window, "controls": controls, **others}
        return Condition(**fields_of)

    def compilations(self) -> int:
        """Programs compiled so far."""
        compiled: tuple[Any, Any] = self._step, self._begin
        return sum(int(one._cache_size()) for one in compiled)


class Poses:
    """The poses of one stream: features in, poses out, ``hop`` frames at a time."""

    def __init__(self, program: PoseProgram, quiet: Float[np.ndarray, " bands"], seed: int) -> None:
        """
        Args:
            quiet: features of the silence before the first frame.
        """
        self.program = program
        self._key, self._state = program.begin(seed)
        self._frame = 0
        #: Normalised rows from number ``_first`` on.
        self._first = program.first_row(0)
        self._kept = np.repeat(self._normalised(quiet)[None], -self._first, axis=0)

    def push(self, row: Float[np.ndarray, " bands"]) -> Float[np.ndarray, "hop R D"] | None:
        """The next poses, where the row completes what they depend on."""
        program = self.program
        self._kept = np.concatenate([self._kept, self._normalised(row)[None]])
        if self._first + len(self._kept) < self._frame + program.hop + program.lookahead:
            return None
        first = program.first_row(self._frame)
        self._kept, self._first = self._kept[first - self._first :].copy(), first
        # What has not been said yet is as the last row.
        window = np.pad(self._kept, ((0, program.rows - len(self._kept)), (0, 0)), mode="edge")
        poses, self._state = program.advance(self._key, self._state, window, self._frame)
        self._frame += program.hop
        return poses

    def _normalised(self, row: Float[np.ndarray, " bands"]) -> Float[np.ndarray, " bands"]:
        return np.asarray(self.program.run.config.statistics["audio"].normalise(row), np.float32)


class _State(NamedTuple):
    """State between calls."""

    first: Any
    """Whether there was no call yet; the frames before are then those of the first call."""
    before: Any
    """Of models without a state, the last poses; of others, contexts of the frames that the model reads again."""
    own: Any = None
    """State of the model."""


def continued(pose: Float[Array, "frames R D"], state: _State) -> Float[Array, "hop R D"]:
    """The poses after the first :data:`JOINED`, moved so that they follow the last ones that were shown.

    The offset from what was shown, and that of its speed, fade out as a critically damped spring does. It is zero where
    the model has all of the speech that it depends on.

    Args:
        pose: those of the frames that were shown, too.
    """
    offset = jnp.where(state.first, 0.0, state.before - pose[:JOINED])
    place, speed = offset[-1:], offset[-1:] - offset[-2:-1]
    time = (1.0 + jnp.arange(len(pose) - JOINED, dtype=pose.dtype))[:, None, None]
    return pose[JOINED:] + (place + (speed + place / FADE) * time) * jnp.exp(-time / FADE)


def _check(run: Run, model: Any) -> None:
    name = run.config.model
    if model.condition is None or model.sample is None:
        raise InputError(f"{name}: generates no motion from audio; name a run of a model that does.")
    if needed := sorted(set(model.condition_fields) - _SUPPLIED):
        raise InputError(
            f"{name}: is conditioned on {', '.join(needed)}, which a live stream does not have; use a run that needs"
            " audio features alone."
        )
    if run.dynamics is not None:
        raise InputError(
            f"{name}: the run has gains that need the whole motion (a fine-tuned one), so that it cannot be generated"
            " live; use 'a2g generate', or the run that it was fine-tuned from."
        )
    _ = run.config.skeleton


def _requests(run: Run, model: Any) -> Requests:
    lines = getattr(run.config.sampling_settings, "controls", ())
    curves = None
    if model.controls is not None and (lines or not model.controls.free):
        check_stored(run, model.controls)
        curves = parse_curves(lines, model.controls.names, model.controls.categories)
    return Requests(curves, None if model.requested is None else _requested(model, run.config.fps))


def _requested(model: Any, fps: float) -> dict[str, Any]:
    """Rows of a timeline up to some frame after its end, which a stream does not know in advance."""
    seconds = 2.0
    while True:
        try:
            rows = model.requested(round(seconds * fps))
        except InputError:
            if seconds > _LONGEST:
                raise
            seconds *= 2
            continue
        # A last change that is still under way ends within a second more.
        return dict(model.requested(round((seconds + 1.0) * fps))) if rows else {}
