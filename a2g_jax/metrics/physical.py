"""Physical plausibility: smoothness, rest and foot skate. Positions in metres."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

#: A foot stands within this height (m) above its lowest position and below this vertical speed (m/s).
FOOT_HEIGHT, FOOT_LIFT = 0.03, 0.1


def jerk(positions: Float[Array | np.ndarray, "T *joints D"], fps: float) -> Float[Array, "t *joints"]:
    """Norm of the third difference times ``fps**3``, m/s^3; three frames fewer."""
    return jnp.linalg.norm(jnp.diff(positions, n=3, axis=0), axis=-1) * fps**3


def speeds(positions: Float[Array | np.ndarray, "T *joints D"], fps: float) -> Float[Array, "t *joints"]:
    """Norm of the first difference times ``fps``, m/s; one frame fewer."""
    return jnp.linalg.norm(jnp.diff(positions, axis=0), axis=-1) * fps


def rest_share(positions: Float[Array | np.ndarray, "T J D"], fps: float, below: float = 0.05) -> Float[Array, ""]:
    """Share of time in which no joint is faster than ``below`` m/s."""
    return jnp.mean(jnp.all(speeds(positions, fps) < below, axis=-1).astype(positions.dtype))


def foot_skate(
    feet: Float[Array | np.ndarray, "T F 3"], fps: float, up: int = 1, faster: float = 0.1
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Foot skate: share of standing time in which a foot slides faster than ``faster`` m/s, and metres along the floor
    per second of standing.

    A foot stands in a frame where it is within 3 cm of its own lowest position and slower than 0.1 m/s vertically.

    Args:
        up: the vertical axis.
    """
    step = jnp.diff(feet, axis=0) * fps
    along = jnp.linalg.norm(jnp.delete(step, up, axis=-1), axis=-1)
    height = feet[1:, :, up] - jnp.min(feet[..., up], axis=0, keepdims=True)
    stands = (height < FOOT_HEIGHT) & (jnp.abs(step[..., up]) < FOOT_LIFT)
    total = jnp.maximum(jnp.sum(stands), 1)
    slides = stands & (along > faster)
    return jnp.sum(slides) / total, jnp.sum(jnp.where(stands, along, 0.0)) / total
