"""The few questions that every model answers; the trainer and the generator know nothing else about it."""

from collections.abc import Callable
from typing import Any, NamedTuple

from jaxtyping import Array, Float

from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.skeleton import Skeleton

#: A pytree of arrays.
Params = Any
#: What a model keeps about its latent space after training, for sampling: a dictionary of arrays.
Summary = dict[str, Any]


class Data(NamedTuple):
    """What a model is built for: everything about a corpus that is not a recording."""

    body: Skeleton | PoseLayout
    """What the rows of a pose are."""
    fps: float
    audio_bands: int
    pose_statistics: Statistics
    """Over the training split; each (R, D)."""
    representation: str = "6d"
    """How a pose is written down: see :mod:`a2g_jax.geometry.pose_space`."""
    emotions: tuple[str, ...] = ()
    """Of the corpus, in the order of their indices."""
    speakers: tuple[str, ...] = ()
    """Of the corpus, in the order of their indices."""
    perceptual: Callable[[Float[Array, "B T R D"]], list[Array]] | None = None
    """Features of poses, block by block, of a frozen feature network; for perceptual losses."""

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton, where poses are its rotations."""
        if not isinstance(self.body, Skeleton):
            raise ValueError(f"poses are {self.representation}, which have no skeleton")
        return self.body


class Model(NamedTuple):
    """A model as a record of pure functions; parameters and keys go in, arrays come out.

    Models that measure instead of generating have no ``condition`` and ``sample``; classifiers no ``reconstruct``.
    """

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
    condition: Callable[..., Any] | None
    """``condition(params, audio (T, bands)) -> pytree``: what the samples for one audio share."""
    sample: Callable[..., Array] | None
    """``sample(params, summary, key, condition, start) -> pose (T, J, 6)``.

    ``start`` is the frame at which the window begins in the whole audio, a multiple of 128: randomness is a function
    of the key and the absolute frame, so any cutting into windows gives the same motion.
    """
    reconstruct: Callable[..., Array] | None
    """``reconstruct(params, batch) -> pose (B, T, R, D)``: through the latent space and back, without noise."""
    validation_loss: Callable[..., tuple[Array, dict[str, Array]]] | None = None
    """``loss`` as it is taken on held-out clips, where that differs (no dropout)."""
    warm_start: Callable[..., Params] | None = None
    """``warm_start(params, batch) -> params``, once, with the first batch of a training: initialisation from data."""
    begin: Callable[..., Any] | None = None
    """Of models whose frames depend on those before: ``begin(params, summary, key) -> carried``, before frame 0."""
    proceed: Callable[..., tuple[Array, Any]] | None = None
    """``proceed(params, summary, key, condition, start, carried) -> (pose (T, R, D), carried)``: the next T frames.

    Such a model's condition has time as the leading axis of every array. ``sample`` is ``proceed`` after ``begin``.
    """
    score: Callable[..., Array] | None = None
    """Of models that tell densities: ``score(params, audio (B, T, bands), pose (B, T, R, D), clean=None) -> (B, N)``.

    Log-likelihood in nats of each of the N frames that have all they are told of around them, given the poses before
    it and the audio, as a density of z-scores; with the treatment of noise that the model documents. The first scored
    frame is ``history_frames`` of the model's settings, and after the last there are ``lookahead_frames``. ``clean`` is
    the poses before noise was added to them, if it was: what is measured on poses is measured on those.
    """
