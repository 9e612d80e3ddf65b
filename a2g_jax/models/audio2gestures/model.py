"""Audio2Gestures as a record of pure functions."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float, Int, Key

from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.rotation import matrix_from_6d, matrix_to_6d
from a2g_jax.models.audio2gestures import losses
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.networks import (
    MAPPING_LAYERS,
    AudioEncoder,
    Decoder,
    Gaussian,
    MappingNet,
    MotionEncoder,
)
from a2g_jax.models.base import Batch, Data, Model, Params, Summary
from a2g_jax.nn.noise import blended_draws, frame_normal
from a2g_jax.nn.tcn import receptive_halo


@dataclass(frozen=True, eq=False)
class Networks:
    """The four networks with the pose representation between them and the skeleton."""

    config: Audio2GesturesConfig
    data: Data

    @property
    def modules(self) -> tuple[AudioEncoder, MotionEncoder, Decoder, MappingNet]:
        c = self.config
        return AudioEncoder(c), MotionEncoder(c), Decoder(c, 6 * self.data.skeleton.joints), MappingNet(c)

    def init(self, key: Key[Array, ""]) -> Params:
        """Parameters of all four networks, for clips of any length."""
        audio, motion, decoder, mapping = self.modules
        keys = jax.random.split(key, 4)
        sound = jnp.zeros((1, 8, self.data.audio_bands))
        pose = jnp.zeros((1, 8, 6 * self.data.skeleton.joints))
        code = jnp.zeros((1, 8, self.config.code_channels))
        return {
            "audio_encoder": audio.init(keys[0], sound)["params"],
            "motion_encoder": motion.init(keys[1], pose)["params"],
            "decoder": decoder.init(keys[2], code, code)["params"],
            "mapping_net": mapping.init(keys[3], code)["params"],
        }

    def encode_audio(self, params: Params, audio: Float[Array, "B T bands"], dropout_key=None) -> Gaussian:
        """S_A."""
        return _apply(self.modules[0], params["audio_encoder"], dropout_key, audio)

    def encode_motion(
        self, params: Params, pose: Float[Array, "B T J 6"], dropout_key=None
    ) -> tuple[Gaussian, Gaussian]:
        """S_M and I_M."""
        seen = self.data.pose_statistics.normalise(pose) if self.config.normalise_pose else pose
        return _apply(self.modules[1], params["motion_encoder"], dropout_key, seen.reshape(*pose.shape[:2], -1))

    def decode(
        self, params: Params, shared: Float[Array, "B T C"], specific: Float[Array, "B T C"], dropout_key=None
    ) -> Float[Array, "B T J 6"]:
        """Motion of a full code, as 6D vectors that Gram-Schmidt makes rotations."""
        flat = _apply(self.modules[2], params["decoder"], dropout_key, shared, specific)
        pose = flat.reshape(*flat.shape[:2], -1, 6)
        return self.data.pose_statistics.denormalise(pose) if self.config.normalise_pose else pose

    def map_noise(self, params: Params, noise: Float[Array, "B T C"]) -> Gaussian:
        """I_R."""
        mapping: Any = self.modules[3].apply({"params": params["mapping_net"]}, noise)
        return mapping

    def positions(self, rotations: Float[Array, "B T J 3 3"]) -> Float[Array, "B T J 3"]:
        """Joint positions in metres, the root at the origin."""
        skeleton = self.data.skeleton
        return joint_positions(rotations, jnp.asarray(skeleton.offsets), skeleton.parents)


def _apply(module: nn.Module, params: Params, dropout_key: Key[Array, ""] | None, *inputs: Array) -> Any:
    """A network's output; dropout acts only when given a key."""
    rngs = None if dropout_key is None else {"dropout": dropout_key}
    return module.apply({"params": params}, *inputs, deterministic=dropout_key is None, rngs=rngs)


