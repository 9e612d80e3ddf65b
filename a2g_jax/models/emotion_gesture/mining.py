"""Emotion-beat mining: audio encoder, projectors, emotion classifier and text encoder (Sec. III-B)."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float, Int

from a2g_jax.nn.causal import CausalTCN
from a2g_jax.nn.rates import resized
from a2g_jax.nn.se_resnet import SEResNet, convolution, group_norm

_XAVIER = nn.initializers.xavier_uniform()
#: Slope of the leaky rectifier below zero.
_SLOPE = 0.2
#: Added to variances of features before division.
_LEAST = 1e-5
#: Regions of frequency that the aligned header keeps apart.
_REGIONS = 4


def dense(features: int) -> nn.Dense:
    """A linear layer with Xavier's uniform weights, as the authors initialise all of theirs."""
    return nn.Dense(features, kernel_init=_XAVIER)


def bent(x: Array) -> Array:
    """The rectifier of all perceptrons: leaky, so that none of their units stops to learn.

    Outputs that agree with no target yet are first drawn to the median pose. Plain rectifiers get there by switching
    themselves off, all at once, and stay there.
    """
    return nn.leaky_relu(x, _SLOPE)


class Projector(nn.Module):
    """A perceptron with one hidden layer, as wide as its output."""

    features: int
    dropout: float

    @nn.compact
    def __call__(self, x: Float[Array, "B N C"], deterministic: bool) -> Float[Array, "B N D"]:
        hidden = nn.Dropout(self.dropout)(bent(dense(self.features)(x)), deterministic=deterministic)
        projected: Float[Array, "B N D"] = dense(self.features)(hidden)
        return projected


class AudioEncoder(nn.Module):
    """One row of features a frame from log-mel spectra: a residual network and a header.

    The header ``"aligned"`` averages each quarter of the frequencies and interpolates time to the frames. The header
    ``"channels"`` is the authors': the last convolution has as many channels as there are frames, and what it computes
    all over the spectrogram for channel n is the row of frame n.

    Args:
        stem: stride of the first convolution, in time and frequency.
        spectra: spectra in a row of audio features.
    """

    blocks: Sequence[int]
    channels: Sequence[int]
    stem: int
    features: int
    header: str
    spectra: int
    dropout: float

    @nn.compact
    def __call__(self, audio: Float[Array, "B N width"], deterministic: bool) -> Float[Array, "B N D"]:
        clips, frames, width = audio.shape
        x = SEResNet(self.blocks, self.channels, self.stem)(
            audio.reshape(clips, frames * self.spectra, width // self.spectra)
        )
        if self.header == "channels":
            x = group_norm(frames)(convolution(frames)(x))
            x = x.transpose(0, 3, 1, 2).reshape(clips, frames, -1)
        else:
            x = resized(_regions(x), frames)
        x = nn.Dropout(self.dropout)(dense(self.features)(x), deterministic=deterministic)
        encoded: Float[Array, "B N D"] = dense(self.features)(x)
        return encoded


def _regions(x: Float[Array, "B T F C"]) -> Float[Array, "B T _"]:
    """Means over regions of frequency, beside each other."""
    bands = x.shape[2]
    regions = min(_REGIONS, bands)
    edges = [bands * number // regions for number in range(regions + 1)]
    return jnp.concatenate(
        [jnp.mean(x[:, :, first:stop], axis=2) for first, stop in zip(edges, edges[1:], strict=False)], axis=-1
    )


def standardised(features: Float[Array, "B N D"]) -> Float[Array, "B N D"]:
    """Features with mean 0 and standard deviation 1 over each clip's frames: nothing that is constant in a clip."""
    centred = features - jnp.mean(features, axis=1, keepdims=True)
    return centred * jax.lax.rsqrt(jnp.mean(jnp.square(centred), axis=1, keepdims=True) + _LEAST)


class EmotionClassifier(nn.Module):
    """Logits of a clip's emotion from its emotion features: of all frames (``"flat"``) or their mean (``"mean"``)."""

    hidden: Sequence[int]
    classes: int
    pool: str

    @nn.compact
    def __call__(self, features: Float[Array, "B N D"]) -> Float[Array, "B E"]:
        x = features.reshape(len(features), -1) if self.pool == "flat" else jnp.mean(features, axis=1)
        for width in self.hidden:
            x = bent(dense(width)(x))
        logits: Float[Array, "B E"] = dense(self.classes)(x)
        return logits


class TextEncoder(nn.Module):
    """Features of a transcript, whose words stand on their start frames: vectors, and a causal network over frames.

    A word has the row of its hash in the table of vectors; frames without a word have zeros.
    """

    buckets: int
    width: int
    layers: int
    features: int
    dropout: float

    @nn.compact
    def __call__(self, words: Int[Array, "B N"], deterministic: bool) -> Float[Array, "B N D"]:
        table = self.param("vectors", nn.initializers.normal(self.width**-0.5), (self.buckets, self.width))
        vectors = jnp.where((words > 0)[..., None], table[words % self.buckets], 0.0)
        vectors = nn.Dropout(self.dropout)(vectors, deterministic=deterministic)
        encoded: Float[Array, "B N D"] = dense(self.features)(
            CausalTCN(self.layers, self.dropout)(vectors, deterministic)
        )
        return encoded


def start_words(words: Int[Array, "B N"], starts: Array) -> Int[Array, "B N"]:
    """The transcript as the text encoder takes it: each word's id on the frame within which it starts, else 0."""
    return jnp.where(starts, words, 0)


def unmined(features: Float[Array, "B N D"], labels: Float[Array, "B N E"] | None) -> Float[Array, "B N D2"]:
    """Input of the fusion in ablations without mining: the audio's features, with the emotion's weights or without."""
    return features if labels is None else jnp.concatenate([features, labels], axis=-1)


def emotion_probabilities(logits: Float[Array, "B E"], frames: int) -> Float[Array, "B N E"]:
    """What the classifier finds in a clip, at each of its frames."""
    probabilities = jax.nn.softmax(logits)[:, None]
    return jnp.broadcast_to(probabilities, (len(logits), frames, logits.shape[-1]))
