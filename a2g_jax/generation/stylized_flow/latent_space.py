"""Latents of a trained flow: those of clips, and generation with them (Stylized flow, ECCV 2022, Sec. 4.5)."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.generation.controls import sampled
from a2g_jax.generation.engine import WINDOW
from a2g_jax.generation.generator import Generator, plant_rows, speech_features
from a2g_jax.generation.stylized_flow.style import Style, control_quantiles, drive
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import represent
from a2g_jax.geometry.retarget.onto import on_skeleton
from a2g_jax.models.control_curves import parse_curves, parse_gains
from a2g_jax.training.run import Run

Rows = Float[np.ndarray, "T R D"]
Earlier = Float[np.ndarray, "S R D"]
LogMel = Float[np.ndarray, "F bands"]


class FlowSpace:
    """The latents of a run of an invertible model.

    Generation compiles once for all lengths of speech and of styles; encoding once for each number of windows.
    """

    def __init__(self, run: Run, window: int = WINDOW) -> None:
        """
        Args:
            window: frames of one call of a compiled function, a multiple of 128.

        Raises:
            InputError: the run's model has no latents of frames.
        """
        model = run.config.build()
        if model.encode is None or model.begin is None:
            raise InputError(
                f"a run of {run.config.model} has no latents of frames for a style, and takes no seed poses; use a run"
                " of stylized_flow."
            )
        self.run, self._window = run, window
        self.generator = Generator(run, window)
        #: Poses before a frame in its conditioning.
        self.history: int = model.seed_frames
        #: Values of a latent.
        self.channels: int = model.density.dimensions if model.density else int(np.prod(run.config.space.shape))
        self._lookahead = model.lookahead
        self._params = jax.device_put(run.params)
        self._encode = jax.jit(model.encode)
        measure = model.controls.measure if model.controls else None
        measure = measure or (lambda pose: jnp.zeros((*pose.shape[:2], 0)))
        self._controls = jax.jit(measure)
        self._code = None if model.style_code is None else jax.jit(model.style_code)
        self._clip_frames = model.clip_frames
        self._names = model.controls.names if model.controls else ()

    def encode(
        self, motion: Motion, audio: Float[np.ndarray, " N"] | None = None, name: str = "the clip"
    ) -> Float[np.ndarray, "T C"]:
        """Latents of a clip's frames, each given the clip's own speech and the poses before it.

        Args:
            motion: on any humanoid rig, at any rate; it is retargeted and resampled to the run's, not turned: see
                :func:`a2g_jax.geometry.retarget.onto.face`.
            audio: its speech, mono, at the run's sample rate; silence if None. The latents then also contain what the
                speech would have explained, and the style is less specific.
            name: of the clip, for messages.

        Raises:
            InputError: a rig that is not recognised, a run without a skeleton, or audio of another length.
        """
        config = self.run.config
        motion = on_skeleton(motion, config.skeleton, config.fps, name)
        frames, features = motion.frames, None
        if audio is not None:
            sound, seconds = len(audio) / config.mel.sample_rate, motion.seconds
            # The same tolerance as in the preparation of corpora.
            if abs(sound - seconds) > max(1.0, 0.05 * max(sound, seconds)):
                raise InputError(
                    f"{name}: its audio lasts {sound:.2f} s and its motion {seconds:.2f} s; cut them to the same take."
                )
            frames = min(frames, round(sound * config.fps))
            features = log_mel(audio, config.mel, config.fps, frames)
        return self.encode_rows(represent(motion, config.space.kind, name)[0][:frames], features)

    def encode_rows(
        self, rows: Rows, features: LogMel | None = None, before: Earlier | None = None
    ) -> Float[np.ndarray, "T C"]:
        """Latents of poses in the run's pose space: see :meth:`encode`.

        Args:
            features: log-mel rows of the frames, not normalised; silence if None.
            before: the ``history`` poses before the first; the first pose repeated if None. With the mean pose of
                generation, the first latents would encode a jump from it, which is not part of the style.

        Raises:
            InputError: no frames, too few poses before them, or another number of audio rows.
        """
        frames = len(rows)
        if features is None:
            features = np.full((frames, self.run.config.mel.width), self._silence(), np.float32)
        if frames == 0 or len(features) != frames:
            raise InputError(f"a clip has {frames} poses and {len(features)} rows of audio; expected as many, above 0.")
        # Frames after the clip do not affect its latents, and one size for many lengths compiles once.
        after = -frames % self._window + self._lookahead
        earlier = np.repeat(rows[:1], self.history, axis=0) if before is None else self._last(before)
        poses = np.concatenate([earlier, rows, np.repeat(rows[-1:], after, axis=0)])
        padded = np.pad(features, ((self.history, after), (0, 0)), constant_values=float(features.min()))
        audio = np.asarray(self.run.config.statistics["audio"].normalise(padded), np.float32)
        # Style controls are averages over seconds: of the clip only, not of the padding around it.
        controls = np.asarray(self._controls(np.asarray(rows, np.float32)[None]))[0]
        controls = np.pad(controls, ((self.history, after), (0, 0)), mode="edge")
        code = self._style_code(rows)
        return np.asarray(self._encode(self._params, audio, np.asarray(poses, np.float32), controls, code))[:frames]

    def _style_code(self, rows: Rows) -> Float[np.ndarray, " S"] | None:
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

    def style(
        self,
        motion: Motion,
        audio: Float[np.ndarray, " N"] | None = None,
        mode: str = "repeat",
        share: float = 1.0,
        name: str = "the clip",
    ) -> Style:
        """All that the run keeps of a clip's style: its latents, and code and mean controls if the run has these.

        Arguments and errors of :meth:`encode` and :class:`~a2g_jax.generation.stylized_flow.style.Style`.
        """
        latents = self.encode(motion, audio, name)
        moved = on_skeleton(motion, self.run.config.skeleton, self.run.config.fps, name)
        rows = represent(moved, self.run.config.space.kind, name)[0][: len(latents)]
        controls = None
        if self._names:
            controls = np.asarray(self._controls(np.asarray(rows, np.float32)[None]))[0].mean(axis=0)
        return Style(latents, mode, share, self._style_code(rows), controls)

    def generate(
        self,
        audio: Float[np.ndarray, " N"],
        samples: int,
        seed: int = 0,
        style: Style | None = None,
        seed_poses: Motion | None = None,
    ) -> list[Motion]:
        """Motions for speech: those of :meth:`a2g_jax.generation.generator.Generator.generate` without a style and seed
        poses.

        Sample k depends on the arguments, the run and k alone, not on how many samples are requested.

        Args:
            audio: mono, at the run's sample rate.
            style: its latents are mixed with the drawn ones.
            seed_poses: a motion that the samples continue: the poses before their first frame are its last ones, on
                any humanoid rig and at any rate; the mean pose if None.

        Raises:
            InputError: audio shorter than a frame, too few seed poses, or a style of another run.
        """
        return list(self.stream(audio, samples, seed, style, seed_poses))

    def stream(
        self,
        audio: Float[np.ndarray, " N"],
        samples: int,
        seed: int = 0,
        style: Style | None = None,
        seed_poses: Motion | None = None,
    ) -> Iterator[Motion]:
        """Yield the motions of :meth:`generate` one after another."""
        config = self.run.config
        skeleton = config.skeleton
        earlier = None
        if seed_poses is not None:
            moved = on_skeleton(seed_poses, skeleton, config.fps, "the seed clip")
            earlier = represent(moved, config.space.kind, "the seed clip")[0]
        for rows in self.rows(speech_features(self.run, audio), samples, seed, style, earlier):
            yield plant_rows(self.run, rows)

    def rows(
        self,
        features: LogMel,
        samples: int,
        seed: int = 0,
        style: Style | None = None,
        seed_rows: Earlier | None = None,
    ) -> Iterator[Rows]:
        """Yield the rows of :meth:`generate` for log-mel rows, not normalised, and poses in the run's pose space."""
        earlier = None if seed_rows is None else self._last(seed_rows)
        given = {"seed_poses": earlier, "latents": drive(style, len(features), self.channels)}
        if style is not None and style.share > 0:
            given |= {"style": style.code, "controls": self._requested(style, len(features))}
        yield from self.generator.rows(features, samples, seed, **given)

    def _requested(self, style: Style, frames: int) -> Float[np.ndarray, "T K"] | None:
        """Quantiles of the controls: those of the sampling settings, elsewhere the style's."""
        if style.controls is None:
            return None
        settings = self.run.config.sampling_settings
        curves = parse_curves(settings.controls, self._names)
        requested = sampled(curves, 0, frames, self.run.config.fps)
        training = np.asarray(self.run.summary["control_mean"])
        # The model multiplies every request by the gain of its control.
        gains = np.array(parse_gains(settings.control_gains, self._names))
        own = control_quantiles(style, training, settings.style_gain / gains)
        return np.where(np.isnan(requested), own, requested).astype(np.float32)

    def _last(self, rows: Earlier) -> Float[np.ndarray, "history R D"]:
        """The last poses, as many as are in the conditioning of a frame."""
        if len(rows) < self.history:
            raise InputError(f"the seed poses are {len(rows)} frames; the run needs {self.history} or more.")
        return rows[-self.history :]

    def _silence(self) -> float:
        """About the floor of the training features: a standard deviation below the mean of the quietest band."""
        audio = self.run.config.statistics["audio"]
        return float(np.min(np.asarray(audio.mean) - np.asarray(audio.std)))
