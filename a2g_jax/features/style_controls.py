"""How high, how fast and how wide the hands are on average: what an animator steers (Alexanderson et al. 2020, Sec. 3).

Positions are metres with y up, one clip at a time; vmap over clips. Every value is an average over a window of four
seconds around its frame. Where the window reaches past an end of the clip, it is cut there, and the average is over
what is left.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

#: Seconds that a value is averaged over.
WINDOW = 4.0

Places = Float[Array | np.ndarray, "T H 3"]
Place = Float[Array | np.ndarray, "T 3"]


def hand_height(hands: Places, root: Place, fps: float, window: float = WINDOW) -> Float[Array, " T"]:
    """Mean height of the hands above the root, metres.

    Args:
        hands: positions of one wrist or both.
        root: of the root joint.
        fps: frames per second.
        window: seconds that are averaged over.
    """
    return moving_mean(jnp.mean(hands[..., 1] - root[:, None, 1], axis=-1), _reach(fps, window))


def hand_radius(hands: Places, root: Place, fps: float, window: float = WINDOW) -> Float[Array, " T"]:
    """Mean distance of the hands from the vertical line through the root, metres; arguments of :func:`hand_height`."""
    across = (hands - root[:, None])[..., jnp.array([0, 2])]
    return moving_mean(jnp.mean(jnp.linalg.norm(across, axis=-1), axis=-1), _reach(fps, window))


def hand_speed(hands: Places, fps: float, window: float = WINDOW) -> Float[Array, " T"]:
    """Mean speed of the hands, m/s, of the steps before and after each frame; 0 for a single frame.

    Hands relative to the root leave out how the whole body goes; arguments of :func:`hand_height`.
    """
    if hands.shape[0] == 1:
        return jnp.zeros(1)
    steps = jnp.mean(jnp.linalg.norm(jnp.diff(hands, axis=0), axis=-1), axis=-1) * fps
    both = 0.5 * (jnp.concatenate([steps[:1], steps]) + jnp.concatenate([steps, steps[-1:]]))
    return moving_mean(both, _reach(fps, window))


def moving_mean(x: Float[Array | np.ndarray, " T"], reach: int) -> Float[Array, " T"]:
    """Mean over each value and as many as ``reach`` on either side of it, of those that are there."""
    at = np.arange(len(x))
    low, high = np.maximum(at - reach, 0), np.minimum(at + reach + 1, len(x))
    # Sums of differences from the mean stay small, and with them the rounding over thousands of frames.
    mean = jnp.mean(x)
    sums = jnp.concatenate([jnp.zeros(1, x.dtype), jnp.cumsum(x - mean)])
    return mean + (sums[high] - sums[low]) / jnp.asarray(high - low, x.dtype)


def _reach(fps: float, window: float) -> int:
    """Frames on either side of the one in the middle of a window."""
    return round(0.5 * window * fps)
