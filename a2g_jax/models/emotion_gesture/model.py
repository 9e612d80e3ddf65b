"""EmotionGesture as a record of pure functions."""

import math
from dataclasses import replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.models.base import Condition, Data, Model, Params, Stage, Summary, Update
from a2g_jax.models.control_curves import parse_curves
from a2g_jax.models.emotion_gesture import chunks
from a2g_jax.models.emotion_gesture.chunks import Given, State
from a2g_jax.models.emotion_gesture.config import EmotionGestureConfig
from a2g_jax.models.emotion_gesture.controls import emotion_controls, requested_emotion
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.models.emotion_gesture.objective import (
    average_loss,
    discriminator_loss,
    generate,
    generator_loss,
    mining_loss,
    vae_loss,
)
from a2g_jax.models.emotion_gesture.sampling import AUDIO, LABEL, EmotionGestureSampling
from a2g_jax.models.emotion_gesture.word_table import fill_table
from a2g_jax.models.emotion_timeline import FADE, check_emotions, emotion_rows, parse_timeline
from a2g_jax.models.optimiser import make_optimiser
from a2g_jax.models.train_config import TrainConfig

#: The emotion of the audio.
_DEFAULT = EmotionGestureSampling()
#: Adam's decay of the first moment (beta 1 of the authors' code).
_MOMENTUM = 0.5
#: Learning rate of the emotion-conditioned VAE.
_VAE_RATE = 2e-3


def build(config: EmotionGestureConfig, data: Data, sampling: EmotionGestureSampling = _DEFAULT) -> Model:
    """EmotionGesture for a corpus; see :class:`a2g_jax.models.base.Model` for its parts.

    The transcript is a target of training alone (Eq. 2); generation takes none.

    Raises:
        InputError: a corpus without emotions, an emotion that it does not have, or one for a model that has no features
            of it.
    """
    networks = Networks(config, data)
    controls = emotion_controls(networks)
    _check_sampling(networks, sampling)
    if sampling.controls:
        names, categories = ((), {}) if controls is None else (controls.names, controls.categories)
        parse_curves(sampling.controls, names, categories)
    conditioned = sampling.emotion == LABEL or sampling.names_emotions or config.branches == "label"

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """The calmest pose of each clip, and its speed, mean change of a value over three frames."""
        del params, key
        speed = jnp.mean(jnp.abs(jnp.diff(networks.flat(batch.pose), axis=1)), axis=-1)
        around = (speed[:, :-1] + speed[:, 1:]) / 2.0
        calmest = jnp.argmin(around, axis=1)
        rows = jnp.take_along_axis(batch.pose, (calmest + 1)[:, None, None, None], axis=1)[:, 0]
        # Half precision: to a thousandth of a value, and half the size of the run.
        return {"rest_pose": rows.astype(jnp.float16), "rest_speed": jnp.min(around, axis=1)}

    def condition(params: Params, summary: Summary, given: Condition) -> Given:
        """The audio of chunks, and the weights of the emotions; NaN for the audio's."""
        del params, summary
        audio, emotion = given.audio, given.emotion
        if emotion is None:
            emotion = jnp.full((len(audio), networks.classes), jnp.nan)
        before = jnp.concatenate([jnp.repeat(audio[:1], config.seed_frames, axis=0), audio[: -config.seed_frames]])
        if given.controls is None:
            return Given(audio, before, emotion)
        if given.emotion is not None:
            raise InputError("emotion and controls: both choose the emotion; give one of them.")
        return Given(audio, before, emotion, requested_emotion(networks, given.controls))

    def begin(
        params: Params, summary: Summary, key: Key[Array, ""], seed_poses: Float[Array, "S R D"] | None = None
    ) -> State:
        """State before the first frame: after the seed poses, or in a rest pose of the corpus."""
        del params
        return chunks.start(networks, summary, key, seed_poses)

    def proceed(
        params: Params, summary: Summary, key: Key[Array, ""], given: Given, start: Int[Array, ""], state: State
    ) -> tuple[Float[Array, "T R D"], State]:
        """The next frames of a motion, and the state after them."""
        del summary
        values, state = chunks.proceed(networks, params, sampling, key, given, start, state)
        return networks.pose(values[None])[0], state

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], given: Given, start: Int[Array, ""]
    ) -> Float[Array, "T R D"]:
        """A motion from frame ``start`` on, after a rest pose."""
        padded = jax.tree.map(lambda array: jnp.pad(array, ((0, config.stride - 1), (0, 0)), mode="edge"), given)
        return proceed(params, summary, key, padded, start, begin(params, summary, key))[0]

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """The clips as they are generated from their own first poses, with the emotion of their audio."""
        return networks.pose(generate(networks, params, batch)[1])

    def requested(frames: int) -> dict[str, Any]:
        """Weights of the emotions that the sampling settings name."""
        if not sampling.names_emotions:
            return {}
        text = sampling.emotion
        return {"emotion": emotion_rows(parse_timeline(text), data.emotions, frames, data.fps, text)}

    def use_words(params: Params, words: tuple[str, ...]) -> Params:
        """Initial parameters with the pretrained vectors of the corpus's words."""
        table = params["generator"]["text"]["vectors"]
        filled = fill_table(np.asarray(table), config.word_vectors, words)
        text = params["generator"]["text"] | {"vectors": jnp.asarray(filled)}
        return params | {"generator": params["generator"] | {"text": text}}

    def finish(params: Params) -> Params:
        """The parameters with the averages of the generator's weights in place of the last ones."""
        return {name: own for name, own in params.items() if name != "average"} | {"generator": params["average"]}

    reads = config.mines and config.beat_weight > 0
    return Model(
        "emotion_gesture",
        config,
        config.clip_frames,
        max(config.seed_frames, config.stride - 1, math.ceil(FADE * data.fps)),
        networks.init,
        _stages(networks),
        summarise,
        batch_fields=("audio", "pose", "emotion", *(("words", "word_starts") if reads else ())),
        finish=finish if config.averages else None,
        use_words=use_words if reads and config.word_vectors else None,
        condition=condition,
        condition_fields=(
            "audio",
            "seed_poses",
            *(("emotion",) if conditioned else ()),
            *(() if controls is None else ("controls",)),
        ),
        requested=requested,
        sample=sample,
        begin=begin,
        proceed=proceed,
        seed_frames=config.seed_frames,
        lookahead=config.stride - 1,
        overlap=config.stride - 1,
        # All chunks of a window are encoded together, and how XLA adds up products depends on their number.
        fixed_window=True,
        controls=controls,
        # Named emotions are conditioning, as labels are.
        programs=replace(sampling, emotion=LABEL if sampling.names_emotions else sampling.emotion, controls=()),
        reconstruct=reconstruct,
    )


