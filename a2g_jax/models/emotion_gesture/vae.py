"""The emotion-conditioned VAE of emotion features (Sec. III-B2), trained after everything else is frozen."""

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float, Key

from a2g_jax.models.emotion_gesture.mining import dense
from a2g_jax.nn.conv import Conv1D, Dense
from a2g_jax.nn.rates import resized
from a2g_jax.nn.strided import StridedConv1D

#: Frames of a step of the features that the latent is made of.
_RATE = 4
#: Bound of log-variances, so that no exponential overflows.
_WIDEST = 8.0


class FeatureEncoder(nn.Module):
    """Mean and log-variance of a clip's latent, given its emotion features and its label.

    Convolutions over time; the authors' have frames as channels and run over the order of the features.
    """

    channels: int
    latent: int

    @nn.compact
    def __call__(
        self, features: Float[Array, "B N D"], label: Float[Array, "B E"]
    ) -> tuple[Float[Array, "B Z"], Float[Array, "B Z"]]:
        clips, frames, _ = features.shape
        labels = jnp.broadcast_to(label[:, None], (clips, frames, label.shape[-1]))
        x = jnp.concatenate([features, labels], axis=-1)
        for _ in range(2):
            x = nn.leaky_relu(StridedConv1D(self.channels)(x))
        x = x.reshape(clips, -1)
        mean: Float[Array, "B Z"] = dense(self.latent)(x)
        spread: Float[Array, "B Z"] = dense(self.latent)(x)
        return mean, _WIDEST * jnp.tanh(spread / _WIDEST)


class FeatureDecoder(nn.Module):
    """Emotion features of a clip from its latent and its label."""

    channels: int
    frames: int
    features: int

    @nn.compact
    def __call__(self, latent: Float[Array, "B Z"], label: Float[Array, "B E"]) -> Float[Array, "B N D"]:
        steps = -(-self.frames // _RATE)
        x = nn.leaky_relu(dense(4 * self.channels)(jnp.concatenate([latent, label], axis=-1)))
        x = nn.leaky_relu(dense(steps * self.channels)(x)).reshape(len(latent), steps, self.channels)
        x = nn.leaky_relu(Conv1D(self.channels)(resized(x, self.frames)))
        return Dense(self.features)(x)


def draw(key: Key[Array, ""], mean: Float[Array, "B Z"], log_variance: Float[Array, "B Z"]) -> Float[Array, "B Z"]:
    """A latent of each clip."""
    return mean + jnp.exp(0.5 * log_variance) * jax.random.normal(key, mean.shape, mean.dtype)


def divergence(mean: Float[Array, "B Z"], log_variance: Float[Array, "B Z"]) -> Float[Array, ""]:
    """KL divergence from the standard normal distribution, nats, the mean over clips."""
    return jnp.mean(0.5 * jnp.sum(jnp.exp(log_variance) + mean**2 - 1.0 - log_variance, axis=-1))


def relative_error(
    target: Float[Array, "B N D"], made: Float[Array, "B N D"], scale: Float[Array, " D"]
) -> Float[Array, ""]:
    """Squared error of features in units of their standard deviation ``scale``: about 1 for their mean."""
    return jnp.mean(jnp.square((target - made) / scale[None, None]))
