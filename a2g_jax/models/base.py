"""The interface of every model: what it needs, what it can do, and how it is trained.

The trainer, the generator and the evaluation use nothing else of a model. A capability that a model lacks is None.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import optax
from jaxtyping import Array, Float, Int

from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.train_config import TrainConfig

#: A pytree of arrays whose outermost level is a dictionary of subtrees by name.
Params = Any
#: What a model keeps about its latent space after training, for sampling: a dictionary of arrays.
Summary = dict[str, Any]
#: ``loss(params, key, batch, step) -> (scalar, named terms)``; the step counts from the beginning of the stage.
Loss = Callable[..., tuple[Array, dict[str, Array]]]


class Data(NamedTuple):
    """The properties of a corpus that a model is built for."""

    space: PoseSpace
    """The body, and the kind of numbers that its poses are written in."""
    fps: float
    audio_bands: int
    pose_statistics: Statistics
    """Over the training split; each (R, D)."""
    emotions: tuple[str, ...] = ()
    """Emotions of the corpus, in the order of their indices."""
    speakers: tuple[str, ...] = ()
    """Speakers of the corpus, in the order of their indices."""
    perceptual: Callable[[Float[Array, "B T R D"]], list[Array]] | None = None
    """Features of poses, block by block, of a frozen feature network; for perceptual losses, in training alone."""
    sample_rate: int = 16000
    """Of waveforms, Hz."""
    spectra: int = 1
    """Spectra in a row of audio features, one after another in time."""


class Latents(NamedTuple):
    """Latents in place of drawn ones: ``mean_t + scale_t * drawn_t``."""

    mean: Float[Array, "T C"]
    scale: Float[Array, "T C"]


class Condition(NamedTuple):
    """Conditioning of T frames; the fields that a model does not declare in ``condition_fields`` are None."""

    audio: Float[Array, "T bands"]
    """Normalised audio features."""
    waveform: Float[Array, " samples"] | None = None
    """Samples from -1 to 1 of these frames, ``round(T * sample_rate / fps)``."""
    emotion: Float[Array, "T E"] | None = None
    """Weight of each of :attr:`Data.emotions`; rows sum to 1."""
    speaker: Int[Array, ""] | None = None
    """Index into :attr:`Data.speakers`."""
    words: Int[Array, " T"] | None = None
    """Id of the word that is spoken at each frame (:func:`a2g_jax.io.words.word_id`); 0 where there is none."""
    seed_poses: Float[Array, "S R D"] | None = None
    """Poses before the first frame of the motion, not normalised; of the whole motion, not of a window."""
    controls: Float[Array, "T K"] | None = None
    """Requested value of each of :attr:`Model.controls`, as quantiles of the training clips from 0 to 1, or as the
    number of a category; NaN for a free one."""
    style: Float[Array, " S"] | None = None
    """Of models with :attr:`Model.style_code`: the style code of a clip."""
    latents: Latents | None = None
    """Of models with :attr:`Model.encode`: latents in place of drawn ones."""


class Update(NamedTuple):
    """One gradient step within a training step: a loss, and the part of the parameters that descends it."""

    loss: Loss
    trains: tuple[str, ...] = ()
    """Top-level names of the parameters that are updated; all of them if empty. The others are constants."""
    name: str = "main"
    optimiser: Callable[[TrainConfig], optax.GradientTransformation] | None = None
    """Made of the stage's settings; None for the common one: see :func:`a2g_jax.models.optimiser.make_optimiser`."""


class Stage(NamedTuple):
    """A phase of training. Parameters that no update trains are frozen.

    The updates of a step follow one another, each with its own optimiser and clipping: the second is computed at the
    parameters that the first one left. A GAN is two updates, discriminator and generator; a network on top of a frozen
    one is a second stage.
    """

    updates: tuple[Update, ...]
    name: str = "main"
    steps: int | None = None
    """Training steps; None for those of the training's settings. At most one stage may leave them open."""
    validation_loss: Loss | None = None
    """The loss on held-out clips, where that differs (no dropout); otherwise the sum of the updates' losses."""
    warm_start: Callable[..., Params] | None = None
    """``warm_start(params, batch) -> params``, once, with the first batch of the stage: initialisation from data."""


class Density(NamedTuple):
    """The capability of models that give the likelihood of a motion."""

    log_likelihood: Callable[..., Array]
    """``log_likelihood(params, audio (B, T, bands), pose (B, T, R, D), clean=None) -> (B, N)``.

    Nats of each of the N frames that have the whole conditioning around them, given the poses before it and the audio,
    as a density of z-scores; with the treatment of noise that the model documents. The first of these frames is number
    ``history``, and ``lookahead`` frames follow the last. ``clean`` is the poses before noise was added to them, if it
    was: properties of poses are measured on those.
    """
    conditioning: Callable[..., tuple[Array, Array]]
    """``conditioning(audio, pose, clean) -> ((B, N, D), (B, N, C))``: everything that these frames are conditioned on,
    without parameters, and their z-scores."""
    history: int
    lookahead: int
    noise: float
    """Standard deviation of the noise on training poses, z-scores; 0 for none."""
    dimensions: int
    """Values of a pose that have a density; the model generates the others as constants."""
    stride: int = 1
    """Frames between the poses that have a density; N is the number of these in ``conditioning``."""