def code_noise(key: Key[Array, ""], code: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
    """Noise with the mean and standard deviation over time of each clip's own specific code (Sec. 4.2.4)."""
    code = jax.lax.stop_gradient(code)
    mean, std = jnp.mean(code, axis=1, keepdims=True), jnp.std(code, axis=1, keepdims=True)
    return mean + std * jax.random.normal(key, code.shape, code.dtype)


def build(config: Audio2GesturesConfig, data: Data) -> Model:
    """Audio2Gestures for a skeleton and an audio feature; see :class:`a2g_jax.models.base.Model` for its parts."""
    networks = Networks(config, data)
    weighted = _weights(config)

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Sum of weighted terms; each term is reported unweighted under its name."""
        terms = _terms(networks, params, key, batch)
        weights = weighted(step)
        # XLA keeps a product with a constant zero, and the whole gradient behind it: leave those terms out.
        used = [name for name, weight in weights.items() if not (isinstance(weight, float) and weight == 0.0)]
        total = sum((weights[name] * terms[name] for name in used), start=jnp.zeros(()))
        return total, terms

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """Mean and standard deviation over time of the specific code of every clip in the batch."""
        code = networks.encode_motion(params, batch.pose)[1].sample(key)
        return {"specific_mean": jnp.mean(code, axis=1), "specific_std": jnp.std(code, axis=1)}

    def condition(params: Params, audio: Float[Array, "T bands"]) -> Gaussian:
        """S_A of one audio."""
        return networks.encode_audio(params, audio[None])

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], shared: Gaussian, start: Int[Array, ""]
    ) -> Float[Array, "T J 6"]:
        """g(S_A, I_R) with I_R from the mapping net, given what :func:`condition` returned."""
        frames, channels = shared.mean.shape[1:]
        which, noise_key, shared_key, code_key = jax.random.split(key, 4)
        mean, std = blended_draws(
            which, (summary["specific_mean"], summary["specific_std"]), start, frames, config.redraw_frames
        )
        noise = config.noise_scale * frame_normal(noise_key, start, frames, channels)
        code = networks.map_noise(params, (mean + std * noise)[None])
        if config.sample_codes:
            audio_code = shared.shift(frame_normal(shared_key, start, frames, channels)[None])
            specific = code.shift(frame_normal(code_key, start, frames, channels)[None])
        else:
            audio_code, specific = shared.mean, code.mean
        return networks.decode(params, audio_code, specific)[0]

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T J 6"]:
        """g(S_M, I_M) with mean codes."""
        shared, specific = networks.encode_motion(params, batch.pose)
        return networks.decode(params, shared.mean, specific.mean)

    blocks = max(len(config.audio_channels), len(config.motion_channels))
    # The decoder sees codes from an encoder or from the mapping net, whichever reaches farther.
    reach = max(receptive_halo(blocks, config.kernel_size), MAPPING_LAYERS * (config.kernel_size // 2))
    halo = reach + receptive_halo(len(config.decoder_channels), config.kernel_size)
    return Model(
        "audio2gestures",
        config,
        config.clip_frames,
        halo,
        networks.init,
        loss,
        summarise,
        condition,
        sample,
        reconstruct,
    )


def _weights(config: Audio2GesturesConfig) -> Any:
    """Weight of each term as a function of the step."""

    def at(step: Int[Array, ""]) -> dict[str, Any]:
        together = jnp.minimum(step / config.alignment_ramp_steps, 1.0) if config.alignment_ramp_steps else 1.0
        ramp = jnp.minimum(step / config.kl_ramp_steps, 1.0) if config.kl_ramp_steps else 1.0
        decay = jnp.maximum(1.0 - step / config.diversity_decay_steps, 0.0) if config.diversity_decay_steps else 1.0
        return {
            "rotation": config.rotation_weight,
            "position": config.position_weight,
            "speed": config.speed_weight,
            "alignment": config.alignment_weight * together,
            "kl_shared": config.kl_shared_weight * ramp,
            "kl_specific": config.kl_specific_weight * ramp,
            "relaxed": config.relaxed_weight,
            "sampled_rotation": config.sampled_rotation_weight,
            "sampled_speed": config.sampled_speed_weight,
            "bicycle": config.bicycle_weight,
            "diversity": config.diversity_weight * decay,
        }

    return at


def _terms(networks: Networks, params: Params, key: Key[Array, ""], batch: Batch) -> dict[str, Array]:
    """Every loss of one batch, unweighted, and three figures that show degeneration early."""
    config = networks.config
    keys = jax.random.split(key, 10)
    drop = list(keys[6:]) if config.dropout > 0 else [None] * 4
    clips = batch.audio.shape[0]

    audio_shared = networks.encode_audio(params, batch.audio, drop[0])
    motion_shared, motion_specific = networks.encode_motion(params, batch.pose, drop[1])
    s_audio = audio_shared.sample(keys[0])
    s_motion = motion_shared.sample(keys[1])
    i_motion = motion_specific.sample(keys[2])

    # Two random specific codes for every clip, mapped in one call.
    noise = jnp.concatenate([code_noise(keys[3], i_motion), code_noise(keys[4], i_motion)])
    mapped = networks.map_noise(params, noise)
    i_random = mapped.sample(keys[5])

    # One large call decodes the four motions: reconstruction, audio to motion, and two random samples.
    shared = jnp.concatenate([s_motion, s_audio, s_audio, s_audio])
    specific = jnp.concatenate([i_motion, i_motion, i_random])
    pose = networks.decode(params, shared, specific, drop[2])
    rotations = matrix_from_6d(pose)
    target_rotations = matrix_from_6d(batch.pose)
    positions = networks.positions(jnp.concatenate([target_rotations, rotations]))
    target, rebuilt, transferred, sampled, other = jnp.split(positions, 5)

    # The re-encoded motion is a valid one: 6D of the rotation, not of the raw output.
    recovered = networks.encode_motion(params, matrix_to_6d(rotations[2 * clips : 3 * clips]), drop[3])[1]

    both = jnp.concatenate([rebuilt, transferred])
    twice = jnp.concatenate([target, target])
    return {
        "rotation": losses.rotation_loss(rotations[: 2 * clips], jnp.concatenate([target_rotations] * 2)),
        "position": losses.position_loss(both, twice),
        "speed": losses.speed_loss(both, twice),
        "alignment": losses.alignment_loss(s_audio, s_motion),
        "kl_shared": losses.kl_loss(audio_shared) + losses.kl_loss(motion_shared),
        "kl_specific": losses.kl_loss(motion_specific) + losses.kl_loss(mapped),
        "relaxed": losses.relaxed_loss(sampled, target, config.relaxed_threshold),
        "sampled_rotation": losses.rotation_loss(rotations[2 * clips : 3 * clips], target_rotations),
        "sampled_speed": losses.speed_loss(sampled, target),
        "bicycle": losses.bicycle_loss(jax.lax.stop_gradient(i_random[:clips]), recovered.mean),
        "diversity": losses.diversity_loss(sampled, other),
        # Not losses: how far codes and motions move. Near zero means that a code has collapsed.
        "reconstruction": losses.position_loss(rebuilt, target),
        "shared_spread": jnp.mean(jnp.std(audio_shared.mean, axis=1)),
        "specific_spread": jnp.mean(jnp.std(motion_specific.mean, axis=(0, 1))),
    }
