"""Latents of a trained flow: those of clips, and generation with them (Stylized flow, ECCV 2022, Sec. 4.5)."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.controls import sampled
from a2g_jax.generation.engine import LANES, WINDOW
from a2g_jax.generation.generator import Generator, plant_rotations, speech_features
from a2g_jax.generation.stylized_flow.encoder import ClipEncoder, Earlier, LogMel, Rows
from a2g_jax.generation.stylized_flow.fit import Fitted, fit
from a2g_jax.generation.stylized_flow.requests import matching_requests, requested_hands
from a2g_jax.generation.stylized_flow.seam import continued
from a2g_jax.generation.stylized_flow.style import Style, drive, within_training
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.geometry.pose_track import represent
from a2g_jax.geometry.retarget.onto import on_skeleton
from a2g_jax.metrics.style import HandStyle
from a2g_jax.models.control_curves import parse_curves, parse_gains
from a2g_jax.training.run import Run

#: Largest :attr:`~a2g_jax.generation.stylized_flow.style.Style.trust` in a clip: its code and controls hold more of
#: a style, and with all of the latents hands are up to twice as fast as the clip's where the speech is another.
_MOST_TRUST = 0.7
#: Seconds of a speech, and the seed of the samples, that the requests of a style are found on.
_MATCHED, _MATCHED_SEED = 30.0, 20_220_701


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
        self.run = run
        self.generator = Generator(run, window)
        #: Poses before a frame in its conditioning.
        self.history: int = model.seed_frames
        #: Values of a latent.
        self.channels: int = model.density.dimensions if model.density else int(np.prod(run.config.space.shape))
        self._encoder = ClipEncoder(run, model, window)
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
        frames, features = self._encoder.speech(motion, audio, name)
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
        return self._encoder.latents(rows, features, before)

    def log_likelihood(self, rows: Rows, features: LogMel | None = None) -> Float[np.ndarray, " T"]:
        """Log-density of poses in nats, frame by frame, given the speech and the poses before; the first pose is held
        before the clip.

        Arguments and errors of :meth:`encode_rows`.
        """
        return self._encoder.log_likelihood(rows, features)

    def style(
        self,
        motion: Motion,
        audio: Float[np.ndarray, " N"] | None = None,
        mode: str = "repeat",
        share: float = 1.0,
        name: str = "the clip",
    ) -> Style:
        """All that the run keeps of a clip's style: its latents, and code and mean controls if the run has these.

        The clip is brought into the range of the run's training motion first
        (:func:`a2g_jax.generation.stylized_flow.fit.fit`), and so are its latents; :meth:`encode` gives latents of the
        clip as it is.

        Arguments and errors of :meth:`encode`, :func:`~a2g_jax.generation.stylized_flow.fit.fit` and
        :class:`~a2g_jax.generation.stylized_flow.style.Style`.
        """
        return self.fitted_style(fit(motion, self.run, name), audio, mode, share, name)[0]

    def fitted_style(
        self,
        clip: Fitted,
        audio: Float[np.ndarray, " N"] | None = None,
        mode: str = "repeat",
        share: float = 1.0,
        name: str = "the clip",
    ) -> tuple[Style, Fitted]:
        """The style of a fitted clip, and the clip with the figures of its latents."""
        frames, features = self._encoder.speech(clip.motion, audio, name)
        rows = clip.rows[:frames]
        own = self.encode_rows(rows, features)
        means = self.run.summary.get("latent_mean")
        latents = within_training(own, None if means is None else np.asarray(means))
        sizes = np.sqrt(np.square(own).mean(axis=1))
        factor = float(np.sqrt(np.square(latents).mean() / max(float(np.square(own).mean()), 1e-12)))
        controls = None
        if self._names:
            # Of the clip itself, not of its pose within range: they are requested as quantiles.
            places = represent(clip.motion, self.run.config.space.kind, name)[0][:frames]
            controls = self._mean_controls(places)
        measured = replace(clip, code=float(np.median(sizes)), adapted=replace(clip.adapted, latents=factor))
        # The more the latents had to shrink, the less they hold of the clip's style.
        trust = min(_MOST_TRUST, float(np.sqrt(factor)))
        return Style(latents, mode, share, self._encoder.style_code(rows), controls, trust), measured

    def generate(
        self,
        audio: Any,
        samples: int,
        seed: int = 0,
        style: Style | None = None,
        seed_poses: Motion | Fitted | None = None,
        *,
        sample_rate: int | None = None,
    ) -> list[Motion]:
        """Motions for speech: those of :meth:`a2g_jax.generation.generator.Generator.generate` without a style and seed
        poses.

        Sample k depends on the arguments, the run and k alone, not on how many samples are requested.

        Args:
            audio: (N,), mono.
            style: its latents are mixed with the drawn ones.
            seed_poses: a motion that the samples continue: the poses before their first frame are its last ones, on
                any humanoid rig and at any rate (:func:`~a2g_jax.generation.stylized_flow.fit.fit`); the mean pose if
                None.
            sample_rate: of the audio, Hz, which is resampled to the run's; None for the run's own.

        Raises:
            InputError: audio of several channels or below a frame, too few seed poses, or a style of another run.
        """
        return list(self.stream(audio, samples, seed, style, seed_poses, sample_rate=sample_rate))

    def stream(
        self,
        audio: Any,
        samples: int,
        seed: int = 0,
        style: Style | None = None,
        seed_poses: Motion | Fitted | None = None,
        *,
        sample_rate: int | None = None,
    ) -> Iterator[Motion]:
        """Yield the motions of :meth:`generate` one after another."""
        clip = fit(seed_poses, self.run, "the seed clip", whole=False) if isinstance(seed_poses, Motion) else seed_poses
        earlier = None if clip is None else clip.rows
        for rows in self.rows(speech_features(self.run, audio, sample_rate), samples, seed, style, earlier):
            rotations = rotations_from_rows(rows, self.run.config.space.kind)
            if clip is not None:
                rotations = continued(rotations, clip.motion)
            yield plant_rotations(self.run, rotations)

    def rows(
        self,
        features: LogMel,
        samples: int,
        seed: int = 0,
        style: Style | None = None,
        seed_rows: Earlier | None = None,
    ) -> Iterator[Rows]:
        """Yield the rows of :meth:`generate` for log-mel rows, not normalised, and poses in the run's pose space."""
        earlier = None if seed_rows is None else self._encoder.last_poses(seed_rows)
        if style is not None and style.requests is None:
            style = self.match(style, features)
        yield from self.generator.rows(features, samples, seed, **self._given(style, len(features), earlier))

    def plain(self, features: LogMel) -> list[Rows]:
        """Samples without a style for the first half minute of a speech, which depend on nothing else."""
        return list(self.generator.rows(self._beginning(features), LANES, _MATCHED_SEED))

    def match(self, style: Style, features: LogMel, plain: Sequence[Rows] = ()) -> Style:
        """The style with requests for one speech, so that the hands of its motion get near the clip's height, speed and
        radius; as it is for a run without controls.

        Requests are found on the first half minute of the speech, with samples that depend on nothing else.

        Args:
            features: of the speech, as in :meth:`rows`.
            plain: samples of :meth:`plain`, where they are at hand.
        """
        if style.controls is None or style.share == 0:
            return style
        beginning = self._beginning(features)
        start = self._mean_controls(*(plain or self.plain(features)))
        goal = start + style.share * self.run.config.sampling_settings.style_gain * (style.controls - start)

        def draw(requests: Float[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
            given = self._given(replace(style, requests=requests), len(beginning), None)
            return self._mean_controls(*self.generator.rows(beginning, LANES, _MATCHED_SEED, **given))

        training, settings = np.asarray(self.run.summary["control_mean"]), self.run.config.sampling_settings
        gains = parse_gains(settings.control_gains, self._names)
        return replace(style, requests=matching_requests(draw, goal, training, gains))

    def _beginning(self, features: LogMel) -> LogMel:
        return features[: round(_MATCHED * self.run.config.fps)]

    def _mean_controls(self, *motions: Rows) -> Float[np.ndarray, " K"]:
        """Mean controls of motions, metres and m/s."""
        found = [self._encoder.controls(rows) for rows in motions]
        return np.mean([values.mean(axis=0, dtype=np.float64) for values in found], axis=0)

    def _given(self, style: Style | None, frames: int, earlier: Earlier | None) -> dict[str, Any]:
        given: dict[str, Any] = {"seed_poses": earlier, "latents": drive(style, frames, self.channels)}
        if style is not None and style.share > 0:
            given |= {"style": style.code, "controls": self._requested(style, frames)}
        return given

    def _requested(self, style: Style, frames: int) -> Float[np.ndarray, "T K"] | None:
        """Quantiles of the controls: those of the sampling settings, elsewhere the style's."""
        if style.requests is None:
            return None
        requested = self._controlled(frames)
        return np.where(np.isnan(requested), style.requests, requested).astype(np.float32)

    def _controlled(self, frames: int) -> Float[np.ndarray, "T K"]:
        """Quantiles of the sampling settings' controls, NaN where there is none."""
        curves = parse_curves(self.run.config.sampling_settings.controls, self._names)
        return sampled(curves, 0, frames, self.run.config.fps)

    def requested_hands(self, clip: HandStyle, frames: int) -> HandStyle:
        """Mean hands that a style and the sampling settings' controls request together.

        Args:
            clip: hands of the style's clip, which hold for what no control requests.
        """
        if not self._names:
            return clip
        training = np.asarray(self.run.summary["control_mean"])
        return requested_hands(clip, self._names, training, self._controlled(frames))
