"""The named control of EmotionGesture: the emotion of the motion, over time."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.models.base import Controls
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.models.emotion_timeline import faded

#: Name of the control.
EMOTION = "emotion"


def emotion_controls(networks: Networks) -> Controls | None:
    """The control of a run that samples emotion features or is conditioned on labels; None for others."""
    names = _names(networks)
    if len(names) < 2 or not (networks.samples_emotions or networks.config.branches == "label"):
        return None
    return Controls((EMOTION,), categories={EMOTION: names}, free=True)


def requested_emotion(networks: Networks, controls: Float[Array, "T 1"]) -> Float[Array, "T E"]:
    """Weights of the emotions at each frame, which change within half a second; NaN where the emotion is free.

    Args:
        controls: numbers of emotions, NaN where free.
    """
    numbers, fps = controls[:, 0], networks.data.fps
    columns = np.eye(networks.classes, dtype=np.float32)[
        [networks.data.emotions.index(one) for one in _names(networks)]
    ]
    own = jnp.asarray(columns)[jnp.nan_to_num(numbers).astype(int)]
    chosen = ~jnp.isnan(numbers)[:, None]
    share = faded(chosen.astype(own.dtype), fps)
    # Frames just after free ones have nothing to change from.
    weights = jnp.where(share > 0, faded(jnp.where(chosen, own, 0.0), fps) / jnp.where(share > 0, share, 1.0), own)
    return jnp.where(chosen, weights, jnp.nan)


def _names(networks: Networks) -> tuple[str, ...]:
    """Emotions that can be requested: those of the corpus, without the empty one of recordings that have no label."""
    return tuple(name for name in networks.data.emotions if name)
