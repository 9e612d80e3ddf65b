"""Beat and emotion features of a trained EmotionGesture: those of speech, and those that its VAE samples."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.generation.generator import speech_features
from a2g_jax.models.emotion_gesture.chunks import sample_emotion
from a2g_jax.models.emotion_gesture.config import EmotionGestureConfig
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.models.emotion_timeline import emotion_rows, parse_timeline
from a2g_jax.training.run import Run


class SpeechFeatures(NamedTuple):
    """Features of the frames of a speech, of the chunks that it is generated in."""

    beat: Float[np.ndarray, "T D"]
    emotion: Float[np.ndarray, "T D"]
    probabilities: Float[np.ndarray, "T E"]
    """Of the emotions, as the run's classifier finds them in the emotion features of a chunk."""


class EmotionSpace:
    """Emotion and beat features of a run; compiles once for speech of any length."""

    def __init__(self, run: Run) -> None:
        """
        Raises:
            InputError: the run is not of EmotionGesture with emotion features and a VAE of them.
        """
        config = run.config.model_config
        if not isinstance(config, EmotionGestureConfig) or not (config.mines and config.vae_steps > 0):
            raise InputError(
                f"a run of {run.config.model} has no VAE of emotion features; use a run of emotion_gesture with"
                " --branches emotion-beat and --vae-steps above 0."
            )
        self._run, self._config = run, config
        networks = Networks(config, run.config.data())
        #: Emotions of the corpus, in the order of their weights.
        self.emotions: tuple[str, ...] = networks.data.emotions
        self._params = jax.device_put(run.params)

        def encode(params, audio: Float[Array, "N bands"]) -> tuple[Array, Array, Array]:
            found = networks.encode_audio(params, audio[None])
            assert found.emotion is not None
            assert found.logits is not None
            probabilities = jnp.broadcast_to(jax.nn.softmax(found.logits), (len(audio), networks.classes))
            return found.beat[0], found.emotion[0], probabilities

        def draw(params, key, temperature, weights: Float[Array, "N E"]) -> Float[Array, "N D"]:
            return sample_emotion(networks, params, key, temperature, weights)

        self._encode = jax.jit(encode)
        self._draw = jax.jit(jax.vmap(draw, in_axes=(None, 0, None, None)))

    def of_audio(self, audio: Float[np.ndarray, " N"]) -> SpeechFeatures:
        """Features of speech, one row a frame of the motion.

        They are computed chunk by chunk, as in generation: each has the frames of its motion and those of its initial
        poses before them. Before and after the speech it is silent.

        Args:
            audio: mono, at the run's sample rate.

        Raises:
            InputError: audio shorter than a frame.
        """
        features, first, stride = speech_features(self._run, audio), self._config.seed_frames, self._config.stride
        frames = len(features)
        around = ((first, -frames % stride), (0, 0))
        padded = np.pad(features, around, constant_values=float(features.min()))
        rows = np.asarray(self._run.config.statistics["audio"].normalise(padded), np.float32)
        starts = range(0, len(rows) - first, stride)
        chunks = [self._encode(self._params, rows[start : start + self._config.clip_frames]) for start in starts]
        beat, emotion, probabilities = (
            np.concatenate([np.asarray(part)[first:] for part in parts])[:frames] for parts in zip(*chunks, strict=True)
        )
        return SpeechFeatures(beat, emotion, probabilities)

    def sample(self, emotion: str, samples: int, seed: int = 0, temperature: float = 1.0) -> Float[np.ndarray, "S N D"]:
        """Emotion features that the VAE samples for chunks with an emotion or a blend.

        Sample k is of the same latent for every emotion, so features of different emotions can be compared one by one.

        Args:
            emotion: as ``--emotion``: ``happiness`` or ``happiness:0.7,neutral:0.3``; or a timeline within one chunk.
            samples: how many.
            seed: of the latents.
            temperature: scale of the latents; at 0 all samples are equal.

        Raises:
            InputError: an emotion that the run does not have, or a timeline that is longer than a chunk.
        """
        keys = jax.vmap(lambda number: jax.random.fold_in(jax.random.key(seed), number))(jnp.arange(samples))
        weights = self.weights(emotion, self._config.clip_frames)
        return np.asarray(self._draw(self._params, keys, jnp.float32(temperature), weights))

    def weights(self, emotion: str, frames: int) -> Float[np.ndarray, "T E"]:
        """Weights of the emotions over the frames of a motion, for :class:`a2g_jax.Generator` with ``--emotion label``.

        Args:
            emotion: as ``--emotion``: an emotion, a blend, or a timeline such as ``neutral@0,anger@12.5``.

        Raises:
            InputError: an emotion that the run does not have, or a timeline with times after the last frame.
        """
        return emotion_rows(parse_timeline(emotion), self.emotions, frames, self._run.config.fps, emotion)
