"""The motion autoencoder as a record of pure functions."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.models import motion_losses as losses
from a2g_jax.models.base import Data, Model, Params, Stage, Summary, Update
from a2g_jax.models.entry import NO_SAMPLING, NoSampling
from a2g_jax.models.motion_autoencoder.config import MotionAutoencoderConfig
from a2g_jax.nn.conv import Dense
from a2g_jax.nn.tcn import TCN, ResidualBlock, receptive_halo


class Encoder(nn.Module):
    """Residual blocks, block i with dilation ``2 ** i``; returns the output of each."""

    channels: Sequence[int]
    kernel_size: int

    @nn.compact
    def __call__(self, x: Float[Array, "B T C"]) -> list[Float[Array, "B T _"]]:
        outputs = []
        for block, features in enumerate(self.channels):
            x = ResidualBlock(features, self.kernel_size, 2**block, 0.0)(x, True)
            outputs.append(x)
        return outputs


class Decoder(nn.Module):
    """Residual blocks and a linear layer."""

    channels: Sequence[int]
    kernel_size: int
    features: int

    @nn.compact
    def __call__(self, code: Float[Array, "B T C"]) -> Float[Array, "B T D"]:
        return Dense(self.features)(TCN(self.channels, self.kernel_size)(code))


def encode(
    config: MotionAutoencoderConfig, data: Data, params: Params, pose: Float[Array, "B T R D"]
) -> list[Float[Array, "B T _"]]:
    """Features of motion: the outputs of the encoder's blocks, differentiable with respect to the motion."""
    encoder = Encoder(config.encoder_channels, config.kernel_size)
    values = data.pose_statistics.normalise(pose).reshape(*pose.shape[:2], -1)
    outputs: Any = encoder.apply({"params": params["encoder"]}, values)
    return outputs


def build(config: MotionAutoencoderConfig, data: Data, sampling: NoSampling = NO_SAMPLING) -> Model:
    """The autoencoder for a corpus's poses; see :class:`a2g_jax.models.base.Model` for its parts."""
    del sampling
    encoder = Encoder(config.encoder_channels, config.kernel_size)
    rows = data.pose_statistics.mean.shape
    width = rows[0] * rows[1]
    decoder = Decoder(config.decoder_channels, config.kernel_size, width)

    def init(key: Key[Array, ""]) -> Params:
        keys = jax.random.split(key)
        pose, code = jnp.zeros((1, 8, width)), jnp.zeros((1, 8, config.encoder_channels[-1]))
        return {"encoder": encoder.init(keys[0], pose)["params"], "decoder": decoder.init(keys[1], code)["params"]}

    def rebuild(params: Params, values: Float[Array, "B T R D"]) -> Float[Array, "B T R D"]:
        """Normalised poses, encoded and decoded."""
        outputs: Any = encoder.apply({"params": params["encoder"]}, values.reshape(*values.shape[:2], -1))
        rebuilt: Any = decoder.apply({"params": params["decoder"]}, outputs[-1])
        return rebuilt.reshape(values.shape)

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Motion reconstruction (Audio2Gestures, Eq. 1); for poses without rotations, L1 of values and of speeds."""
        del step
        target = data.pose_statistics.normalise(batch.pose)
        noisy = target
        if config.noise > 0:
            noisy = target + config.noise * jax.random.normal(key, target.shape, target.dtype)
        rebuilt = rebuild(params, noisy)
        if not data.space.has_rotations:
            terms = {
                "value": jnp.mean(jnp.abs(rebuilt - target)),
                "speed": jnp.mean(jnp.abs(jnp.diff(rebuilt, axis=1) - jnp.diff(target, axis=1))),
            }
            return config.value_weight * terms["value"] + config.speed_weight * terms["speed"], terms
        poses = jnp.stack([data.pose_statistics.denormalise(rebuilt), batch.pose])
        rotations: Any = data.space.rotations(poses)
        ours, theirs = rotations
        places = data.space.joint_positions(rotations)
        terms = {
            "rotation": losses.rotation_loss(ours, theirs),
            "position": losses.position_loss(*places),
            "speed": losses.speed_loss(*places),
        }
        weights = {"rotation": config.rotation_weight, "position": config.position_weight, "speed": config.speed_weight}
        return sum((weights[name] * terms[name] for name in terms), start=jnp.zeros(())), terms

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """Time-averaged features of the fourth block, for reports on the range of the training data."""
        del key
        return {"features": jnp.mean(encode(config, data, params, batch.pose)[3], axis=1)}

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """Poses encoded and decoded, without noise."""
        rebuilt = rebuild(params, data.pose_statistics.normalise(batch.pose))
        back: Float[Array, "B T R D"] = data.pose_statistics.denormalise(rebuilt)
        return back

    halo = receptive_halo(len(config.encoder_channels), config.kernel_size)
    return Model(
        "motion_autoencoder",
        config,
        config.clip_frames,
        halo,
        init,
        (Stage((Update(loss),)),),
        summarise,
        reconstruct=reconstruct,
        features=lambda params, pose: encode(config, data, params, pose),
    )
