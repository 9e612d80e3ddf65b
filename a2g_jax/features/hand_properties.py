"""Properties of gesturing that animators name: energy, height, radius, rate of strokes and handedness.

Positions are metres with y up, one clip at a time; vmap over clips.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from a2g_jax.features.style_controls import hand_height, hand_radius

#: The properties, in the order of their columns.
PROPERTIES = ("energy", "height", "radius", "rate", "handedness")
#: Standard deviation of the Gaussian that wrists are smoothed by before strokes are counted, seconds.
SMOOTHING = 0.08
#: A stroke is the fastest moment within this time on either side, seconds, at least this fast, m/s, and faster than
#: this share of the clip's 95th percentile.
APART, LEAST, SHARE = 0.2, 0.1, 0.3

Hands = Float[Array | np.ndarray, "T 2 3"]


def hand_properties(hands: Hands, root: Float[Array | np.ndarray, "T 3"], fps: float) -> Float[Array, " 5"]:
    """The properties of a clip, in the order of :data:`PROPERTIES`.

    - energy: mean speed of both wrists, m/s
    - height: mean height of the wrists above the root, m
    - radius: mean distance of the wrists from the vertical through the root, m
    - rate: strokes a second
    - handedness: the right wrist's share of the distance that both travel; 0 left alone, 1 right alone

    Args:
        hands: positions of the left and the right wrist, two frames or more.
        root: positions of the root joint; walking does not count.
    """
    local = hands - root[:, None]
    travel = jnp.sum(jnp.linalg.norm(jnp.diff(local, axis=0), axis=-1), axis=0)
    return jnp.stack(
        [
            jnp.mean(travel) / (len(local) - 1) * fps,
            jnp.mean(hand_height(hands, root, fps, 0.0)),
            jnp.mean(hand_radius(hands, root, fps, 0.0)),
            stroke_rate(local, fps),
            travel[1] / jnp.maximum(jnp.sum(travel), 1e-9),
        ]
    )


def stroke_rate(hands: Hands, fps: float) -> Float[Array, ""]:
    """Strokes a second: peaks of the faster wrist's smoothed speed."""
    speed = jnp.linalg.norm(jnp.diff(_smooth(hands, SMOOTHING * fps), axis=0), axis=-1).max(axis=-1) * fps
    reach = max(1, round(APART * fps))
    highest = lax.reduce_window(speed, -jnp.inf, lax.max, (2 * reach + 1,), (1,), "SAME")
    # The first of equal neighbours, so that a plateau is one peak.
    before = jnp.concatenate([jnp.full(1, -jnp.inf), speed[:-1]])
    fast = speed >= jnp.maximum(LEAST, SHARE * jnp.percentile(speed, 95.0))
    peaks = jnp.asarray((speed == highest) & (speed > before) & fast)
    return jnp.sum(peaks) / (len(speed) / fps)


def _smooth(hands: Hands, deviation: float) -> Float[Array, "T 2 3"]:
    """Positions smoothed by a Gaussian, their ends repeated."""
    reach = max(1, round(3.0 * deviation))
    window = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) / deviation))
    around = jnp.pad(jnp.asarray(hands), ((reach, reach), (0, 0), (0, 0)), mode="edge")
    shifted = jnp.stack([around[first : first + len(hands)] for first in range(len(window))], axis=-1)
    return shifted @ jnp.asarray(window / window.sum(), shifted.dtype)
