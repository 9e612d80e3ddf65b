"""The objective of Audio2Gestures: every loss of a batch, and the weights of a step."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.similarity import lpips, ssim, stft_distance
from a2g_jax.models.audio2gestures import losses
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.base import Params

Terms = dict[str, Array]


def check_objective(config: Audio2GesturesConfig) -> None:
    """Refuse clips on which a loss cannot be computed.

    Raises:
        InputError: clips shorter than a window of the STFT.
    """
    if config.stft_weight > 0 and config.clip_frames < 32:
        raise InputError(f"--stft-weight: needs clips of 32 frames or more; --clip-frames is {config.clip_frames}.")


def weights(config: Audio2GesturesConfig) -> Callable[[Int[Array, ""]], dict[str, Any]]:
    """Weight of each term as a function of the step."""

    def at(step: Int[Array, ""]) -> dict[str, Any]:
        alignment = jnp.minimum(step / config.alignment_ramp_steps, 1.0) if config.alignment_ramp_steps else 1.0
        ramp = jnp.minimum(step / config.kl_ramp_steps, 1.0) if config.kl_ramp_steps else 1.0
        decay = jnp.maximum(1.0 - step / config.diversity_decay_steps, 0.0) if config.diversity_decay_steps else 1.0
        return {
            "rotation": config.rotation_weight,
            "position": config.position_weight,
            "speed": config.speed_weight,
            "stft": config.stft_weight,
            "ssim": config.ssim_weight,
            "lpips": config.lpips_weight,
            "alignment": config.alignment_weight * alignment,
            "kl_shared": config.kl_shared_weight * ramp,
            "kl_specific": config.kl_specific_weight * ramp,
            "relaxed": config.relaxed_weight,
            "sampled_rotation": config.sampled_rotation_weight,
            "sampled_speed": config.sampled_speed_weight,
            "bicycle": config.bicycle_weight,
            "diversity": config.diversity_weight * decay,
        }

    return at


def total(terms: Terms, weighted: dict[str, Any]) -> Float[Array, ""]:
    """Weighted sum of the terms that were computed."""
    # XLA keeps a product with a constant zero, and its whole gradient: leave those terms out.
    used = [
        name for name, weight in weighted.items() if name in terms and not (isinstance(weight, float) and weight == 0.0)
    ]
    return sum((weighted[name] * terms[name] for name in used), start=jnp.zeros(()))


def code_noise(key: Key[Array, ""], code: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
    """Noise with the mean and standard deviation over time of each clip's own specific code (Sec. 4.2.4)."""
    code = jax.lax.stop_gradient(code)
    mean, std = jnp.mean(code, axis=1, keepdims=True), jnp.std(code, axis=1, keepdims=True)
    return mean + std * jax.random.normal(key, code.shape, code.dtype)


def terms(codec: Codec, params: Params, key: Key[Array, ""], batch: Batch) -> Terms:
    """Every loss of one batch, unweighted, and diagnostics that show a collapse early."""
    return (_split_terms if codec.config.split else _joint_terms)(codec, params, key, batch)


def _split_terms(codec: Codec, params: Params, key: Key[Array, ""], batch: Batch) -> Terms:
    config = codec.config
    keys = jax.random.split(key, 10)
    drop = list(keys[6:]) if config.dropout > 0 else [None] * 4
    clips = batch.audio.shape[0]

    audio_shared = codec.encode_audio(params, batch.audio, drop[0])
    motion_shared, motion_specific = codec.encode_motion(params, batch.pose, drop[1])
    assert motion_specific is not None
    s_audio = codec.to_time(audio_shared.sample(keys[0]))
    s_motion = codec.to_time(motion_shared.sample(keys[1]))
    i_motion = codec.to_time(motion_specific.sample(keys[2]))

    # Two random specific codes for every clip, mapped in one call.
    kl_specific = losses.kl_loss(motion_specific)
    if config.mapping:
        noise = jnp.concatenate([code_noise(keys[3], i_motion), code_noise(keys[4], i_motion)])
        mapped = codec.map_noise(params, noise)
        i_random = codec.to_time(mapped.sample(keys[5]))
        kl_specific = kl_specific + losses.kl_loss(mapped)
    else:
        i_random = jax.random.normal(keys[5], (2 * clips, *i_motion.shape[1:]), i_motion.dtype)

    # One large call decodes the four motions: reconstruction, audio to motion, and two random samples.
    shared = jnp.concatenate([s_motion, s_audio, s_audio, s_audio])
    specific = jnp.concatenate([i_motion, i_motion, i_random])
    pose = codec.decode(params, shared, specific, drop[2])
    rotations, places = codec.positions(jnp.concatenate([batch.pose, pose]))
    target, rebuilt, transferred, sampled, other = jnp.split(places, 5)
    turns = None if rotations is None else jnp.split(rotations, 5)

    # A valid pose is encoded again: 6D of the rotations, not the raw output.
    random_pose = codec.valid(pose[2 * clips : 3 * clips], None if turns is None else turns[3])
    recovered = codec.encode_motion(params, random_pose, drop[3])[1]
    assert recovered is not None

    values = _motion_terms(codec, batch.pose, pose[: 2 * clips], turns, target, [rebuilt, transferred])
    values |= {
        "alignment": losses.alignment_loss(s_audio, s_motion),
        **_shared_kl(config, audio_shared, motion_shared),
        "kl_specific": kl_specific,
        "relaxed": losses.relaxed_loss(sampled, target, config.relaxed_threshold),
        "sampled_speed": losses.speed_loss(sampled, target),
        "bicycle": losses.bicycle_loss(jax.lax.stop_gradient(i_random[:clips]), codec.to_time(recovered.mean)),
        "diversity": losses.diversity_loss(sampled, other),
    }
    if turns is not None:
        values["sampled_rotation"] = losses.rotation_loss(turns[3], turns[0])
    # Not losses: how far codes and motions move. Near zero means that a code has collapsed.
    return values | {
        "reconstruction": losses.position_loss(rebuilt, target),
        "shared_spread": jnp.mean(jnp.std(codec.to_time(audio_shared.mean), axis=1)),
        "specific_spread": jnp.mean(jnp.std(motion_specific.mean, axis=(0, 1))),
    }


