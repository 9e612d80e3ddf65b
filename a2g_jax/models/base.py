"""The few questions that every model answers; the trainer and the generator know nothing else about it."""

from collections.abc import Callable
from typing import Any, NamedTuple

from jaxtyping import Array, Float

from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.skeleton import Skeleton

#: A pytree of arrays.
Params = Any
#: What a model keeps about its latent space after training, for sampling: a dictionary of arrays.
Summary = dict[str, Any]


class Batch(NamedTuple):
    """B clips of T frames."""

    audio: Float[Array, "B T bands"]
    """Normalised audio features."""
    pose: Float[Array, "B T J 6"]
    """Local rotations in 6D (first two columns of each matrix), not normalised."""


class Data(NamedTuple):
    """What a model is built for: everything about a corpus that is not a recording."""

    skeleton: Skeleton
    fps: float
    audio_bands: int
    pose_statistics: Statistics
    """Of the 6D rotations, over the training split; each (J, 6)."""


class Model(NamedTuple):
    """A model as a record of pure functions; parameters and keys go in, arrays come out."""

    name: str
    config: Any
    clip_frames: int
    """Length of a training clip."""
    halo: int
    """Frames of context on either side that an output frame may depend on."""
    init: Callable[..., Params]
    """``init(key) -> params``"""
    loss: Callable[..., tuple[Array, dict[str, Array]]]
    """``loss(params, key, batch, step) -> (scalar, named terms)``"""
    summarise: Callable[..., Summary]
    """``summarise(params, key, batch) -> arrays with a leading clip axis``, collected over the training split."""
    condition: Callable[..., Any]
    """``condition(params, audio (T, bands)) -> pytree``: what the samples for one audio share."""
    sample: Callable[..., Array]
    """``sample(params, summary, key, condition, start) -> pose (T, J, 6)``.

    ``start`` is the frame at which the window begins in the whole audio, a multiple of 128: randomness is a function
    of the key and the absolute frame, so any cutting into windows gives the same motion.
    """
    reconstruct: Callable[..., Array]
    """``reconstruct(params, batch) -> pose (B, T, J, 6)``: through the latent space and back, without noise."""
