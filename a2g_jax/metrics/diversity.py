"""How different motions are from each other: clips of one motion, or motions for one audio.

Distances are L1 as in the position error: the norm of a joint's difference, averaged over frames and joints. More is
better only for motion that is natural: jitter scores high.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

#: Frames of the clips that a motion is cut into (Audio2Gestures, extended, Eq. 26).
CLIP_FRAMES = 50


@jax.jit
def _pair_sum(motions: Float[Array, "N T J D"]) -> Float[Array, ""]:
    """Sum over pairs of the mean L1 distance, one motion against all others at a time."""

    def against_all(motion: Float[Array, "T J D"]) -> Float[Array, ""]:
        distance = jnp.sum(jnp.abs(motions - motion[None]), axis=-1)
        return jnp.sum(jnp.mean(distance, axis=(-2, -1)))

    return jnp.sum(jax.lax.map(against_all, motions)) / 2.0


def mean_pair_distance(motions: Float[Array | np.ndarray, "N T J D"]) -> float:
    """Mean L1 distance over the N (N - 1) / 2 pairs of motions.

    Raises:
        ValueError: fewer than two motions.
    """
    count = len(motions)
    if count < 2:
        raise ValueError(f"expected two motions or more; got {count}")
    return float(_pair_sum(jnp.asarray(motions))) / (count * (count - 1) / 2)


def paper_factor(count: int) -> float:
    """What turns :func:`mean_pair_distance` into the published sums (Eq. 26 and 27).

    They divide by ``N ceil(N / 2)`` where there are ``N (N - 1) / 2`` pairs: for 20 motions the value is 0.95 of the
    mean.
    """
    return (count * (count - 1) / 2) / (count * np.ceil(count / 2))


def clips_of(
    motion: Float[Array | np.ndarray, "T J D"], frames: int = CLIP_FRAMES
) -> Float[Array | np.ndarray, "N F J D"]:
    """A motion cut into clips one after another; a remainder is left out."""
    count = motion.shape[0] // frames
    return motion[: count * frames].reshape(count, frames, *motion.shape[1:])


def diversity(motion: Float[Array | np.ndarray, "T J D"], frames: int = CLIP_FRAMES) -> float:
    """Diversity of one long motion as published (Eq. 26): its clips against each other, with the paper's prefactor.

    Raises:
        ValueError: fewer than two clips long.
    """
    clips = clips_of(motion, frames)
    return mean_pair_distance(clips) * paper_factor(len(clips))


def multimodality(motions: Float[Array | np.ndarray, "N T J D"]) -> float:
    """Multimodality of N motions for one audio as published (Eq. 27), with the paper's prefactor; N is 20 there."""
    return mean_pair_distance(motions) * paper_factor(len(motions))


def l1_div(motion: Float[Array | np.ndarray, "T J D"], root: int | None = 0) -> float:
    """L1div of BEAT's evaluation: how far joints are from their own mean, L1, averaged over frames and summed over
    joints.

    Args:
        root: joint that is taken from all others first, so that walking does not count; None leaves positions as they
            are, as the authors do.
    """
    places = jnp.asarray(motion)
    if root is not None:
        places = places - places[:, root : root + 1]
    return float(jnp.mean(jnp.sum(jnp.abs(places - jnp.mean(places, axis=0, keepdims=True)), axis=(-2, -1))))
