"""Speech2Gesture as a record of pure functions."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.rotation import matrix_from_6d, matrix_from_axis_angle, matrix_to_6d
from a2g_jax.models.audio2gestures import losses
from a2g_jax.models.base import Data, Model, Params, Summary
from a2g_jax.models.speech2gesture.config import Speech2GestureConfig
from a2g_jax.models.speech2gesture.networks import Discriminator, Translator, generator_halo


def build(config: Speech2GestureConfig, data: Data) -> Model:
    """Speech2Gesture for a corpus's poses; see :class:`a2g_jax.models.base.Model` for its parts.

    It is deterministic: one audio has one motion, and all samples for it are equal.
    """
    rows = data.pose_statistics.mean.shape
    width = rows[0] * rows[1]
    generator = Translator(config, width)
    discriminator = Discriminator(config.discriminator_channels, config.normalise)
    turns = {"6d": matrix_from_6d, "exponential": matrix_from_axis_angle}.get(data.representation)
    adversarial = config.adversarial_weight > 0

    def init(key: Key[Array, ""]) -> Params:
        """Without a discriminator where nothing is trained against it."""
        keys = jax.random.split(key)
        params = {"generator": generator.init(keys[0], jnp.zeros((1, config.stride, data.audio_bands)))["params"]}
        if adversarial:
            params["discriminator"] = discriminator.init(keys[1], jnp.zeros((1, config.stride, width)))["params"]
        return params

    def generate(params: Params, audio: Float[Array, "B T bands"]) -> Float[Array, "B T R D"]:
        values: Any = generator.apply({"params": params["generator"]}, audio)
        pose: Float[Array, "B T R D"] = data.pose_statistics.denormalise(values.reshape(*values.shape[:2], *rows))
        return pose

    def motion(pose: Float[Array, "B T R D"]) -> Float[Array, "B T-1 D2"]:
        """What the discriminator sees: differences of frames' z-scores."""
        values = data.pose_statistics.normalise(pose)
        return jnp.diff(values.reshape(*values.shape[:2], -1), axis=1)

    def score(params: Params, moved: Float[Array, "B T D"]) -> Float[Array, "B _"]:
        scores: Any = discriminator.apply({"params": params}, moved)
        return scores

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Regression, and where its weight is not zero the two sides of a least-squares GAN at once.

        The authors take turns: a step of the discriminator, then one of the generator on another batch. Here one
        gradient of the sum moves both at the same time, each by its own loss alone: the generator's ``adversarial``
        term holds the discriminator's parameters still, the ``discriminator`` term the generated motion.
        """
        del key, step
        pose = generate(params, batch.audio)
        if turns is None:
            terms, weights = _value_terms(config, data, pose, batch.pose)
            shown = pose
        else:
            rotations = turns(jnp.stack([pose, batch.pose]))
            terms, weights = _rotation_terms(config, data, rotations)
            # The rotation that the output stands for: its length is nothing to judge.
            shown = matrix_to_6d(rotations[0]) if data.representation == "6d" else pose
        if adversarial:
            fake, real = motion(shown), motion(batch.pose)
            terms["adversarial"] = jnp.mean(
                jnp.square(score(jax.lax.stop_gradient(params["discriminator"]), fake) - 1.0)
            )
            real_score, fake_score = jnp.split(
                score(params["discriminator"], jnp.concatenate([real, jax.lax.stop_gradient(fake)])), 2
            )
            terms["discriminator"] = jnp.mean(jnp.square(real_score - 1.0)) + jnp.mean(jnp.square(fake_score))
            weights |= {"adversarial": config.adversarial_weight, "discriminator": 1.0}
        # XLA keeps a product with a constant zero, and the whole gradient behind it: leave those terms out.
        total = sum((weights[name] * terms[name] for name in terms if weights[name] > 0), start=jnp.zeros(()))
        return total, terms

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """Nothing: there is no latent space."""
        del params, key, batch
        return {}

    def condition(params: Params, audio: Float[Array, "T bands"]) -> Float[Array, "T R D"]:
        """The one motion of an audio."""
        return generate(params, audio[None])[0]

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], condition: Float[Array, "T R D"], start: Int[Array, ""]
    ) -> Float[Array, "T R D"]:
        """The one motion of an audio, whatever the key."""
        del params, summary, key, start
        return condition

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """The motion of the batch's audio; its poses play no part."""
        return generate(params, batch.audio)

    return Model(
        "speech2gesture",
        config,
        config.clip_frames,
        generator_halo(config),
        init,
        loss,
        summarise,
        condition,
        sample,
        reconstruct,
    )


def _rotation_terms(
    config: Speech2GestureConfig, data: Data, rotations: Float[Array, "2 B T J 3 3"]
) -> tuple[dict[str, Array], dict[str, float]]:
    """Angles, positions and velocities as in Audio2Gestures (Eq. 1), of ours and of the truth."""
    skeleton = data.skeleton
    places = joint_positions(rotations, jnp.asarray(skeleton.offsets), skeleton.parents)
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
