"""Sequences at a lower rate: means over groups of frames, linear interpolation back to frames, and smoothing."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int


def pooled(x: Float[Array, "B T C"], frames: int) -> Float[Array, "B _ C"]:
    """Mean of every group of ``frames`` frames; the sequence itself for groups of one.

    Raises:
        ValueError: the number of frames is not a multiple of the group's.
    """
    if frames == 1:
        return x
    clips, length, channels = x.shape
    if length % frames:
        raise ValueError(f"expected a multiple of {frames} frames; got {length}")
    return jnp.mean(x.reshape(clips, length // frames, frames, channels), axis=2)


def interpolated(x: Float[Array, "B N C"], frames: int) -> Float[Array, "B _ C"]:
    """N steps as ``N * frames`` frames, linear between the centres of the steps and constant beyond the outermost.

    A frame depends on its own step and one neighbour, so a constant stays constant, and a group's mean of a linear
    sequence is the step itself.
    """
    if frames == 1:
        return x
    clips, steps, channels = x.shape
    around = jnp.pad(x, ((0, 0), (1, 1), (0, 0)), mode="edge")
    neighbours = jnp.stack([around[:, first : first + steps] for first in range(3)], axis=2)
    weights = jnp.asarray(_weights(frames), x.dtype)
    return jnp.einsum("jn,bknc->bkjc", weights, neighbours).reshape(clips, steps * frames, channels)


def resized(x: Float[Array, "B N C"], frames: int) -> Float[Array, "B frames C"]:
    """N steps over the duration of a clip as ``frames`` frames: linear between the centres, constant beyond them."""
    steps = x.shape[1]
    place = np.clip((np.arange(frames) + 0.5) * steps / frames - 0.5, 0.0, steps - 1.0)
    weights = np.maximum(1.0 - np.abs(place[:, None] - np.arange(steps)[None]), 0.0)
    return jnp.einsum("tn,bnc->btc", jnp.asarray(weights, x.dtype), x)


def _weights(frames: int) -> Float[np.ndarray, "frames 3"]:
    """Weights of the previous, the own and the next step for each frame of a step."""
    place = (np.arange(frames) + 0.5) / frames - 0.5
    return np.stack([np.maximum(-place, 0.0), 1.0 - np.abs(place), np.maximum(place, 0.0)], axis=1)


def smoothed(x: Float[Array, "B T C"], passes: int) -> Float[Array, "B T C"]:
    """The sequence after ``passes`` binomial filters (1/4, 1/2, 1/4), with its first and last frame repeated.

    One pass removes what alternates from frame to frame, and halves what repeats every four frames.
    """
    for _ in range(passes):
        around = jnp.pad(x, ((0, 0), (1, 1), (0, 0)), mode="edge")
        x = 0.25 * around[:, :-2] + 0.5 * x + 0.25 * around[:, 2:]
    return x


def shifted(x: Float[Array, "B T C"], frames: Int[Array, " B"] | None) -> Float[Array, "B T C"]:
    """Each sequence delayed by a number of frames of its own, its first or last frame repeated; as it is for None."""
    if frames is None:
        return x
    length = x.shape[1]
    rows = jnp.clip(jnp.arange(length)[None] - frames[:, None], 0, length - 1)
    return jnp.take_along_axis(x, rows[:, :, None], axis=1)
