"""The flow with its conditioning: latents of motions, motions of latents, and motions frame by frame."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from a2g_jax.models.base import Data, Latents, Params, Summary
from a2g_jax.models.stylized_flow.conditioning import pose_history, windows
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.controls import measure, scaled
from a2g_jax.models.stylized_flow.global_encoder import Fusion, WindowEncoder
from a2g_jax.nn.flow.coupling import Shape
from a2g_jax.nn.flow.glow import (
    Prepared,
    first_states,
    fit_glow,
    glow,
    glow_inverse,
    glow_inverse_step,
    init_glow,
    prepare,
    project,
    project_last,
)
from a2g_jax.nn.flow.predictor import (
    as_steps,
    fit_predictor,
    init_predictor,
    inverse_whitening,
    predictor,
    predictor_inverse,
    predictor_log_det,
)


class Conditioning(NamedTuple):
    """Conditioning of N frames of each clip."""

    history: Float[Array, "B N H"]
    """Poses before them, and the global feature."""
    context: Float[Array, "B N D"]
    """Audio around them, and style controls."""
    poses: Float[Array, "B N frames C"]
    """Poses before them without a mask, for the linear first layer."""


class AudioContext(NamedTuple):
    """The part of the conditioning of T frames that does not depend on poses, computed before the scan over frames."""

    projected: tuple[Array, ...]
    """Projection of the context for each step of the flow, (T, gates)."""
    embedding: Float[Array, "T E"]
    """Embedding of the audio, for the global encoder; E is 0 without one."""
    latents: Latents
    """Mean and scale of the latents: 0 and 1 where they are drawn."""


class State(NamedTuple):
    """State of sampling between frames."""

    history: Float[Array, "B history C"]
    """Normalised poses, the oldest first."""
    states: Any
    """Hidden states of the recurrent layers."""


class Limits(NamedTuple):
    """The range of each channel in training motion, z-scores; generated poses beyond it are pulled back.

    Errors of a frame enter the next one, and over minutes they accumulate in channels that hardly move, such as ankles.
    """

    low: Float[Array, " C"]
    high: Float[Array, " C"]

    def kept(self, x: Float[Array, "B C"]) -> Float[Array, "B C"]:
        """Poses with half of the excess over the range removed: a spring, so that no motion stops within a frame."""
        return x - 0.5 * (x - jnp.clip(x, self.low[None], self.high[None]))


class FlowNetworks:
    """Pure functions of parameters; poses here are z-scores, flattened to C values."""

    def __init__(self, config: StylizedFlowConfig, data: Data) -> None:
        self.config, self.data = config, data
        rows = data.pose_statistics.mean.shape
        self.rows, self.channels = rows, rows[0] * rows[1]
        self.shape = Shape(
            self.channels,
            config.history_frames * self.channels + config.global_channels,
            config.audio_frames * data.audio_bands + len(config.style_controls),
            config.hidden,
            config.layers,
            config.cell,
            config.exact_identity,
        )
        self._window = WindowEncoder(config.encoder_channels, config.encoder_blocks, config.embedding_channels)
        self._fusion = Fusion(config.encoder_channels, config.global_channels)

    def init(self, key: Key[Array, ""]) -> Params:
        """Initial parameters, before the actnorms are fitted to data."""
        config, keys = self.config, jax.random.split(key, 4)
        params: Params = {"glow": init_glow(keys[0], self.shape, config.flow_steps)}
        if config.predictor:
            params["predictor"] = init_predictor(config.history_frames, self.channels)
        if config.global_channels:
            both = jnp.zeros((1, 1, 2 * config.embedding_channels))
            params["global_encoder"] = {
                "pose": self._window.init(keys[1], jnp.zeros((1, config.history_frames, self.channels)))["params"],
                "audio": self._window.init(keys[2], jnp.zeros((1, config.audio_frames, self.data.audio_bands)))[
                    "params"
                ],
                "fusion": self._fusion.init(keys[3], both)["params"],
            }
        return params

    def flat(self, pose: Float[Array, "B T R D"]) -> Float[Array, "B T C"]:
        """Z-scores of poses."""
        return self.data.pose_statistics.normalise(pose).reshape(*pose.shape[:2], -1)

    def pose(self, flat: Float[Array, "B T C"]) -> Float[Array, "B T R D"]:
        """Poses of z-scores."""
        poses: Float[Array, "B T R D"] = self.data.pose_statistics.denormalise(
            flat.reshape(*flat.shape[:2], *self.rows)
        )
        return poses

    def conditioning(
        self,
        params: Params,
        audio: Float[Array, "B T bands"],
        flat: Float[Array, "B T C"],
        mask: Bool[Array, "B N history"] | None = None,
        controls: Float[Array, "B T K"] | None = None,
    ) -> Conditioning:
        """Conditioning of the frames from ``history_frames`` to ``T - lookahead_frames`` of each clip.

        Args:
            mask: which conditioning poses stay, (B, N, history); None for all.
            controls: style controls of each frame, of :meth:`controls`; None for those that ``flat`` itself has.
        """
        config = self.config
        before = history = pose_history(flat, config.history_frames, config.lookahead_frames)
        if config.predictor:
            history = as_steps(params["predictor"], before)
        if mask is not None:
            history = history * mask[..., None]
        stretches = windows(audio, config.audio_frames)
        poses = history.reshape(*history.shape[:2], -1)
        if config.global_channels:
            embedded = [self.embed(params, "pose", history), self.embed(params, "audio", stretches)]
            poses = jnp.concatenate([poses, self.fuse(params, *embedded)], axis=-1)
        if controls is None:
            controls = self.controls(self.pose(flat))
        flat_audio = stretches.reshape(*stretches.shape[:2], -1)
        context = [flat_audio, self.inner(scaled(self.config.style_controls, controls))]
        return Conditioning(poses, jnp.concatenate(context, axis=-1), before)

    def controls(self, pose: Float[Array, "B T R D"]) -> Float[Array, "B T K"]:
        """Style controls of every frame of clips, metres and m/s; K is 0 without any."""
        return measure(self.config.style_controls, self.data, pose)

    def embed(self, params: Params, name: str, stretches: Float[Array, "B N T C"]) -> Float[Array, "B N E"]:
        """Embedding of each stretch by one of the two networks of the global encoder."""
        flat = stretches.reshape(-1, *stretches.shape[2:])
        embedding: Any = self._window.apply({"params": params["global_encoder"][name]}, flat)
        return embedding.reshape(*stretches.shape[:2], -1)

    def fuse(self, params: Params, pose: Float[Array, "B N E"], audio: Float[Array, "B N E"]) -> Float[Array, "B N G"]:
        """The global feature."""
        feature: Any = self._fusion.apply(
            {"params": params["global_encoder"]["fusion"]}, jnp.concatenate([pose, audio], axis=-1)
        )
        return feature

    def inner(self, x: Float[Array, "B T C"]) -> Float[Array, "B N C"]:
        """The frames of a clip that have the whole conditioning around them."""
        return x[:, self.config.history_frames : x.shape[1] - self.config.lookahead_frames]

    def latents(
        self, params: Params, x: Float[Array, "B N C"], given: Conditioning
    ) -> tuple[Float[Array, "B N C"], Float[Array, "B N"]]:
        """Latents and log-determinants of frames."""
        if not self.config.predictor:
            return glow(params["glow"], self.shape, x, given.history, given.context)
        errors = predictor(params["predictor"], x, given.poses)
        z, log_det = glow(params["glow"], self.shape, errors, given.history, given.context)
        return z, log_det + predictor_log_det(params["predictor"])

    def motion(self, params: Params, z: Float[Array, "B N C"], given: Conditioning) -> Float[Array, "B N C"]:
        """Frames of latents, all at once, given the poses before them."""
        x = glow_inverse(params["glow"], self.shape, z, given.history, given.context)
        if not self.config.predictor:
            return x
        return predictor_inverse(params["predictor"], x, given.poses, inverse_whitening(params["predictor"]))

    def fitted(
        self,
        params: Params,
        audio: Float[Array, "B T bands"],
        flat: Float[Array, "B T C"],
        controls: Float[Array, "B T K"] | None = None,
    ) -> Params:
        """Parameters with actnorms and the linear first layer fitted to a batch; arguments of :meth:`conditioning`."""
        x = self.inner(flat)
        if self.config.predictor:
            before = pose_history(flat, self.config.history_frames, self.config.lookahead_frames)
            params = {**params, "predictor": fit_predictor(x, before)}
            x = predictor(params["predictor"], x, before)
        given = self.conditioning(params, audio, flat, None, controls)
        return {**params, "glow": fit_glow(params["glow"], self.shape, x, given.history, given.context)}

    def audio_context(
        self,
        params: Params,
        audio: Float[Array, "T bands"],
        controls: Float[Array, "T K"] | None = None,
        latents: Latents | None = None,
    ) -> AudioContext:
        """The context of every frame of an audio, padded with zeros.

        Args:
            controls: style controls, metres and m/s; zeros if None.
            latents: in place of drawn ones; drawn if None.
        """
        config = self.config
        padded = jnp.pad(audio, ((config.history_frames, config.lookahead_frames), (0, 0)))[None]
        stretches = windows(padded, config.audio_frames)
        context = jnp.pad(stretches.reshape(len(audio), -1), ((0, 0), (0, len(config.style_controls))))
        embedding = jnp.zeros((len(audio), 0))
        if config.global_channels:
            embedding = self.embed(params, "audio", stretches)[0]
        projected = project(prepare(params["glow"]), context)
        if controls is not None:
            share = project_last(prepare(params["glow"]), scaled(config.style_controls, controls))
            projected = tuple(a + b for a, b in zip(projected, share, strict=True))
        if latents is None:
            zeros = jnp.zeros((len(audio), self.channels))
            latents = Latents(zeros, zeros + 1.0)
        return AudioContext(projected, embedding, latents)

    @staticmethod
    def limits(summary: Summary) -> Limits | None:
        """Limits of training motion; None for a summary without them."""
        if "pose_low" not in summary:
            return None
        return Limits(
            jnp.min(jnp.asarray(summary["pose_low"]), axis=0), jnp.max(jnp.asarray(summary["pose_high"]), axis=0)
        )

    def start(self, params: Params, count: int, seed: Float[Array, "history C"] | None = None) -> State:
        """State before the first frame of ``count`` sequences.

        Args:
            seed: z-scores of the poses before it; the mean pose if None.
        """
        shape = (count, self.config.history_frames, self.channels)
        history = jnp.zeros(shape) if seed is None else jnp.broadcast_to(seed[None], shape)
        return State(history, first_states(prepare(params["glow"]), self.shape, count))

    def proceed(
        self, params: Params, z: Float[Array, "T B C"], given: AudioContext, state: State, limits: Limits | None = None
    ) -> tuple[Float[Array, "T B C"], State]:
        """Frames of latents one after another, each conditioned on those before it.

        Args:
            limits: of :meth:`limits`; None for none. Within them the frames are the latents' own.
        """
        prepared: Prepared = prepare(params["glow"])
        count = z.shape[1]
        unwhitening = inverse_whitening(params["predictor"]) if self.config.predictor else None

        def frame(state: State, one):
            latent, projected, embedding = one
            history, hidden = state
            shown = as_steps(params["predictor"], history) if self.config.predictor else history
            poses = shown.reshape(count, -1)
            if self.config.global_channels:
                audio = jnp.broadcast_to(embedding[None, None], (count, 1, embedding.shape[0]))
                feature = self.fuse(params, self.embed(params, "pose", shown[:, None]), audio)
                poses = jnp.concatenate([poses, feature[:, 0]], axis=-1)
            context = tuple(jnp.broadcast_to(share[None], (count, share.shape[0])) for share in projected)
            x, hidden = glow_inverse_step(prepared, self.shape, latent, poses, context, hidden)
            if unwhitening is not None:
                x = predictor_inverse(params["predictor"], x, history, unwhitening)
            if limits is not None:
                x = limits.kept(x)
            return State(jnp.concatenate([history[:, 1:], x[:, None]], axis=1), hidden), x

        after, x = jax.lax.scan(frame, state, (z, given.projected, given.embedding))
        return x, after
