"""The networks of EmotionGesture as functions of parameters."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Key

from a2g_jax.errors import InputError
from a2g_jax.models.base import Data, Params
from a2g_jax.models.emotion_gesture.config import EmotionGestureConfig
from a2g_jax.models.emotion_gesture.mining import (
    AudioEncoder,
    EmotionClassifier,
    Projector,
    TextEncoder,
    standardised,
    unmined,
)
from a2g_jax.models.emotion_gesture.motion import Discriminator, PatchDiscriminator, PoseDecoder, SeedHold
from a2g_jax.models.emotion_gesture.prompter import PosePrompter
from a2g_jax.models.emotion_gesture.vae import FeatureDecoder, FeatureEncoder
from a2g_jax.models.judged_motion import judged_motion
from a2g_jax.nn.transformer import Encoder

#: Added to standard deviations of emotion features, before division.
_LEAST = 1e-3
#: Networks of the features of audio and text.
_MINING = ("audio", "emotion", "beat", "classifier", "text")
#: Source of dropout: None for none.
DropoutKey = Key[Array, ""] | None


class AudioFeatures(NamedTuple):
    """Features of the audio of clips."""

    beat: Float[Array, "B N D"]
    """Beat features, or the audio's features where nothing is mined."""
    emotion: Float[Array, "B N D"] | None = None
    """Emotion features."""
    logits: Float[Array, "B E"] | None = None
    """Of the emotion classifier."""