def _joint_terms(codec: Codec, params: Params, key: Key[Array, ""], batch: Batch) -> Terms:
    """Without a motion-specific code: only reconstruction and alignment (Table 2, baseline)."""
    config = codec.config
    keys = jax.random.split(key, 5)
    drop = list(keys[2:]) if config.dropout > 0 else [None] * 3
    audio_shared = codec.encode_audio(params, batch.audio, drop[0])
    motion_shared, _ = codec.encode_motion(params, batch.pose, drop[1])
    s_audio, s_motion = audio_shared.sample(keys[0]), motion_shared.sample(keys[1])
    pose = codec.decode(params, jnp.concatenate([s_motion, s_audio]), None, drop[2])
    rotations, places = codec.positions(jnp.concatenate([batch.pose, pose]))
    target, rebuilt, transferred = jnp.split(places, 3)
    turns = None if rotations is None else jnp.split(rotations, 3)
    return {
        **_motion_terms(codec, batch.pose, pose, turns, target, [rebuilt, transferred]),
        "alignment": losses.alignment_loss(s_audio, s_motion),
        **_shared_kl(config, audio_shared, motion_shared),
        "reconstruction": losses.position_loss(rebuilt, target),
        "shared_spread": jnp.mean(jnp.std(audio_shared.mean, axis=1)),
    }


def _shared_kl(config: Audio2GesturesConfig, audio: Any, motion: Any) -> Terms:
    """KL divergence of the shared codes; no term for an autoencoder's, which have no variance."""
    return {} if config.latent == "dct" else {"kl_shared": losses.kl_loss(audio) + losses.kl_loss(motion)}


def _motion_terms(
    codec: Codec,
    truth: Float[Array, "B T R D"],
    pose: Float[Array, "B2 T R D"],
    turns: list[Array] | None,
    target: Array,
    made: list[Array],
) -> Terms:
    """Losses of the reconstruction and of the audio-to-motion translation against the truth (Eq. 1, 6, 7, 14).

    Args:
        pose: the raw outputs of both.
        turns: rotations, those of the truth and of both first; None for poses without rotations.
        target: positions of the truth.
        made: positions of both.
    """
    config = codec.config
    both, twice = jnp.concatenate(made), jnp.concatenate([target, target])
    values = {"position": losses.position_loss(both, twice), "speed": losses.speed_loss(both, twice)}
    if turns is not None:
        values["rotation"] = losses.rotation_loss(jnp.concatenate(turns[1:3]), jnp.concatenate([turns[0]] * 2))
    flat = lambda array: array.reshape(*array.shape[:2], -1)  # noqa: E731
    if config.stft_weight > 0:
        values["stft"] = jnp.mean(stft_distance(flat(both), flat(twice)))
    if config.ssim_weight > 0:
        values["ssim"] = 1.0 - jnp.mean(ssim(flat(both), flat(twice)))
    if config.lpips_weight > 0:
        features = codec.data.perceptual
        assert features is not None
        valid = codec.valid(pose, None if turns is None else jnp.concatenate(turns[1:3]))
        ours, theirs = features(valid), features(truth)
        values["lpips"] = jnp.mean(lpips(ours, [jnp.concatenate([block, block]) for block in theirs]))
    return values
