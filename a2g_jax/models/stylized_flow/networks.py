"""The flow with its conditioning: latents of motions, and motions of latents given the poses before them."""

from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from a2g_jax.models.base import Data, Latents, Params
from a2g_jax.models.stylized_flow.audio_encoder import AudioEncoder
from a2g_jax.models.stylized_flow.channels import Channels
from a2g_jax.models.stylized_flow.conditioning import inner, pose_history, windows
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.controls import measure
from a2g_jax.models.stylized_flow.extras import PLAIN, Extras, extra_values, extra_width
from a2g_jax.models.stylized_flow.global_encoder import Fusion, WindowEncoder
from a2g_jax.nn.flow.coupling import Shape
from a2g_jax.nn.flow.glow import fit_glow, glow, glow_inverse, init_glow, prepare, project
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
    """Conditioning of N poses of each clip."""

    history: Float[Array, "B N H"]
    """Poses before them, and the global feature."""
    context: Float[Array, "B N D"]
    """Audio around them, and :class:`Extras`."""
    poses: Float[Array, "B N history C"]
    """Poses before them without a mask, for the linear first layer."""


class AudioContext(NamedTuple):
    """The part of the conditioning of T frames that does not depend on poses, computed before the scan over poses."""

    projected: tuple[Array, ...]
    """Projection of the context for each step of the flow, (T, gates)."""
    unguided: tuple[Array, ...]
    """The same without the style code and, where training hides these too, without controls, for guidance; empty
    without guidance."""
    embedding: Float[Array, "T E"]
    """Embedding of the audio, for the global encoder; E is 0 without one."""
    latents: Latents
    """Mean and scale of the latents: 0 and 1 where they are drawn."""


