"""The decoder of prompts to poses, and the discriminator of motion (Sec. III-C and III-D)."""

from collections.abc import Sequence

import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.models.emotion_gesture.mining import bent, dense
from a2g_jax.nn.rates import smoothed
from a2g_jax.nn.strided import StridedConv1D
from a2g_jax.nn.transformer import Encoder, PostNormLayer, sinusoids

#: Factor on the speed of the last initial pose, for each frame after it.
_SLOWING = 0.6
#: Logit of the share of the held pose, at first more than half: it leaves for the mean pose within some frames.
_HELD, _LEAVING = 5.0, 4.0
#: Layers of the patch discriminator that halve time; a score depends on 46 frames.
_HALVINGS = 4


class PoseDecoder(nn.Module):
    """Poses of all frames: layers in which the prompt attends to the audio (Eq. 5), and a perceptron.

    Args:
        values: numbers of a pose.
        positions: whether prompts get a position encoding.
        smoothing: binomial filters over time at the end.
    """

    layers: int
    heads: int
    hidden: int
    values: int
    positions: bool
    smoothing: int
    dropout: float

    @nn.compact
    def __call__(
        self, prompt: Float[Array, "B N D"], audio: Float[Array, "B N D"], deterministic: bool
    ) -> Float[Array, "B N C"]:
        channels = prompt.shape[-1]
        x = prompt
        if self.positions:
            x = x + jnp.asarray(sinusoids(x.shape[1], channels), x.dtype)[None]
        for _ in range(self.layers):
            x = PostNormLayer(channels, self.heads, self.hidden, self.dropout)(x, audio, deterministic)
        for width in (4 * channels, channels):
            x = nn.Dropout(self.dropout)(bent(dense(width)(x)), deterministic=deterministic)
        poses: Float[Array, "B N C"] = dense(self.values)(dense(self.values)(x))
        return smoothed(poses, self.smoothing)


class SeedHold(nn.Module):
    """The initial poses, and after them the last one on its way to a mean pose, by a learned share for each value.

    The last pose keeps moving first, slower with each frame, so that the speed has no step.
    """

    frames: int

    @nn.compact
    def __call__(self, seed: Float[Array, "B M C"], mean: Float[Array, " C"]) -> Float[Array, "B N C"]:
        later = self.frames - seed.shape[1]
        learned = self.param("share", nn.initializers.zeros_init(), (later, seed.shape[2]))
        share = nn.sigmoid(learned + _HELD * jnp.exp(-jnp.arange(later) / _LEAVING)[:, None])[None]
        centre = mean[None, None]
        way = jnp.cumsum(_SLOWING ** (1.0 + jnp.arange(later)))[None, :, None]
        held = seed[:, -1:] + way * (seed[:, -1:] - seed[:, -2:-1])
        return jnp.concatenate([seed, centre + share * (held - centre)], axis=1)


class PatchDiscriminator(nn.Module):
    """Logits for overlapping stretches of a motion with its audio, given an emotion; positive for recorded ones.

    The emotion enters by a product with the features of a stretch (Miyato and Koyama 2018). A second head classifies
    the emotion of each clip from the motion alone (Odena et al. 2017).
    """

    channels: int

    @nn.compact
    def __call__(
        self, motion: Float[Array, "B N D"], audio: Float[Array, "B N bands"], label: Float[Array, "B E"]
    ) -> tuple[Float[Array, "B _"], Float[Array, "B E"]]:
        moved = dense(self.channels)(motion)
        sound = dense(self.channels)(audio)
        x, y = bent(moved + sound), bent(moved)
        for _ in range(_HALVINGS):
            x = bent(StridedConv1D(self.channels)(x))
            y = bent(StridedConv1D(self.channels)(y))
        shown = nn.Dense(self.channels, use_bias=False, kernel_init=nn.initializers.xavier_uniform())(label)
        product = jnp.sum(x * shown[:, None], axis=-1) / self.channels**0.5
        return dense(1)(x)[..., 0] + product, dense(label.shape[-1])(jnp.mean(y, axis=1))


class Discriminator(nn.Module):
    """A logit for each motion, positive for recorded ones; its input is the differences between frames."""

    channels: int
    layers: int
    heads: int
    hidden: Sequence[int]

    @nn.compact
    def __call__(self, offsets: Float[Array, "B N C"]) -> tuple[Float[Array, "B 1"], None]:
        x = Encoder(self.layers, self.heads, 4 * self.channels, 0.0)(dense(self.channels)(offsets), True)
        x = bent(dense(self.channels // 2)(x)).reshape(len(offsets), -1)
        for width in self.hidden:
            x = bent(dense(width)(x))
        logits: Float[Array, "B 1"] = dense(1)(x)
        return logits, None
