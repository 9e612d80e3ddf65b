"""Motions for a speech of any length, from a trained run."""

from collections.abc import Callable, Iterator
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.geometry.ground import plant_feet
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import rotations_from_rows
from a2g_jax.geometry.rotation import matrix_from_6d, matrix_to_6d
from a2g_jax.nn.noise import BLOCK
from a2g_jax.training.run import Run

#: Frames that one call of a compiled function gives. One size for every audio: nothing compiles anew for a new length.
WINDOW = 1024
#: Samples that a model whose frames follow one another makes side by side: one reading of its weights serves all of
#: them. Always as many, also for a single one, so that a sample does not depend on how many are asked for.
LANES = 4


class Generator:
    """A run ready to generate; compiles on first use and serves any audio after that.

    Audio is worked on in windows with as much context on either side as an output frame can depend on, so the motion is
    the same as from one pass over the whole audio. Before the first and after the last frame the model hears silence.
    """

    def __init__(self, run: Run) -> None:
        """
        Raises:
            InputError: the run's model does not generate motion from audio.
        """
        self.run = run
        model = run.config.build()
        if model.condition is None or model.sample is None:
            raise InputError(f"{run.config.model}: makes no motion from audio; name a run of a model that does.")
        draw = model.sample
        self._halo = -(-model.halo // BLOCK) * BLOCK
        self._params = jax.device_put(run.params)
        self._summary = jax.device_put(run.summary)
        self._condition = jax.jit(model.condition)

        representation = run.config.representation

        @jax.jit
        def sample(params, summary, key, condition, start):
            pose = draw(params, summary, key, condition, start)
            return valid_rows(jax.lax.dynamic_slice_in_dim(pose, self._halo, WINDOW), representation)

        self._sample = sample
        begin, proceed = model.begin, model.proceed
        self._begin = None if begin is None else jax.jit(jax.vmap(begin, in_axes=(None, None, 0)))

        @jax.jit
        def go_on(params, summary, keys, condition, start, carried):
            assert proceed is not None
            cut = jax.tree.map(lambda array: jax.lax.dynamic_slice_in_dim(array, self._halo, WINDOW), condition)
            lanes = jax.vmap(proceed, in_axes=(None, None, 0, None, None, 0))
            pose, carried = lanes(params, summary, keys, cut, start + self._halo, carried)
            return valid_rows(pose, representation), carried

        self._go_on = go_on

    def frames(self, audio: Float[np.ndarray, " N"]) -> int:
        """Length of the motion for an audio: its seconds times fps, rounded."""
        return round(len(audio) / self.run.config.mel.sample_rate * self.run.config.fps)

    def generate(
        self,
        audio: Float[np.ndarray, " N"],
        samples: int,
        seed: int = 0,
        report: Callable[[int], None] = lambda done: None,
    ) -> list[Motion]:
        """Different motions for the same speech.

        Sample k depends on the audio, the run, the seed and k alone, not on how many samples are asked for.

        Args:
            audio: mono, at the run's sample rate.
            samples: how many.
            seed: of all that is drawn.
            report: called with the number of samples done.

        Raises:
            InputError: the audio is shorter than a frame.
        """
        motions = []
        for number, motion in enumerate(self.stream(audio, samples, seed), start=1):
            motions.append(motion)
            report(number)
        return motions

    def stream(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Motion]:
        """:meth:`generate`, one motion at a time."""
        frames = self.frames(audio)
        if frames == 0:
            raise InputError(f"the audio is {len(audio)} samples long, less than a frame; give a longer one.")
        config = self.run.config
        yield from self.stream_features(log_mel(audio, config.mel, config.fps, frames), samples, seed)

    def stream_features(self, features: Float[np.ndarray, "T bands"], samples: int, seed: int = 0) -> Iterator[Motion]:
        """:meth:`stream` for log-mel features that are there already, one row a frame, not normalised.

        Raises:
            InputError: the run makes keypoints or directions, which are no motion of a skeleton; see :meth:`rows`.
        """
        config = self.run.config
        skeleton, mean = config.skeleton, np.asarray(config.statistics["pose"].mean)
        mean_pose = rotations_from_rows(mean[None], config.representation)[0]
        for rows in self.rows(features, samples, seed):
            rotations = rotations_from_rows(rows, config.representation)
            still = Motion(rotations, np.zeros((len(rotations), 3), np.float32), skeleton, config.fps)
            yield plant_feet(still, np.asarray(config.statistics["root"].mean), mean_pose)

    def rows(
        self, features: Float[np.ndarray, "T bands"], samples: int, seed: int = 0
    ) -> Iterator[Float[np.ndarray, "T R D"]]:
        """Different motions as the run's corpus writes poses down, for log-mel features, not normalised."""
        frames = len(features)
        windows = list(self._windows(features))
        key = jax.random.key(seed)
        if self._begin is not None:
            yield from self._in_lanes(windows, key, samples, frames)
            return
        for number in range(samples):
            draw = partial(self._sample, self._params, self._summary, jax.random.fold_in(key, number))
            parts = [draw(condition, jnp.int32(start)) for start, condition in windows]
            yield np.concatenate([np.asarray(part) for part in parts])[:frames]

    def _in_lanes(self, windows, key, samples: int, frames: int):
        """Motions whose windows go on from one another, several at a time."""
        assert self._begin is not None
        for first in range(0, samples, LANES):
            keys = jax.vmap(lambda number: jax.random.fold_in(key, number))(first + jnp.arange(LANES))
            carried, parts = self._begin(self._params, self._summary, keys), []
            for start, condition in windows:
                pose, carried = self._go_on(self._params, self._summary, keys, condition, jnp.int32(start), carried)
                parts.append(np.asarray(pose))
            yield from np.concatenate(parts, axis=1)[: samples - first, :frames]

    def _windows(self, features: Float[np.ndarray, "T bands"]):
        """First frame (context included) and encoded audio of each window."""
        frames = len(features)
        count = -(-frames // WINDOW)
        after = count * WINDOW - frames + self._halo
        # The quietest value is what silence looks like after the features' floor.
        padded = np.pad(features, ((self._halo, after), (0, 0)), constant_values=float(features.min()))
        normalised = np.asarray(self.run.config.statistics["audio"].normalise(padded), np.float32)
        for start in range(0, count * WINDOW, WINDOW):
            window = normalised[start : start + WINDOW + 2 * self._halo]
            yield start - self._halo, self._condition(self._params, window)


def valid_rows(pose: Float[Array, "*S R D"], representation: str) -> Float[Array, "*S R D"]:
    """The poses that a model's raw output stands for."""
    if representation == "6d":
        return matrix_to_6d(matrix_from_6d(pose))
    if representation == "directions":
        return pose / jnp.maximum(jnp.linalg.norm(pose, axis=-1, keepdims=True), 1e-6)
    return pose