class Networks:
    """Modules for a corpus, and their application; parameters go in and arrays come out."""

    def __init__(self, config: EmotionGestureConfig, data: Data) -> None:
        """
        Raises:
            InputError: a corpus without emotions for a label.
        """
        c = config
        if not data.emotions:
            raise InputError("emotion_gesture: the corpus has no emotions; prepare one with labels.")
        self.config, self.data = c, data
        self.rows = data.pose_statistics.mean.shape
        self.values = self.rows[0] * self.rows[1]
        self.classes = len(data.emotions)
        self.normalised = c.normalise_pose or not data.space.unit_scale
        modules = {
            "audio": AudioEncoder(
                c.audio_blocks, c.audio_channels, c.audio_stem, c.channels, c.header, data.spectra, c.dropout
            ),
            "fusion": Projector(c.channels, c.dropout),
            "encoder": Encoder(c.layers, c.heads, c.hidden, c.dropout),
            "prompter": PosePrompter(
                c.channels, c.clip_frames, c.transition_frames, c.prompter, c.prompt_space, c.scaled_scores, c.dropout
            ),
            "decoder": PoseDecoder(c.layers, c.heads, c.hidden, self.values, c.query_positions, c.smoothing, c.dropout),
        }
        if c.mines:
            modules["emotion"] = Projector(c.channels, c.dropout)
            modules["beat"] = Projector(c.channels, c.dropout)
            modules["classifier"] = EmotionClassifier(c.emotion_hidden, self.classes, c.emotion_pool)
        if c.mines and c.beat_weight > 0:
            modules["text"] = TextEncoder(c.word_buckets, c.word_width, c.word_layers, c.channels, c.dropout)
        if c.hold_seed:
            modules["hold"] = SeedHold(c.clip_frames)
        self._generator: dict[str, Any] = modules
        mean = np.zeros(self.rows) if self.normalised else np.asarray(data.pose_statistics.mean)
        self._mean = mean.reshape(-1).astype(np.float32)
        self._judge: Any = Discriminator(
            c.discriminator_channels, c.discriminator_layers, c.heads, c.discriminator_hidden
        )
        if c.discriminator == "patches":
            self._judge = PatchDiscriminator(c.discriminator_channels)
        self._vae_encoder = FeatureEncoder(c.vae_channels, c.vae_latent)
        self._vae_decoder = FeatureDecoder(c.vae_channels, c.clip_frames, c.channels)
        self.samples_emotions = c.mines and c.vae_steps > 0

    def init(self, key: Key[Array, ""]) -> Params:
        """Initial parameters: ``generator``, and ``discriminator``, ``vae`` and ``average`` of the generator where the
        settings have them."""
        c = self.config
        audio = jnp.zeros((1, c.clip_frames, self.data.audio_bands))
        rows = jnp.zeros((1, c.clip_frames, c.channels))
        labelled = c.channels + (self.classes if c.branches == "label" else 0)
        words = jnp.zeros((1, c.clip_frames), jnp.int32)
        inputs: dict[str, tuple[Any, ...]] = {
            "audio": (audio, True),
            "emotion": (rows, True),
            "beat": (rows, True),
            "classifier": (rows,),
            "text": (words, True),
            "fusion": (jnp.zeros((1, c.clip_frames, labelled)), True),
            "encoder": (rows, True),
            "prompter": (jnp.zeros((1, c.seed_frames, self.values)), True),
            "decoder": (rows, rows, True),
            "hold": (jnp.zeros((1, c.seed_frames, self.values)), jnp.zeros(self.values)),
        }
        params: Params = {
            "generator": {
                name: module.init(jax.random.fold_in(key, number), *inputs[name])["params"]
                for number, (name, module) in enumerate(self._generator.items())
            }
        }
        if c.adversarial_weight > 0:
            motion = self.flat(jnp.broadcast_to(self.data.pose_statistics.mean, (1, c.clip_frames, *self.rows)))
            inputs["judge"] = self._judged(motion, audio, jnp.zeros((1, self.classes)))
            params["discriminator"] = self._judge.init(jax.random.fold_in(key, 100), *inputs["judge"])["params"]
        if c.averages:
            params["average"] = jax.tree.map(jnp.array, params["generator"])
        if self.samples_emotions:
            label, latent = jnp.zeros((1, self.classes)), jnp.zeros((1, c.vae_latent))
            params["vae"] = {
                "encoder": self._vae_encoder.init(jax.random.fold_in(key, 101), rows, label)["params"],
                "decoder": self._vae_decoder.init(jax.random.fold_in(key, 102), latent, label)["params"],
                "features": {"mean": jnp.zeros(c.channels), "scale": jnp.ones(c.channels)},
            }
        return params

    def flat(self, pose: Float[Array, "B N R D"]) -> Float[Array, "B N C"]:
        """Poses as networks and losses have them."""
        pose = self.data.pose_statistics.normalise(pose) if self.normalised else pose
        return pose.reshape(*pose.shape[:2], self.values)

    def pose(self, values: Float[Array, "B N C"]) -> Float[Array, "B N R D"]:
        """Inverse of :meth:`flat`."""
        pose = values.reshape(*values.shape[:2], *self.rows)
        return self.data.pose_statistics.denormalise(pose) if self.normalised else pose

    def encode_audio(self, params: Params, audio: Float[Array, "B N bands"], key: DropoutKey = None) -> AudioFeatures:
        """Beat features and emotion features of audio (EBM)."""
        features = self._apply(params, "audio", key, audio)
        if not self.config.mines:
            return AudioFeatures(features)
        emotion = self._spanned(self._apply(params, "emotion", key, features))
        logits = self.classify(params, emotion)
        beat = self._apply(params, "beat", key, features)
        if self.config.beat_normalised:
            beat = standardised(beat)
        return AudioFeatures(beat, emotion, logits)

    def classify(self, params: Params, emotion: Float[Array, "B N D"]) -> Float[Array, "B E"]:
        """Logits of the emotions, from emotion features."""
        own = {"params": params["generator"]["classifier"]}
        logits: Float[Array, "B E"] = self._generator["classifier"].apply(own, emotion)
        return logits

    def encode_text(self, params: Params, words: Int[Array, "B N"], key: DropoutKey = None) -> Float[Array, "B N D"]:
        """Features of a transcript; see :class:`~a2g_jax.models.emotion_gesture.mining.TextEncoder`."""
        return self._apply(params, "text", key, words)

    def decode(
        self,
        params: Params,
        audio: AudioFeatures,
        seed: Float[Array, "B M C"],
        labels: Float[Array, "B N E"] | None = None,
        key: DropoutKey = None,
    ) -> Float[Array, "B N C"]:
        """Poses of a clip that begins with the initial poses ``seed``, those included.

        Args:
            labels: weights of the emotions, for the ablation that takes them.
        """
        if audio.emotion is not None:
            mixed = audio.beat + audio.emotion
        else:
            mixed = unmined(audio.beat, labels if self.config.branches == "label" else None)
        fused = self._apply(params, "fusion", key, mixed)
        memory = self._apply(params, "encoder", key, fused)
        prompt = self._apply(params, "prompter", key, seed)
        if self.config.query_audio:
            prompt = prompt + memory
        made: Float[Array, "B N C"] = self._apply(params, "decoder", key, prompt, memory)
        if self.config.hold_seed:
            own = {"params": params["generator"]["hold"]}
            made = made + self._generator["hold"].apply(own, seed, jnp.asarray(self._mean, seed.dtype))
        return made

    def judge(
        self,
        params: Params,
        motion: Float[Array, "B N C"],
        audio: Float[Array, "B N bands"],
        label: Float[Array, "B E"],
    ) -> tuple[Float[Array, " L"], Float[Array, "B E"] | None]:
        """The discriminator's logits of motions, of all clips and stretches, and of their emotions."""
        found: Any = self._judge.apply({"params": params["discriminator"]}, *self._judged(motion, audio, label))
        scores, emotions = found
        return scores.reshape(-1), emotions

    def _judged(self, motion: Array, audio: Array, label: Array) -> tuple[Array, ...]:
        """Input of the discriminator; patches begin with the last initial pose, which is given."""
        if self.config.discriminator == "transformer":
            return (jnp.diff(motion, axis=1),)
        first = self.config.seed_frames - 1
        return judged_motion(self.data, self.pose(motion[:, first:])), audio[:, first:], label

    def encode_emotion(
        self, params: Params, features: Float[Array, "B N D"], label: Float[Array, "B E"]
    ) -> tuple[Float[Array, "B Z"], Float[Array, "B Z"]]:
        """Mean and log-variance of the VAE's latents."""
        own = jax.lax.stop_gradient(params["vae"]["features"])
        scores = (features - own["mean"][None, None]) / own["scale"][None, None]
        found: Any = self._vae_encoder.apply({"params": params["vae"]["encoder"]}, scores, label)
        return found

    def decode_emotion(
        self, params: Params, latent: Float[Array, "B Z"], label: Float[Array, "B E"]
    ) -> Float[Array, "B N D"]:
        """Emotion features of latents."""
        own = jax.lax.stop_gradient(params["vae"]["features"])
        scores: Any = self._vae_decoder.apply({"params": params["vae"]["decoder"]}, latent, label)
        return self._spanned(scores * own["scale"][None, None] + own["mean"][None, None])

    def freeze_mining(self, params: Params) -> Params:
        """The parameters with the networks of the features of audio and text, and the VAE, as constants."""
        generator = {
            name: jax.lax.stop_gradient(own) if name in _MINING else own for name, own in params["generator"].items()
        }
        return params | {"generator": generator, "vae": jax.lax.stop_gradient(params["vae"])}

    def measure_features(self, params: Params, audio: Float[Array, "B N bands"]) -> Params:
        """The parameters with mean and standard deviation of the emotion features of clips, for the VAE."""
        features = self.encode_audio(params, audio).emotion
        assert features is not None
        measured = {"mean": jnp.mean(features, axis=(0, 1)), "scale": jnp.std(features, axis=(0, 1)) + _LEAST}
        return params | {"vae": params["vae"] | {"features": measured}}

    def _spanned(self, emotion: Float[Array, "B N D"]) -> Float[Array, "B N D"]:
        """Emotion features of frames, or their mean over the clip."""
        if self.config.emotion_span == "frames":
            return emotion
        return jnp.broadcast_to(jnp.mean(emotion, axis=1, keepdims=True), emotion.shape)

    def _apply(self, params: Params, name: str, key: DropoutKey, *inputs: Array) -> Any:
        module, own = self._generator[name], {"params": params["generator"][name]}
        if key is None or self.config.dropout == 0:
            return module.apply(own, *inputs, True)
        number = list(self._generator).index(name)
        return module.apply(own, *inputs, False, rngs={"dropout": jax.random.fold_in(key, number)})