class Classifier(NamedTuple):
    """The capability of models that classify clips by :attr:`Data.emotions`."""

    logits: Callable[..., Array]
    """``logits(params, batch) -> (B, K)``"""
    input: str
    """``"motion"`` or ``"audio"``."""


class Controls(NamedTuple):
    """The capability of models whose motion follows requested properties of it."""

    names: tuple[str, ...]
    measure: Callable[..., Array] | None = None
    """Of models that are trained on them: ``measure(pose (B, T, R, D)) -> (B, T, K)``."""
    categories: Mapping[str, tuple[str, ...]] = {}
    """Names of the values of controls that are not quantiles; their values are the numbers of these names."""
    stored: tuple[str, ...] = ()
    """Arrays of the summary that a request needs; runs of earlier versions may lack them."""
    free: bool = False
    """Whether a condition without controls is that of no request; otherwise every condition has them."""


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
    stages: tuple[Stage, ...]
    """Of the training, one after another."""
    summarise: Callable[..., Summary]
    """``summarise(params, key, batch) -> arrays with a leading clip axis``, collected over the training split."""
    batch_fields: tuple[str, ...] = ("audio", "pose")
    """Fields of :class:`a2g_jax.data.batch.Batch` that training needs."""
    summary_fields: tuple[str, ...] = ()
    """The same of ``summarise``; those of training if empty."""
    needs_perceptual: bool = False
    """Whether a loss needs :attr:`Data.perceptual`."""

    finish: Callable[[Params], Params] | None = None
    """``finish(params) -> params``: those of the run, with which it generates, from those of training; None where they
    are the same."""
    use_words: Callable[[Params, tuple[str, ...]], Params] | None = None
    """``use_words(params, words) -> params``: initial parameters given the words of the training corpus, once before
    the first step and not compiled; for pretrained word vectors."""

    condition: Callable[..., Any] | None = None
    """``condition(params, summary, Condition of a window) -> pytree``: shared by all samples for one audio."""
    condition_fields: tuple[str, ...] = ("audio",)
    """Fields of :class:`Condition` that ``condition`` and ``begin`` can use."""
    requested: Callable[[int], dict[str, Any]] | None = None
    """``requested(frames) -> fields of Condition by name``, with a row for each frame of a whole motion: the
    requests of the sampling settings, used where the caller gives none."""
    sample: Callable[..., Array] | None = None
    """``sample(params, summary, key, condition, start) -> pose (T, R, D)``.

    ``start`` is the frame at which the window begins in the whole audio, a multiple of 128: randomness is a function
    of the key and the absolute frame, so any cutting into windows gives the same motion.
    """
    begin: Callable[..., Any] | None = None
    """Of autoregressive models: ``begin(params, summary, key, seed_poses) -> state`` before frame 0.

    ``seed_poses`` (S, R, D) are the last poses before it, or None for the model's own start.
    """
    proceed: Callable[..., tuple[Array, Any]] | None = None
    """``proceed(params, summary, key, condition, start, state) -> (pose (T, R, D), state)``: the next T frames.

    ``start`` is any frame, so that motion can be generated a few frames at a time.
    Every array of such a model's condition has time as its leading axis, ``T + overlap`` frames. ``sample`` is
    ``proceed`` after ``begin``.
    """
    seed_frames: int = 0
    """Poses S that ``begin`` takes."""
    lookahead: int = 0
    """Frames of audio after its own that a frame of an autoregressive model depends on."""
    overlap: int = 0
    """Frames after the T that ``proceed`` returns of which it also needs the condition."""
    fixed_window: bool = False
    """Whether a shorter window gives other last bits of the same frames, so that the engine has to use one length for
    speech of any length."""
    controls: Controls | None = None
    programs: Any = None
    """Of models some of whose sampling settings are requests alone, which ``requested`` gives as conditioning: a value
    that models of one run with other sampling settings have in common where ``condition``, ``begin``, ``proceed`` and
    ``sample`` compute the same, so that their compiled programs serve all of them."""

    reconstruct: Callable[..., Array] | None = None
    """``reconstruct(params, batch) -> pose (B, T, R, D)``: through the latent space and back, without noise."""
    encode: Callable[..., Array] | None = None
    """``encode(params, audio (T, bands), pose (T, R, D), controls (T, K), style (S,) | None) -> (N, C)``: latents of
    the frames of a clip that have ``seed_frames`` before them and ``lookahead`` after them, which
    :attr:`Condition.latents` can replay."""
    features: Callable[..., list[Array]] | None = None
    """``features(params, pose (B, T, R, D)) -> blocks (B, T, width)``: for perceptual losses and distances."""
    style_code: Callable[..., Array] | None = None
    """``style_code(params, pose (T, R, D)) -> (S,)``: what the model keeps of a clip as its style."""
    density: Density | None = None
    classifier: Classifier | None = None


def finished(model: Model, params: Params) -> Params:
    """The parameters of a run from those of its training; see :attr:`Model.finish`."""
    return params if model.finish is None else model.finish(params)
