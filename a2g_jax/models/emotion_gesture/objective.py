"""The objective of EmotionGesture (Eq. 9) as losses of updates, and that of the emotion-conditioned VAE."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.models.base import Params
from a2g_jax.models.emotion_gesture import losses, vae
from a2g_jax.models.emotion_gesture.mining import start_words
from a2g_jax.models.emotion_gesture.networks import AudioFeatures, DropoutKey, Networks

Terms = dict[str, Array]


def one_hot(networks: Networks, batch: Batch) -> Float[Array, "B E"]:
    """Labels of the clips."""
    assert batch.emotion is not None
    return jax.nn.one_hot(batch.emotion, networks.classes)


def generate(
    networks: Networks, params: Params, batch: Batch, key: DropoutKey = None
) -> tuple[AudioFeatures, Float[Array, "B N C"], Float[Array, "B N C"]]:
    """The features of the audio of clips, their generated motions from their first poses on, and the true ones."""
    config = networks.config
    target = networks.flat(batch.pose)
    audio = networks.encode_audio(params, batch.audio, key)
    labels = None
    if config.branches == "label":
        label = one_hot(networks, batch)[:, None]
        labels = jnp.broadcast_to(label, (len(label), config.clip_frames, networks.classes))
    return audio, networks.decode(params, audio, target[:, : config.seed_frames], labels, key), target


class Judged(NamedTuple):
    """Generated motions as the discriminator gets them."""

    motion: Float[Array, "B2 N C"]
    audio: Float[Array, "B2 N bands"]
    label: Float[Array, "B2 E"]


def judged(
    networks: Networks,
    params: Params,
    batch: Batch,
    audio: AudioFeatures,
    made: Float[Array, "B N C"],
    key: DropoutKey,
    latent: Float[Array, "B Z"] | None = None,
) -> Judged:
    """The motions of a batch, and those with the emotion of the next clip, if exchanged.

    With sampled features every other clip keeps its own emotion: a chunk in generation begins with poses that already
    show the emotion, and must not show more and more of it.

    Args:
        latent: of the VAE, to sample the features of those emotions; None for the features of the next clips.
    """
    label = one_hot(networks, batch)
    if not networks.config.exchanges or audio.emotion is None:
        return Judged(made, batch.audio, label)
    wanted = jnp.roll(label, 1, axis=0)
    seed = networks.flat(batch.pose)[:, : networks.config.seed_frames]
    if latent is None:
        features = jnp.roll(audio.emotion, 1, axis=0)
    else:
        wanted = jnp.where(jnp.arange(len(label))[:, None] % 2 == 0, label, wanted)
        features = networks.decode_emotion(params, latent, wanted)
        seed = continued(networks, params, audio, features, seed, key)
    exchanged = networks.decode(params, audio._replace(emotion=features), seed, None, key)
    return Judged(
        jnp.concatenate([made, exchanged]), jnp.concatenate([batch.audio] * 2), jnp.concatenate([label, wanted])
    )


def continued(
    networks: Networks,
    params: Params,
    audio: AudioFeatures,
    emotion: Float[Array, "B N D"],
    seed: Float[Array, "B M C"],
    key: DropoutKey,
) -> Float[Array, "B M C"]:
    """Initial poses as generation gives them to itself: the last ones of chunks with the same emotion, as constants.

    Clip ``i`` continues ``i mod (continued_chunks + 1)`` chunks, whose audio is that of the clips before it. With
    recorded initial poses alone, errors of a chunk are never among the initial poses of training, and accumulate.

    Args:
        emotion: emotion features of the chunks.
        seed: recorded initial poses.
    """
    config, space = networks.config, networks.data.space
    params, audio, emotion = jax.lax.stop_gradient((params, audio, emotion))
    depth = jnp.arange(len(seed))[:, None, None] % (config.continued_chunks + 1)

    def proceed(chunk: Int[Array, ""], seed: Float[Array, "B M C"]) -> Float[Array, "B M C"]:
        before = audio._replace(beat=jnp.roll(audio.beat, chunk + 1, axis=0), emotion=emotion)
        made = networks.decode(params, before, seed, None, key)[:, -config.seed_frames :]
        valid = networks.flat(space.valid(networks.pose(made)))
        return jnp.where(chunk < depth, valid, seed)

    return jax.lax.fori_loop(0, config.continued_chunks, proceed, seed)


def _latent(networks: Networks, key: Key[Array, ""], batch: Batch, sampled: bool) -> Float[Array, "B Z"] | None:
    """Random latents of the VAE for a batch, where its features are sampled."""
    shape = (len(batch.pose), networks.config.vae_latent)
    return jax.random.normal(jax.random.fold_in(key, 2), shape) if sampled else None


def mining_loss(networks: Networks, training: bool) -> Callable[..., tuple[Array, Terms]]:
    """The losses of the features alone: emotion classification and beat alignment (Eq. 2).

    Args:
        training: with dropout.
    """

    def loss(params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]) -> tuple[Float[Array, ""], Terms]:
        del step
        dropout = key if training else None
        terms, weights = _mined(networks, params, batch, networks.encode_audio(params, batch.audio, dropout), dropout)
        return _total(terms, weights), terms

    return loss


def generator_loss(networks: Networks, training: bool, sampled: bool = False) -> Callable[..., tuple[Array, Terms]]:
    """The generator's loss: Eq. 9 with the generator's side of Eq. 8.

    Args:
        training: with dropout.
        sampled: exchanged emotion features are samples of the VAE, and what they depend on is a constant.
    """
    config = networks.config

    def loss(params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]) -> tuple[Float[Array, ""], Terms]:
        del step
        dropout = key if training else None
        if sampled:
            params = networks.freeze_mining(params)
        audio, made, target = generate(networks, params, batch, dropout)
        terms = {"reconstruction": losses.reconstruction(target, made)}
        weights = {"reconstruction": config.reconstruction_weight}
        if config.smooth_weight > 0:
            terms["smooth"] = losses.motion_smooth(target, made, config.smooth_temperature)
            weights["smooth"] = config.smooth_weight
        if config.adversarial_weight > 0:
            frozen = params | {"discriminator": jax.lax.stop_gradient(params["discriminator"])}
            latent = _latent(networks, key, batch, sampled)
            fake = judged(networks, frozen, batch, audio, made, dropout, latent)
            scores, shown = networks.judge(frozen, *fake)
            terms["adversarial"] = losses.generator_adversarial(scores)
            weights["adversarial"] = config.adversarial_weight
            if shown is not None and config.shown_emotion_weight > 0:
                terms["shown_emotion"] = jnp.mean(optax.softmax_cross_entropy(shown, fake.label))
                weights["shown_emotion"] = config.shown_emotion_weight
        mined, mined_weights = _mined(networks, params, batch, audio, dropout)
        return _total(terms | mined, weights | mined_weights), terms | mined

    return loss


def _mined(
    networks: Networks, params: Params, batch: Batch, audio: AudioFeatures, key: DropoutKey
) -> tuple[Terms, dict[str, float]]:
    """The losses of the features of a batch, with their weights; the accuracy of the emotions has none."""
    config = networks.config
    terms: Terms = {}
    weights: dict[str, float] = {}
    if audio.logits is not None and batch.emotion is not None:
        if config.emotion_weight > 0:
            terms["emotion"] = jnp.mean(optax.softmax_cross_entropy_with_integer_labels(audio.logits, batch.emotion))
            weights["emotion"] = config.emotion_weight
        right = jnp.argmax(audio.logits, axis=-1) == batch.emotion
        terms["emotion_accuracy"] = jnp.mean(right.astype(jnp.float32))
    if batch.words is not None and batch.word_starts is not None:
        text = networks.encode_text(params, start_words(batch.words, batch.word_starts), key)
        terms["beat"] = losses.beat_alignment(
            text, audio.beat, batch.word_starts, config.beat_temperature, config.beat_form
        )
        weights["beat"] = config.beat_weight
    return terms, weights


def _total(terms: Terms, weights: dict[str, float]) -> Float[Array, ""]:
    return sum((weight * terms[name] for name, weight in weights.items()), start=jnp.zeros(()))


def discriminator_loss(networks: Networks, training: bool, sampled: bool = False) -> Callable[..., tuple[Array, Terms]]:
    """The discriminator's side of Eq. 8, and its classification of emotions; the generator is a constant.

    Args:
        training: with dropout in the generator.
        sampled: exchanged emotion features are samples of the VAE.
    """
    config = networks.config

    def loss(params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]) -> tuple[Float[Array, ""], Terms]:
        del step
        frozen = params | {"generator": jax.lax.stop_gradient(params["generator"])}
        dropout = key if training else None
        audio, made, target = generate(networks, frozen, batch, dropout)
        label = one_hot(networks, batch)
        real, shown = networks.judge(params, target, batch.audio, label)
        latent = _latent(networks, key, batch, sampled)
        fake, _ = networks.judge(params, *judged(networks, frozen, batch, audio, made, dropout, latent))
        if config.mismatched:
            other, _ = networks.judge(params, target, jnp.roll(batch.audio, 1, axis=0), label)
            fake = jnp.concatenate([fake, other])
        terms = {"discriminator": losses.discriminator_adversarial(real, fake)}
        if shown is not None and config.shown_emotion_weight > 0:
            # Of recorded motion only, so that the classes are those of people.
            terms["recorded_emotion"] = jnp.mean(optax.softmax_cross_entropy(shown, label))
        return sum(terms.values(), start=jnp.zeros(())), terms

    return loss


def average_loss(params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]) -> tuple[Array, Terms]:
    """Zero, with the gradient of half the squared distance of ``average`` from the generator.

    A step of gradient descent at the rate ``1 - decay`` is then one of the exponential moving average. The distance is
    no loss of the model, and the norm of its gradient is in the log anyway.
    """
    del key, batch, step
    generator = jax.lax.stop_gradient(params["generator"])
    apart = jax.tree.map(lambda mean, new: jnp.sum(jnp.square(mean - new)), params["average"], generator)
    half = 0.5 * sum(jax.tree.leaves(apart), start=jnp.zeros(()))
    return half - jax.lax.stop_gradient(half), {}


def vae_loss(networks: Networks) -> Callable[..., tuple[Array, Terms]]:
    """Relative squared error of emotion features, the KL divergence, and the emotion of features that are sampled.

    The emotion classifier judges features of random latents with a label: without this term, latents that hold the
    emotion themselves are an optimum too, in which the label has no effect. Everything but the VAE is a constant.
    """
    config = networks.config

    def loss(params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]) -> tuple[Float[Array, ""], Terms]:
        del step
        frozen = jax.lax.stop_gradient(params)
        features, label = networks.encode_audio(frozen, batch.audio).emotion, one_hot(networks, batch)
        assert features is not None
        mean, log_variance = networks.encode_emotion(params, features, label)
        made = networks.decode_emotion(params, vae.draw(key, mean, log_variance), label)
        scale = frozen["vae"]["features"]["scale"]
        terms = {"vae_error": vae.relative_error(features, made, scale), "vae_kl": vae.divergence(mean, log_variance)}
        loss = terms["vae_error"] + config.vae_kl_weight * terms["vae_kl"]
        if config.vae_emotion_weight > 0:
            latent = jax.random.normal(jax.random.fold_in(key, 1), mean.shape, mean.dtype)
            logits = networks.classify(frozen, networks.decode_emotion(params, latent, label))
            terms["vae_emotion"] = jnp.mean(optax.softmax_cross_entropy(logits, label))
            loss = loss + config.vae_emotion_weight * terms["vae_emotion"]
        return loss, terms

    return loss
