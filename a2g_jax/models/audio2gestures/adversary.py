"""The adversarial stage: a discriminator of motion given the speech, and the decoder trained against it.

Regression to one recorded motion gives the median over everything that the codes do not determine, which is calm. This
stage trains the decoder on motions of *drawn* codes, which no recording belongs to; the papers have no such stage. The
motion of encoded codes stays near its recording, also in the discriminator's features (feature matching).
"""

from typing import Any

import jax
import jax.numpy as jnp
import optax
from flax import linen as nn
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.motion_terms import motion_terms
from a2g_jax.models.audio2gestures.objective import code_noise
from a2g_jax.models.base import Params, Stage, Update
from a2g_jax.models.judged_motion import judged_motion
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.nn.conv import Dense
from a2g_jax.nn.strided import StridedConv1D

_SLOPE = 0.2
#: Added to the size of features before division.
_EPSILON = 1e-6
#: Learning rate of the decoder in the game, relative to the training's.
_DECODER = 0.3
#: The discriminator's, relative to it.
_DISCRIMINATOR = 0.5
#: Adam's decay of the first moment in an adversarial game (Radford et al. 2016).
_MOMENTUM = 0.5

Features = list[Float[Array, "B _ _"]]


class Discriminator(nn.Module):
    """Features of patches of motion with their speech; the last are scores, positive for recorded motion."""

    channels: tuple[int, ...]

    @nn.compact
    def __call__(self, motion: Float[Array, "B T D"], shared: Float[Array, "B T C"]) -> Features:
        x = nn.leaky_relu(Dense(self.channels[0])(jnp.concatenate([motion, shared], axis=-1)), _SLOPE)
        features = []
        for width in self.channels:
            x = nn.leaky_relu(StridedConv1D(width)(x), _SLOPE)
            features.append(x)
        return [*features, Dense(1)(x)]


def init_discriminator(key: Key[Array, ""], codec: Codec) -> Params:
    """Initial parameters of the discriminator."""
    frames = 2 ** len(codec.config.discriminator_channels)
    mean = jnp.asarray(codec.data.pose_statistics.mean)
    motion = judged_motion(codec.data, jnp.broadcast_to(mean[None, None], (1, frames, *mean.shape)))
    shared = jnp.zeros((1, frames, codec.config.code_channels))
    params: Params = Discriminator(codec.config.discriminator_channels).init(key, motion, shared)["params"]
    return params


def adversarial_stage(codec: Codec) -> Stage:
    """The second stage of training: discriminator and decoder in turns; everything else is frozen."""
    config = codec.config
    judge = Discriminator(config.discriminator_channels)

    def judged(params: Params, pose: Float[Array, "B T R D"], shared: Float[Array, "B T C"]) -> Features:
        features: Any = judge.apply({"params": params}, judged_motion(codec.data, pose), shared)
        return features

    def discriminator_loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """The discriminator's side of a GAN with the hinge loss."""
        del step
        shared, specific, _, drawn = _codes(codec, params, key, batch)
        made = codec.decode(params, jnp.concatenate([shared] * 2), jnp.concatenate([specific, drawn]))
        poses = jnp.concatenate([batch.pose, jax.lax.stop_gradient(made)])
        scores = judged(params["discriminator"], poses, jnp.concatenate([shared] * 3))[-1]
        real, transferred, sampled = jnp.split(scores, 3)
        false = jnp.concatenate([transferred, sampled])
        loss = jnp.mean(nn.relu(1.0 - real)) + jnp.mean(nn.relu(1.0 + false))
        return loss, {"discriminator": loss}

    def decoder_loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """The decoder's side, feature matching, and the motion losses of encoded codes."""
        del step
        shared, specific, s_motion, drawn = _codes(codec, params, key, batch)
        clips = len(batch.pose)
        pose = codec.decode(
            params, jnp.concatenate([shared, shared, s_motion]), jnp.concatenate([drawn, specific, specific])
        )
        both = pose[clips:]
        regression, weights = motion_terms(codec, batch.pose, both)
        judge_params = jax.lax.stop_gradient(params["discriminator"])
        ours = judged(judge_params, pose[: 2 * clips], jnp.concatenate([shared] * 2))
        theirs = judged(judge_params, batch.pose, shared)
        distances = [
            jnp.mean(jnp.abs(a[clips:] - b)) / (jnp.mean(jnp.abs(b)) + _EPSILON)
            for a, b in zip(ours[:-1], jax.lax.stop_gradient(theirs[:-1]), strict=True)
        ]
        terms = {"adversarial": -jnp.mean(ours[-1]), "matching": jnp.sum(jnp.stack(distances))}
        loss = config.adversarial_weight * terms["adversarial"] + config.matching_weight * terms["matching"]
        loss = loss + sum(weights[name] * regression[name] for name in regression)
        return loss, terms | regression

    def validation_loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """How far motions of drawn codes are from recorded ones (:func:`unlikeness`); all terms are reported.

        The sides of a game do not measure progress, and the motion losses of encoded codes prefer calm motion.
        """
        _, game = discriminator_loss(params, key, batch, step)
        _, terms = decoder_loss(params, key, batch, step)
        shared, _, _, drawn = _codes(codec, params, key, batch)
        loss = unlikeness(codec.positions(codec.decode(params, shared, drawn))[1], codec.positions(batch.pose)[1])
        return loss, game | terms

    return Stage(
        (
            Update(discriminator_loss, ("discriminator",), "discriminator", _optimiser(_DISCRIMINATOR)),
            Update(decoder_loss, ("decoder",), "decoder", _optimiser(1.0)),
        ),
        "adversarial",
        config.adversarial_steps,
        validation_loss,
    )


