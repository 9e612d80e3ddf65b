"""Diversity of motions: of the clips of one motion, or of several motions for one audio.

Distances are L1 as in the position error: the norm of a joint's difference, averaged over frames and joints. Higher
is better only for natural motion: jitter is high too.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

#: Frames of the clips that a motion is cut into (Audio2Gestures, extended, Eq. 26).
CLIP_FRAMES = 50


@jax.jit
def _pair_sum(motions: Float[Array, "N T J D"]) -> Float[Array, ""]:
    """Sum over pairs of the mean L1 distance, one motion compared with all others at a time."""

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
    """Factor from :func:`mean_pair_distance` to the published sums (Eq. 26 and 27).

    These divide by ``N ceil(N / 2)`` where there are ``N (N - 1) / 2`` pairs: for 20 motions the value is 0.95 of the
    mean.
    """
    return (count * (count - 1) / 2) / (count * np.ceil(count / 2))


def clips_of(
    motion: Float[Array | np.ndarray, "T J D"], frames: int = CLIP_FRAMES
) -> Float[Array | np.ndarray, "N F J D"]:
    """Consecutive clips of a motion; a remainder is left out."""
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
    """L1div of BEAT's evaluation: L1 distance of joints from their own mean, mean over frames, summed over joints.

    Args:
        root: joint subtracted from all others, so that walking does not count; None for none, like the authors.
    """
    positions = jnp.asarray(motion)
    if root is not None:
        positions = positions - positions[:, root : root + 1]
    return float(jnp.mean(jnp.sum(jnp.abs(positions - jnp.mean(positions, axis=0, keepdims=True)), axis=(-2, -1))))