def _stages(networks: Networks) -> tuple[Stage, ...]:
    """The stages of training: features, everything, the emotion-conditioned VAE, and motion with its samples."""
    config = networks.config
    stages = []
    if config.mines and config.mining_steps > 0:
        features = Update(mining_loss(networks, True), ("generator",))
        stages.append(Stage((features,), "mining", config.mining_steps, mining_loss(networks, False)))
    stages.append(_game(networks, Stage((), validation_loss=generator_loss(networks, False)), sampled=False))
    if networks.samples_emotions:
        update = Update(vae_loss(networks), ("vae",), optimiser=_vae_optimiser)
        measure = lambda params, batch: networks.measure_features(params, batch.audio)  # noqa: E731
        stages.append(Stage((update,), "emotion_vae", config.vae_steps, warm_start=measure))
    if config.trains_sampled:
        held_out = generator_loss(networks, False, True)
        stages.append(_game(networks, Stage((), "sampled", config.sampled_steps, held_out), sampled=True))
    return tuple(stages)


def _game(networks: Networks, stage: Stage, sampled: bool) -> Stage:
    """A stage with the updates of the generator and its discriminator; the last one also averages the generator.

    Args:
        sampled: with sampled emotion features.
    """
    config = networks.config
    optimiser = partial(make_optimiser, momentum=_MOMENTUM)
    generator = Update(generator_loss(networks, True, sampled), ("generator",), "generator", optimiser)
    if config.adversarial_weight == 0:
        return stage._replace(updates=(generator,))
    slower = lambda settings: optimiser(  # noqa: E731
        replace(settings, learning_rate=config.discriminator_rate * settings.learning_rate)
    )
    judge = Update(discriminator_loss(networks, True, sampled), ("discriminator",), "discriminator", slower)
    if not config.averages or sampled != config.trains_sampled:
        return stage._replace(updates=(judge, generator))
    average = Update(average_loss, ("average",), "average", lambda _: optax.sgd(1.0 - config.average_decay))
    begin = lambda params, _: params | {"average": params["generator"]}  # noqa: E731
    return stage._replace(updates=(judge, generator, average), warm_start=begin)


def _vae_optimiser(settings: TrainConfig) -> optax.GradientTransformation:
    """Adam at a rate of its own, which falls to a hundredth: the VAE is small, and its loss no game."""
    return optax.adam(optax.cosine_decay_schedule(_VAE_RATE, settings.steps, alpha=0.01))


def _check_sampling(networks: Networks, sampling: EmotionGestureSampling) -> None:
    """Refuse an emotion that the model cannot show."""
    text = sampling.emotion
    if sampling.names_emotions:
        check_emotions(parse_timeline(text), networks.data.emotions, text)
    takes_labels = networks.config.branches == "label" and text != "sample"
    if text not in (AUDIO, LABEL) and not networks.samples_emotions and not takes_labels:
        raise InputError(
            f"--emotion {text!r}: the run has no emotion-conditioned VAE to sample it from; train one with --vae-steps"
            " above 0 and --branches emotion-beat."
        )
