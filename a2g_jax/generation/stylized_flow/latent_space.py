"""The latents of a trained flow: of clips, and of new speech driven with them (Stylized flow, ECCV 2022, Sec. 4.5)."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.generation.audio2gestures.pins import on_skeleton
from a2g_jax.generation.engine import LANES, WINDOW, valid_rows
from a2g_jax.generation.stylized_flow.style import Style, drive
from a2g_jax.geometry.ground import plant_feet
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import represent, rotations_from_rows
from a2g_jax.models.stylized_flow.controls import asked, parse_curves
from a2g_jax.models.stylized_flow.model import draw_latents
from a2g_jax.models.stylized_flow.networks import FlowNetworks
from a2g_jax.training.run import Run

Rows = Float[np.ndarray, "T R D"]
Earlier = Float[np.ndarray, "S R D"]
LogMel = Float[np.ndarray, "F bands"]


class FlowSpace:
    """A run of the stylized flow with its latents in the open.

    Generating compiles once for all lengths of speech and of styles; encoding once for each number of windows.
    """

    def __init__(self, run: Run, window: int = WINDOW) -> None:
        """
        Args:
            window: frames of one call of a compiled function, a multiple of 128.

        Raises:
            InputError: the run is of another model.
        """
        if run.config.model != "stylized_flow":
            raise InputError(
                f"a run of {run.config.model} has no latents of frames to take a style from, nor poses to go on from;"
                " take a run of stylized_flow."
            )
        self.run, self._window = run, window
        config, data = run.config.model_config, run.config.data()
        networks = FlowNetworks(config, data)
        curves = parse_curves(config.control_curves, config.style_controls)
        #: Poses that a frame is told of.
        self.history: int = config.history_frames
        #: Values of a frame, and of its latent.
        self.channels: int = networks.channels
        self._halo = max(config.history_frames, config.lookahead_frames)
        self._params, self._summary = jax.device_put(run.params), jax.device_put(run.summary)

        def encode(params, audio, pose, controls):
            flat = networks.flat(pose[None])
            told = networks.told(params, audio[None], flat, controls=controls)
            return networks.latents(params, networks.inner(flat), told)[0][0]

        def begin(params, seed):
            return networks.start(params, LANES, networks.flat(seed[None])[0])

        def go_on(params, summary, keys, base, gain, heard, start, carried):
            cut = jax.tree.map(lambda array: jax.lax.dynamic_slice_in_dim(array, self._halo, window), heard)
            if curves:
                cut = networks.steered(params, cut, asked(curves, summary["control_mean"], start, window, data.fps))
            draw = lambda key: draw_latents(config, key, start, window, networks.channels)  # noqa: E731
            z = base[:, None] + gain[None, None] * jax.vmap(draw, out_axes=1)(keys)
            flat, carried = networks.proceed(params, z, cut, carried, networks.limits(summary))
            return valid_rows(networks.pose(jnp.swapaxes(flat, 0, 1)), data.representation), carried

        self._encode, self._begin, self._go_on = jax.jit(encode), jax.jit(begin), jax.jit(go_on)
        self._hear, self._controls = jax.jit(networks.heard), jax.jit(networks.controls)

    def encode(
        self, motion: Motion, audio: Float[np.ndarray, " N"] | None = None, name: str = "the clip"
    ) -> Float[np.ndarray, "T C"]:
        """Latents of a clip, each under the clip's own speech and the clip's own poses before it.

        Args:
            motion: on any humanoid rig, at any rate; it is brought to the run's. Nothing turns it: see
                :func:`a2g_jax.generation.audio2gestures.pins.face`.
            audio: its speech, mono, at the run's sample rate. Without it silence is heard, and what the speech would
                have told is in the latents too: the style is blunter.
            name: of the clip, for messages.

        Raises:
            InputError: a rig that is not understood, a run without a skeleton, or audio of another length.
        """
        config = self.run.config
        motion = on_skeleton(motion, config.skeleton, config.fps, name)
        frames, features = motion.frames, None
        if audio is not None:
            heard, seen = len(audio) / config.mel.sample_rate, motion.seconds
            # As corpora take recordings in.
            if abs(heard - seen) > max(1.0, 0.05 * max(heard, seen)):
                raise InputError(
                    f"{name}: its audio lasts {heard:.2f} s and its motion {seen:.2f} s; cut them to the same take."
                )
            frames = min(frames, round(heard * config.fps))
            features = log_mel(audio, config.mel, config.fps, frames)
        return self.encode_rows(represent(motion, config.representation, name)[0][:frames], features)

    def encode_rows(
        self, rows: Rows, features: LogMel | None = None, before: Earlier | None = None
    ) -> Float[np.ndarray, "T C"]:
        """:meth:`encode` for poses as the run's corpus writes them down, all frames at once.

        Args:
            features: log-mel rows of the frames, not normalised; silence if None.
            before: the ``history`` poses before the first; the first pose, held, if None. With the mean pose of
                generation there the first latents would tell of a leap out of it, which is no part of the style.

        Raises:
            InputError: no frames, or other numbers of rows than the run and the poses have.
        """
        frames = len(rows)
        if features is None:
            features = np.full((frames, self.run.config.mel.width), self._silence(), np.float32)
        if frames == 0 or len(features) != frames:
            raise InputError(f"a clip has {frames} poses and {len(features)} rows of audio; expected as many, above 0.")
        lookahead = self.run.config.model_config.lookahead_frames
        # Frames behind the clip have no part in its own latents, and one size for many lengths compiles once.
        after = -frames % self._window + lookahead
        earlier = np.repeat(rows[:1], self.history, axis=0) if before is None else self._last(before)
        poses = np.concatenate([earlier, rows, np.repeat(rows[-1:], after, axis=0)])
        audio = self._normalised(features, self.history, after)
        # Style controls are averages over seconds: of the clip alone, not of what is held around it.
        controls = np.asarray(self._controls(np.asarray(rows, np.float32)[None]))
        controls = np.pad(controls, ((0, 0), (self.history, after), (0, 0)), mode="edge")
        return np.asarray(self._encode(self._params, audio, np.asarray(poses, np.float32), controls))[:frames]

    def generate(
        self,
        audio: Float[np.ndarray, " N"],
        samples: int,
        seed: int = 0,
        style: Style | None = None,
        seed_poses: Motion | None = None,
    ) -> list[Motion]:
        """Motions for speech; those of :meth:`a2g_jax.generation.engine.Generator.generate` without style and poses.

        Sample k depends on what is given here, the run and k alone, not on how many samples are asked for.

        Args:
            audio: mono, at the run's sample rate.
            style: whose latents take a share in those that are drawn.
            seed_poses: a motion that the samples go on from: the poses before their first frame are its last ones, on
                any humanoid rig and at any rate; the mean pose if None.

        Raises:
            InputError: audio shorter than a frame, too few poses, or a style of another run.
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
        """:meth:`generate`, one motion after another."""
        config = self.run.config
        skeleton, mean = config.skeleton, np.asarray(config.statistics["pose"].mean)
        mean_pose = rotations_from_rows(mean[None], config.representation)[0]
        frames = round(len(audio) / config.mel.sample_rate * config.fps)
        if frames == 0:
            raise InputError(f"the audio is {len(audio)} samples long, less than a frame; give a longer one.")
        earlier = None
        if seed_poses is not None:
            moved = on_skeleton(seed_poses, skeleton, config.fps, "the seed clip")
            earlier = represent(moved, config.representation, "the seed clip")[0]
        for rows in self.rows(log_mel(audio, config.mel, config.fps, frames), samples, seed, style, earlier):
            rotations = rotations_from_rows(rows, config.representation)
            still = Motion(rotations, np.zeros((len(rotations), 3), np.float32), skeleton, config.fps)
            yield plant_feet(still, np.asarray(config.statistics["root"].mean), mean_pose)

    def rows(
        self,
        features: LogMel,
        samples: int,
        seed: int = 0,
        style: Style | None = None,
        seed_rows: Earlier | None = None,
    ) -> Iterator[Rows]:
        """:meth:`generate` for log-mel rows, not normalised, and poses as the run's corpus writes them down."""
        frames, window = len(features), self._window
        base, gain = drive(style, -(-frames // window) * window, self.channels)
        audio = self._normalised(features, self._halo, self._halo + -frames % window)
        mean = np.asarray(self.run.config.statistics["pose"].mean)
        earlier = np.repeat(mean[None], self.history, axis=0) if seed_rows is None else self._last(seed_rows)
        key = jax.random.key(seed)
        for first in range(0, samples, LANES):
            keys = jax.vmap(lambda number: jax.random.fold_in(key, number))(jnp.arange(first, first + LANES))
            carried, parts = self._begin(self._params, np.asarray(earlier, np.float32)), []
            for start in range(0, frames, window):
                heard = self._hear(self._params, audio[start : start + window + 2 * self._halo])
                now = base[start : start + window]
                pose, carried = self._go_on(
                    self._params, self._summary, keys, now, gain, heard, jnp.int32(start), carried
                )
                parts.append(np.asarray(pose))
            whole = np.concatenate(parts, axis=1)[:, :frames]
            yield from whole[: samples - first]

    def _last(self, rows: Earlier) -> Float[np.ndarray, "history R D"]:
        """As many poses as a frame is told of."""
        if len(rows) < self.history:
            raise InputError(f"the poses to go on from are {len(rows)} frames; the run needs {self.history} or more.")
        return rows[-self.history :]

    def _normalised(self, features: LogMel, before: int, after: int) -> Float[np.ndarray, "t bands"]:
        """With silence around it: the quietest value, which is what silence looks like after the features' floor."""
        padded = np.pad(features, ((before, after), (0, 0)), constant_values=float(features.min()))
        return np.asarray(self.run.config.statistics["audio"].normalise(padded), np.float32)

    def _silence(self) -> float:
        """About the floor of the training recordings' features: a deviation below the mean of the quietest band."""
        audio = self.run.config.statistics["audio"]
        return float(np.min(np.asarray(audio.mean) - np.asarray(audio.std)))
