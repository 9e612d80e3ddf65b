"""Speech2Gesture as a record of pure functions."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.models import motion_losses as losses
from a2g_jax.models.base import Condition, Data, Model, Params, Stage, Summary, Update
from a2g_jax.models.entry import NO_SAMPLING, NoSampling
from a2g_jax.models.speech2gesture.config import Speech2GestureConfig
from a2g_jax.models.speech2gesture.networks import Discriminator, Translator, translator_halo


def build(config: Speech2GestureConfig, data: Data, sampling: NoSampling = NO_SAMPLING) -> Model:
    """Speech2Gesture for a corpus's poses; see :class:`a2g_jax.models.base.Model` for its parts.

    It is deterministic: one audio has one motion, and all samples for it are equal.
    """
    del sampling
    rows = data.pose_statistics.mean.shape
    width = rows[0] * rows[1]
    translator = Translator(config, width)
    discriminator = Discriminator(config.discriminator_channels, config.normalise)
    adversarial = config.adversarial_weight > 0

    def init(key: Key[Array, ""]) -> Params:
        """Initial parameters; without a discriminator if the adversarial weight is 0."""
        keys = jax.random.split(key)
        params = {"generator": translator.init(keys[0], jnp.zeros((1, config.stride, data.audio_bands)))["params"]}
        if adversarial:
            params["discriminator"] = discriminator.init(keys[1], jnp.zeros((1, config.stride, width)))["params"]
        return params

    def translate(params: Params, audio: Float[Array, "B T bands"]) -> Float[Array, "B T R D"]:
        values: Any = translator.apply({"params": params["generator"]}, audio)
        pose: Float[Array, "B T R D"] = data.pose_statistics.denormalise(values.reshape(*values.shape[:2], *rows))
        return pose

    def motion(pose: Float[Array, "B T R D"]) -> Float[Array, "B T-1 D2"]:
        """Input of the discriminator: differences of frames' z-scores."""
        values = data.pose_statistics.normalise(pose)
        return jnp.diff(values.reshape(*values.shape[:2], -1), axis=1)

    def judge(params: Params, moved: Float[Array, "B T D"]) -> Float[Array, "B _"]:
        outputs: Any = discriminator.apply({"params": params}, moved)
        return outputs

    def regression(params: Params, batch: Batch) -> tuple[Float[Array, "B T R D"], dict[str, Array], dict[str, float]]:
        """The generated poses as the discriminator takes them, and the regression terms with their weights."""
        pose = translate(params, batch.audio)
        rotations = data.space.rotations(jnp.stack([pose, batch.pose]))
        if rotations is None:
            return pose, *_value_terms(config, data, pose, batch.pose)
        # A valid pose: the discriminator must not judge the length of raw 6D vectors.
        return data.space.valid(pose, rotations[0]), *_rotation_terms(config, data, rotations)

    def translator_loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Regression, and with a discriminator the translation network's side of a least-squares GAN."""
        del key, step
        made, terms, weights = regression(params, batch)
        if adversarial:
            terms["adversarial"] = jnp.mean(
                jnp.square(judge(jax.lax.stop_gradient(params["discriminator"]), motion(made)) - 1.0)
            )
            weights["adversarial"] = config.adversarial_weight
        # XLA keeps a product with a constant zero, and its whole gradient: leave those terms out.
        total = sum((weights[name] * terms[name] for name in terms if weights[name] > 0), start=jnp.zeros(()))
        return total, terms

    def discriminator_loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """The discriminator's side: 1 for true motion, 0 for generated."""
        del key, step
        made, _, _ = regression(params, batch)
        both = jnp.concatenate([motion(batch.pose), motion(jax.lax.stop_gradient(made))])
        real, fake = jnp.split(judge(params["discriminator"], both), 2)
        loss = jnp.mean(jnp.square(real - 1.0)) + jnp.mean(jnp.square(fake))
        return loss, {"discriminator": loss}

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """An empty summary: there is no latent space."""
        del params, key, batch
        return {}

    def condition(params: Params, summary: Summary, given: Condition) -> Float[Array, "T R D"]:
        """The only motion of an audio."""
        del summary
        return translate(params, given.audio[None])[0]

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], condition: Float[Array, "T R D"], start: Int[Array, ""]
    ) -> Float[Array, "T R D"]:
        """The only motion of an audio, for any key."""
        del params, summary, key, start
        return condition

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """The motion of the batch's audio; its poses are not used."""
        return translate(params, batch.audio)

    # In turns, as the authors train, each with its own optimiser; theirs use another batch for the second turn.
    updates: tuple[Update, ...] = (Update(translator_loss),)
    if adversarial:
        updates = (
            Update(discriminator_loss, ("discriminator",), "discriminator"),
            Update(translator_loss, ("generator",), "generator"),
        )
    return Model(
        "speech2gesture",
        config,
        config.clip_frames,
        translator_halo(config),
        init,
        (Stage(updates),),
        summarise,
        condition=condition,
        sample=sample,
        reconstruct=reconstruct,
    )


def _rotation_terms(
    config: Speech2GestureConfig, data: Data, rotations: Float[Array, "2 B T J 3 3"]
) -> tuple[dict[str, Array], dict[str, float]]:
    """Angles, positions and velocities as in Audio2Gestures (Eq. 1), of ours and of the truth."""
    places = data.space.joint_positions(rotations)
    terms = {
        "rotation": losses.rotation_loss(*rotations),
        "position": losses.position_loss(*places),
        "speed": losses.speed_loss(*places),
    }
    weights = {"rotation": config.rotation_weight, "position": config.position_weight, "speed": config.speed_weight}
    return terms, weights


def _value_terms(
    config: Speech2GestureConfig, data: Data, pose: Float[Array, "B T R D"], target: Float[Array, "B T R D"]
) -> tuple[dict[str, Array], dict[str, float]]:
    """Mean absolute difference of z-scores (the authors' L1 regression), and of their changes."""
    ours, theirs = data.pose_statistics.normalise(jnp.stack([pose, target]))
    terms = {
        "value": jnp.mean(jnp.abs(ours - theirs)),
        "value_speed": jnp.mean(jnp.abs(jnp.diff(ours, axis=1) - jnp.diff(theirs, axis=1))),
    }
    return terms, {"value": config.value_weight, "value_speed": config.value_speed_weight}
