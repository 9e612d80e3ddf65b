"""The encoder of a trained flow: latents, likelihoods, style codes and controls of clips."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.geometry.motion import Motion
from a2g_jax.models.base import Model
from a2g_jax.training.run import Run

Rows = Float[np.ndarray, "T R D"]
Earlier = Float[np.ndarray, "S R D"]
LogMel = Float[np.ndarray, "F bands"]


class ClipEncoder:
    """The compiled functions of a run that take clips; rows are poses in the run's pose space."""

    def __init__(self, run: Run, model: Model, window: int) -> None:
        """
        Args:
            model: the run's, with latents of frames.
            window: clips are padded to a multiple of this number of frames, so that few lengths are compiled.
        """
        assert model.encode is not None
        self._run, self._window = run, window
        self._history, self._lookahead = model.seed_frames, model.lookahead
        self._clip_frames = model.clip_frames
        self._params = jax.device_put(run.params)
        self._encode = jax.jit(model.encode)
        measure = model.controls.measure if model.controls else None
        measure = measure or (lambda pose: jnp.zeros((*pose.shape[:2], 0)))
        self._controls = jax.jit(measure)
        self._density = None if model.density is None else jax.jit(model.density.log_likelihood)
        self._code = None if model.style_code is None else jax.jit(model.style_code)

    def latents(
        self, rows: Rows, features: LogMel | None = None, before: Earlier | None = None
    ) -> Float[np.ndarray, "T C"]:
        """Latents of poses.

        Arguments and errors of :meth:`a2g_jax.generation.stylized_flow.latent_space.FlowSpace.encode_rows`.
        """
        audio, poses, controls, code = self._padded(rows, features, before)
        return np.asarray(self._encode(self._params, audio, poses, controls, code))[: len(rows)]

    def log_likelihood(self, rows: Rows, features: LogMel | None = None) -> Float[np.ndarray, " T"]:
        """Log-density of poses in nats, frame by frame; the first pose is held before the clip."""
        assert self._density is not None
        audio, poses, _, _ = self._padded(rows, features, None)
        return np.asarray(self._density(self._params, audio[None], poses[None]))[0, : len(rows)]

    def controls(self, rows: Rows) -> Float[np.ndarray, "T K"]:
        """Style controls of every frame, metres and m/s; K is 0 for a run without any."""
        return np.asarray(self._controls(np.asarray(rows, np.float32)[None]))[0]

    def speech(
        self, motion: Motion, audio: Float[np.ndarray, " N"] | None, name: str
    ) -> tuple[int, Float[np.ndarray, "T bands"] | None]:
        """Frames of a clip that have speech, and log-mel rows of these; all frames and None without audio."""
        if audio is None:
            return motion.frames, None
        config = self._run.config
        sound, seconds = len(audio) / config.mel.sample_rate, motion.seconds
        # The same tolerance as in the preparation of corpora.
        if abs(sound - seconds) > max(1.0, 0.05 * max(sound, seconds)):
            raise InputError(
                f"{name}: its audio lasts {sound:.2f} s and its motion {seconds:.2f} s; cut them to the same take."
            )
        frames = min(motion.frames, round(sound * config.fps))
        return frames, log_mel(audio, config.mel, config.fps, frames)

    def style_code(self, rows: Rows) -> Float[np.ndarray, " S"] | None:
        """Mean style code of parts of a clip that are as long as those of training; None without such codes."""
        if self._code is None:
            return None
        frames = self._clip_frames
        padded = np.pad(
            rows, ((0, max(0, frames - len(rows))), (0, 0), (0, 0)), mode="reflect" if len(rows) > 1 else "edge"
        )
        firsts = range(0, len(padded) - frames + 1, max(1, frames // 2))
        parts = [self._code(self._params, np.asarray(padded[first : first + frames], np.float32)) for first in firsts]
        return np.asarray(np.mean(parts, axis=0), np.float32)

    def last_poses(self, rows: Earlier) -> Float[np.ndarray, "history R D"]:
        """The last poses, as many as are in the conditioning of a frame."""
        if len(rows) < self._history:
            raise InputError(f"the seed poses are {len(rows)} frames; the run needs {self._history} or more.")
        return rows[-self._history :]

    def _padded(self, rows: Rows, features: LogMel | None, before: Earlier | None) -> tuple[Any, Any, Any, Any]:
        """Audio, poses and controls of a clip and the frames around it, and its style code."""
        frames = len(rows)
        if features is None:
            features = np.full((frames, self._run.config.mel.width), self._silence(), np.float32)
        if frames == 0 or len(features) != frames:
            raise InputError(f"a clip has {frames} poses and {len(features)} rows of audio; expected as many, above 0.")
        # Frames after the clip do not affect its latents, and one size for many lengths compiles once.
        after = -frames % self._window + self._lookahead
        earlier = np.repeat(rows[:1], self._history, axis=0) if before is None else self.last_poses(before)
        poses = np.concatenate([earlier, rows, np.repeat(rows[-1:], after, axis=0)])
        padded = np.pad(features, ((self._history, after), (0, 0)), constant_values=float(features.min()))
        audio = np.asarray(self._run.config.statistics["audio"].normalise(padded), np.float32)
        # Style controls are averages over seconds: of the clip only, not of the padding around it.
        controls = np.pad(self.controls(rows), ((self._history, after), (0, 0)), mode="edge")
        return audio, np.asarray(poses, np.float32), controls, self.style_code(rows)

    def _silence(self) -> float:
        """About the floor of the training features: a standard deviation below the mean of the quietest band."""
        audio = self._run.config.statistics["audio"]
        return float(np.min(np.asarray(audio.mean) - np.asarray(audio.std)))