class FlowNetworks:
    """Pure functions of parameters; ``flat`` poses are those of :mod:`a2g_jax.models.stylized_flow.channels`."""

    def __init__(self, config: StylizedFlowConfig, data: Data) -> None:
        self.config, self.data = config, data
        self.form = Channels(data.pose_statistics, config.stride, config.least_std)
        self.channels = len(self.form)
        width = config.audio_frames * data.audio_bands
        self.shape = Shape(
            self.channels,
            config.history_frames * self.channels + config.global_channels,
            (2 * config.audio_channels or width) + extra_width(config),
            config.hidden,
            config.layers,
            config.cell,
            config.exact_identity,
        )
        sizes = config.encoder_channels, config.encoder_blocks
        self._window = WindowEncoder(*sizes, config.embedding_channels, config.strided_norm)
        self._fusion = Fusion(config.encoder_channels, config.global_channels)
        self._audio = AudioEncoder(config.audio_channels)
        self._style = WindowEncoder(*sizes, config.style_channels, config.strided_norm)

    def init(self, key: Key[Array, ""]) -> Params:
        """Initial parameters, before the actnorms are fitted to data."""
        config, keys = self.config, jax.random.split(key, 4)
        params: Params = {"glow": init_glow(keys[0], self.shape, config.flow_steps)}
        poses = jnp.zeros((1, config.history_frames, self.channels))
        audio = jnp.zeros((1, config.audio_frames, self.data.audio_bands))
        if config.predictor:
            params["predictor"] = init_predictor(config.history_frames, self.channels)
        if config.global_channels:
            both = jnp.zeros((1, 1, 2 * config.embedding_channels))
            params["global_encoder"] = {
                "pose": self._window.init(keys[1], poses)["params"],
                "audio": self._window.init(keys[2], audio)["params"],
                "fusion": self._fusion.init(keys[3], both)["params"],
            }
        more = jax.random.split(jax.random.fold_in(key, 0))
        if config.audio_channels:
            params["audio_encoder"] = self._audio.init(more[0], audio)["params"]
        if config.style_channels:
            params["style_encoder"] = self._style.init(more[1], poses)["params"]
        return params

    def flat(self, pose: Float[Array, "B T R D"]) -> Float[Array, "B M C"]:
        """The flow's poses of a motion."""
        return self.form.flat(pose)

    def pose(self, flat: Float[Array, "B M C"]) -> Float[Array, "B T R D"]:
        """The motion of the flow's poses."""
        return self.form.pose(flat)

    def conditioning(
        self,
        params: Params,
        audio: Float[Array, "B T bands"],
        flat: Float[Array, "B M C"],
        mask: Bool[Array, "B N history"] | None = None,
        extras: Extras = PLAIN,
    ) -> Conditioning:
        """Conditioning of the poses that have ``history_frames`` before them and ``lookahead_frames`` of audio.

        Args:
            mask: which conditioning poses stay, (B, N, history); None for all.
        """
        config = self.config
        before = pose_history(flat, config.history_frames, self.after)
        history = self.visible(params, before, mask)
        count = before.shape[1]
        poses = history.reshape(*history.shape[:2], -1)
        if config.global_channels or not config.audio_channels:
            stretches = windows(audio, config.audio_frames)[:, :: config.stride][:, :count]
        if config.global_channels:
            embedded = [self.embed(params, "pose", history), self.embed(params, "audio", stretches)]
            poses = jnp.concatenate([poses, self.fuse(params, *embedded)], axis=-1)
        if config.audio_channels:
            context = self.inner(self.embed_audio(params, audio)[:, :: config.stride])
        else:
            context = stretches.reshape(*stretches.shape[:2], -1)
        return Conditioning(poses, jnp.concatenate([context, extra_values(config, extras, context)], axis=-1), before)

    def visible(
        self, params: Params, before: Float[Array, "B N history C"], mask: Bool[Array, "B N history"] | None = None
    ) -> Float[Array, "B N history C"]:
        """Conditioning poses as networks take them: those of a mask in training, all of them otherwise.

        Behind a linear first layer, a pose that is hidden with probability p in training and never in generation makes
        its sum of inputs 1 / (1 - p) times as large there, and errors of the mean pose grow over minutes. So the
        expectation is kept: ``poses`` are divided by 1 - p where they are visible in training, and the last pose
        behind ``steps`` is multiplied by it in generation.
        """
        config = self.config
        stay = None if mask is None else mask[..., None]
        if not config.predictor:
            return before if stay is None else before * stay
        share = 1.0 - config.frame_dropout
        if config.history_input == "poses":
            return before if stay is None else before * stay / share
        steps = as_steps(params["predictor"], before)
        if stay is not None:
            return steps * stay
        return jnp.concatenate([steps[..., :-1, :], share * steps[..., -1:, :]], axis=-2)

    def controls(self, pose: Float[Array, "B T R D"]) -> Float[Array, "B T K"]:
        """Style controls of every frame of clips, metres and m/s; K is 0 without any."""
        return measure(self.config.style_controls, self.data, pose)

    def scored(self, pose: Float[Array, "B T R D"], mirrored: Bool[Array, " B"] | None = None) -> Extras:
        """Extras that likelihoods of motions are conditioned on: their own controls, if these are never hidden."""
        return Extras(self.controls(pose) if self.config.score_controls else None, mirrored=mirrored)

    def style(self, params: Params, flat: Float[Array, "B M C"]) -> Float[Array, "B S"]:
        """Style codes of clips, -1 to 1."""
        code: Any = self._style.apply({"params": params["style_encoder"]}, flat)
        return jnp.tanh(code)

    def embed_audio(self, params: Params, audio: Float[Array, "B T bands"]) -> Float[Array, "B T E"]:
        """Embeddings of audio, for the couplings."""
        embedding: Any = self._audio.apply({"params": params["audio_encoder"]}, audio)
        return embedding

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

    @property
    def lookahead(self) -> int:
        """Frames of audio after its own that a frame of a generated motion depends on."""
        return self.config.lookahead_frames + self.config.overlap

    @property
    def after(self) -> int:
        """Poses at the end of a clip that only their audio is of use."""
        return self.config.after

    def inner(self, x: Float[Array, "B M C"]) -> Float[Array, "B N C"]:
        """The poses of a clip that have the whole conditioning around them."""
        return inner(self.config, x)

    def inner_frames(self, pose: Float[Array, "B T R D"]) -> Float[Array, "B N R D"]:
        """The frames of those poses."""
        stop = -(-pose.shape[1] // self.config.stride) - self.after
        return pose[:, self.config.before : stop * self.config.stride]

    def latents(
        self, params: Params, x: Float[Array, "B N C"], given: Conditioning
    ) -> tuple[Float[Array, "B N C"], Float[Array, "B N"]]:
        """Latents and log-determinants of poses."""
        again = self.config.recompute
        if not self.config.predictor:
            return glow(params["glow"], self.shape, x, given.history, given.context, again)
        errors = predictor(params["predictor"], x, given.poses)
        z, log_det = glow(params["glow"], self.shape, errors, given.history, given.context, again)
        return z, log_det + predictor_log_det(params["predictor"])

    def motion(self, params: Params, z: Float[Array, "B N C"], given: Conditioning) -> Float[Array, "B N C"]:
        """Poses of latents, all at once, given the poses before them."""
        x = glow_inverse(params["glow"], self.shape, z, given.history, given.context, self.config.recompute)
        if not self.config.predictor:
            return x
        return predictor_inverse(params["predictor"], x, given.poses, inverse_whitening(params["predictor"]))

    def fitted(
        self, params: Params, audio: Float[Array, "B T bands"], flat: Float[Array, "B M C"], extras: Extras = PLAIN
    ) -> Params:
        """Parameters with actnorms and the linear first layer fitted to a batch; arguments of :meth:`conditioning`."""
        x = self.inner(flat)
        if self.config.predictor:
            before = pose_history(flat, self.config.history_frames, self.after)
            params = {**params, "predictor": fit_predictor(x, before)}
            x = predictor(params["predictor"], x, before)
        given = self.conditioning(params, audio, flat, None, extras)
        return {**params, "glow": fit_glow(params["glow"], self.shape, x, given.history, given.context)}

    def audio_context(
        self,
        params: Params,
        audio: Float[Array, "T bands"],
        extras: Extras = PLAIN,
        latents: Latents | None = None,
        guided: bool = False,
    ) -> AudioContext:
        """The context of every frame of an audio, padded with zeros.

        Args:
            extras: of this one motion, B = 1, with controls of every frame.
            latents: in place of drawn ones; drawn if None.
            guided: whether the context without style code and controls is computed too.
        """
        config = self.config
        padded = jnp.pad(audio, ((config.before, config.lookahead_frames), (0, 0)))[None]
        embedding = jnp.zeros((len(audio), 0))
        if config.global_channels or not config.audio_channels:
            stretches = windows(padded, config.audio_frames)
        if config.global_channels:
            embedding = self.embed(params, "audio", stretches)[0]
        if config.audio_channels:
            context = self.embed_audio(params, padded)[0, config.before : config.before + len(audio)]
        else:
            context = stretches.reshape(len(audio), -1)
        prepared = prepare(params["glow"])

        def projected(extras: Extras) -> tuple[Array, ...]:
            whole = jnp.concatenate([context, extra_values(config, extras, context[None])[0]], axis=-1)
            return project(prepared, whole)

        plain = extras._replace(style=None, styled=None)
        if config.control_dropout > 0:
            plain = plain._replace(controls=None, shown=None)
        unguided = projected(plain) if guided else ()
        if latents is None:
            zeros = jnp.zeros((len(audio), self.channels))
            latents = Latents(zeros, zeros + 1.0)
        return AudioContext(projected(extras), unguided, embedding, latents)

    def without_parameters(self) -> "FlowNetworks":
        """Networks whose conditioning needs no parameters: pose history, audio window, and controls if these count."""
        controls = self.config.style_controls if self.config.score_controls else ()
        plain = replace(self.config, global_channels=0, predictor=False, audio_channels=0, style_channels=0)
        return FlowNetworks(replace(plain, style_controls=controls, mirror_flag=False), self.data)
