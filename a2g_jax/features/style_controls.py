"""Style controls: average height, radius and speed of the hands (Alexanderson et al. 2020, Sec. 3).

Positions are metres with y up, one clip at a time; vmap over clips. Every value is an average over a window of four
seconds around its frame, truncated at the ends of the clip.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

#: Length of the averaging window, seconds.
WINDOW = 4.0

Places = Float[Array | np.ndarray, "T H 3"]
Place = Float[Array | np.ndarray, "T 3"]


def hand_height(hands: Places, root: Place, fps: float, window: float = WINDOW) -> Float[Array, " T"]:
    """Mean height of the hands above the root, metres.

    Args:
        hands: positions of one wrist or both.
        root: positions of the root joint.
        fps: frames per second.
        window: length of the averaging window, seconds.
    """
    return moving_mean(jnp.mean(hands[..., 1] - root[:, None, 1], axis=-1), _reach(fps, window))


def hand_radius(hands: Places, root: Place, fps: float, window: float = WINDOW) -> Float[Array, " T"]:
    """Mean distance of the hands from the vertical line through the root, metres; arguments of :func:`hand_height`."""
    across = (hands - root[:, None])[..., jnp.array([0, 2])]
    return moving_mean(jnp.mean(jnp.linalg.norm(across, axis=-1), axis=-1), _reach(fps, window))


def hand_speed(hands: Places, fps: float, window: float = WINDOW) -> Float[Array, " T"]:
    """Mean speed of the hands, m/s, from the steps before and after each frame; 0 for a single frame.

    Give positions relative to the root to exclude locomotion; arguments of :func:`hand_height`.
    """
    if hands.shape[0] == 1:
        return jnp.zeros(1)
    steps = jnp.mean(jnp.linalg.norm(jnp.diff(hands, axis=0), axis=-1), axis=-1) * fps
    both = 0.5 * (jnp.concatenate([steps[:1], steps]) + jnp.concatenate([steps, steps[-1:]]))
    return moving_mean(both, _reach(fps, window))


def moving_mean(x: Float[Array | np.ndarray, " T"], reach: int) -> Float[Array, " T"]:
    """Mean over each value and up to ``reach`` values on either side of it."""
    at = np.arange(len(x))
    low, high = np.maximum(at - reach, 0), np.minimum(at + reach + 1, len(x))
    # Cumulative sums of deviations from the mean keep rounding errors small over thousands of frames.
    mean = jnp.mean(x)
    sums = jnp.concatenate([jnp.zeros(1, x.dtype), jnp.cumsum(x - mean)])
    return mean + (sums[high] - sums[low]) / jnp.asarray(high - low, x.dtype)


def _reach(fps: float, window: float) -> int:
    """Frames on either side of the central frame of a window."""
    return round(0.5 * window * fps)
