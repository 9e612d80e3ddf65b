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


#: Filters before changes are measured, and over the weights that come from them.
_CHANGE_PASSES, _WEIGHT_PASSES = 1, 2
#: A filter that removes what alternates from frame to frame and keeps 98 % of what repeats every eight frames.
_FLAT = (-1 / 16, 4 / 16, 10 / 16, 4 / 16, -1 / 16)


def adaptively_smoothed(
    x: Float[Array, "B T C"], passes: int, speed: float | Float[np.ndarray, " C"]
) -> Float[Array, "B T C"]:
    """The sequence, smoothed by ``passes`` binomial filters where a value hardly changes and less the faster it does.

    The output is s + g (q - s) with the smoothed sequence s, the sequence q without what alternates from frame to
    frame, and g = v^2 / (v^2 + speed^2), where v is the change in a frame. Like the 1 euro filter (Casiez et al., CHI
    2012), whose cutoff rises with speed, but without delay: frames on both sides count, :func:`adaptive_reach` of them.

    Args:
        speed: change in a frame at which both count half, for all channels or for each one.
    """
    around = jnp.pad(smoothed(x, _CHANGE_PASSES), ((0, 0), (1, 1), (0, 0)), mode="edge")
    change = smoothed(jnp.abs(around[:, 2:] - around[:, :-2]) / 2.0, _WEIGHT_PASSES)
    half = jnp.square(jnp.broadcast_to(speed, x.shape[-1:]))[None, None]
    quick = jnp.square(change) / (jnp.square(change) + half)
    slow, side = smoothed(x, passes), len(_FLAT) // 2
    around = jnp.pad(x, ((0, 0), (side, side), (0, 0)), mode="edge")
    flat = sum(weight * around[:, place : place + x.shape[1]] for place, weight in enumerate(_FLAT))
    return slow + quick * (flat - slow)


def adaptive_reach(passes: int) -> int:
    """Frames on either side that a frame of :func:`adaptively_smoothed` depends on."""
    return max(passes, _CHANGE_PASSES + 1 + _WEIGHT_PASSES)


def shifted(x: Float[Array, "B T C"], frames: Int[Array, " B"] | None) -> Float[Array, "B T C"]:
    """Each sequence delayed by a number of frames of its own, its first or last frame repeated; as it is for None."""
    if frames is None:
        return x
    length = x.shape[1]
    rows = jnp.clip(jnp.arange(length)[None] - frames[:, None], 0, length - 1)
    return jnp.take_along_axis(x, rows[:, :, None], axis=1)