def unlikeness(made: Float[Array, "B T J D"], recorded: Float[Array, "B T J D"]) -> Float[Array, ""]:
    """Distance of how two sets of motions move: no motion of one belongs to a motion of the other.

    The mean over joints of the distance of their mean places, in standard deviations of the recorded ones over time,
    and of the absolute logarithms of the ratios of standard deviation, root mean square speed and root mean square
    jerk. Joints that do not move in the recordings hardly count: 1 cm (or a tenth of a z-score) is added to both.
    """

    def size(x: Array, order: int) -> Array:
        moved = jnp.diff(x, n=order, axis=1) if order else x - jnp.mean(x, axis=(0, 1), keepdims=True)
        return jnp.sqrt(jnp.mean(jnp.sum(moved**2, axis=-1), axis=(0, 1)))

    floor = 0.01 if made.shape[-1] == 3 else 0.1
    away = jnp.linalg.norm(jnp.mean(made, axis=(0, 1)) - jnp.mean(recorded, axis=(0, 1)), axis=-1)
    total = jnp.mean(away / (size(recorded, 0) + floor))
    for order, least in ((0, floor), (1, floor / 10.0), (3, floor / 10.0)):
        ratio = (size(made, order) + least) / (size(recorded, order) + least)
        total += jnp.mean(jnp.abs(jnp.log(ratio)))
    return total


def _codes(codec: Codec, params: Params, key: Key[Array, ""], batch: Batch) -> tuple[Array, Array, Array, Array]:
    """S_A, I_M, S_M and a drawn I_R of a batch, in time, without gradients."""
    config, frozen = codec.config, jax.lax.stop_gradient(params)
    keys = jax.random.split(key)
    shared = codec.encode_audio(frozen, batch.audio).mean
    s_motion, specific = codec.encode_motion(frozen, batch.pose)
    assert specific is not None
    steps = specific.sample(keys[0])
    encoded = codec.specific_to_frames(steps)
    if config.stored_codes:
        drawn = jnp.roll(encoded, 1, axis=0)
    elif config.mapping:
        noise = code_noise(keys[1], jnp.roll(steps, 1, axis=0))
        drawn = codec.specific_to_frames(codec.map_noise(frozen, noise).mean)
    else:
        drawn = codec.specific_to_frames(jax.random.normal(keys[1], specific.mean.shape, specific.mean.dtype))
    return shared, encoded, s_motion.mean, drawn


def _optimiser(factor: float) -> Any:
    """Adam for one side of the game; its rate falls to a tenth."""

    def make(config: TrainConfig) -> optax.GradientTransformation:
        peak = factor * _DECODER * config.learning_rate
        rate = optax.linear_schedule(peak, 0.1 * peak, config.steps)
        return optax.chain(optax.clip_by_global_norm(1.0), optax.adam(rate, b1=_MOMENTUM, b2=0.99))

    return make
