"""The objective of Audio2Gestures: every loss of a batch, and the weights of a step."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.models.audio2gestures import losses
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.motion_terms import Terms, sampled_terms, translation_terms
from a2g_jax.models.audio2gestures.networks import Gaussian
from a2g_jax.models.base import Params
from a2g_jax.nn.rates import shifted

#: Losses of motions with random codes.
_OF_RANDOM_CODES = (
    *("relaxed", "sampled_rotation", "sampled_speed", "sampled_stft"),
    *("diversity", "bicycle", "bicycle_shared"),
)
#: Smallest share of the KL weights at the beginning of a ramp that restarts, as in the authors' code.
_LOWEST_RAMP = 1e-4


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
        decay = jnp.maximum(1.0 - step / config.diversity_decay_steps, 0.0) if config.diversity_decay_steps else 1.0
        ramp = _kl_ramp(config, step)
        return {
            "rotation": config.rotation_weight,
            "position": config.position_weight,
            "speed": config.speed_weight,
            "stft": config.stft_weight,
            "ssim": config.ssim_weight,
            "lpips": config.lpips_weight,
            "alignment": config.alignment_weight * alignment,
            "spread": config.spread_weight,
            "kl_shared": config.kl_shared_weight * ramp,
            "kl_specific": config.kl_specific_weight * ramp,
            "relaxed": config.relaxed_weight,
            "sampled_rotation": config.sampled_rotation_weight,
            "sampled_speed": config.sampled_speed_weight,
            "sampled_stft": config.sampled_stft_weight,
            "bicycle": config.bicycle_weight,
            "bicycle_shared": config.bicycle_shared_weight,
            "diversity": config.diversity_weight * decay,
        }

    return at


def _kl_ramp(config: Audio2GesturesConfig, step: Int[Array, ""]) -> Any:
    """Share of the KL weights at a step: a linear ramp, once or again and again."""
    if not config.kl_ramp_steps:
        return 1.0
    if config.kl_restarts:
        return jnp.maximum((step % config.kl_ramp_steps) / config.kl_ramp_steps, _LOWEST_RAMP)
    return jnp.minimum(step / config.kl_ramp_steps, 1.0)


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
    config, reduce = codec.config, codec.reductions
    keys = jax.random.split(key, 11)
    drop = list(keys[7:]) if config.dropout > 0 else [None] * 4

    audio_shared = codec.encode_audio(params, batch.audio, drop[0])
    motion_shared, motion_specific = codec.encode_motion(params, batch.pose, drop[1])
    assert motion_specific is not None
    s_audio = codec.to_frames(audio_shared.sample(keys[0]))
    s_motion = codec.to_frames(motion_shared.sample(keys[1]))
    steps_motion = motion_specific.sample(keys[2])
    shifts = _shifts(keys[6], config.specific_jitter, len(batch.pose))
    in_time = lambda steps: shifted(codec.specific_to_frames(steps), shifts)  # noqa: E731
    i_motion = in_time(steps_motion)
    steps_random, mapped = _random_codes(codec, params, keys[3:6], steps_motion)
    if config.diversity_reference == "transfer":
        # Nothing compares two samples: the second is not decoded.
        steps_random = steps_random[:1]
    draws = len(steps_random)

    # One large call decodes all motions: reconstruction, audio to motion, and the random samples.
    shared = jnp.concatenate([s_motion, *([s_audio] * (1 + draws))])
    specific = jnp.concatenate([i_motion, i_motion, *(in_time(steps) for steps in steps_random)])
    pose = codec.decode(params, shared, specific, drop[2])
    rotations, places = codec.positions(jnp.concatenate([batch.pose, pose]))
    target, rebuilt, transferred, *sampled = jnp.split(places, 3 + draws)
    turns = None if rotations is None else jnp.split(rotations, 3 + draws)

    clips = len(batch.pose)
    values = translation_terms(codec, batch.pose, pose[: 2 * clips], turns, target, [rebuilt, transferred])
    values |= {
        "alignment": losses.alignment_loss(s_audio, s_motion),
        "spread": losses.spread_loss(audio_shared.mean) + losses.spread_loss(motion_shared.mean),
        **_shared_kl(codec, audio_shared, motion_shared),
        "kl_specific": reduce.kl(motion_specific) + (0.0 if mapped is None else reduce.kl(mapped)),
    }
    if sampled:
        turn = None if turns is None else turns[3]
        values |= sampled_terms(codec, target, turns, sampled, transferred)
        # A valid pose is encoded again: 6D of the rotations, not the raw output.
        again = codec.valid(pose[2 * clips : 3 * clips], turn)
        shared_again, specific_again = codec.encode_motion(params, again, drop[3])
        assert specific_again is not None
        values["bicycle"] = losses.bicycle_loss(
            jax.lax.stop_gradient(codec.to_frames(steps_random[0])), codec.to_frames(specific_again.mean)
        )
        values["bicycle_shared"] = losses.bicycle_loss(
            jax.lax.stop_gradient(s_audio), codec.to_frames(shared_again.mean)
        )
    # Not losses: how far codes and motions move. Near zero means that a code has collapsed.
    return values | {
        "reconstruction": losses.position_loss(rebuilt, target),
        "shared_spread": jnp.mean(jnp.std(codec.to_frames(audio_shared.mean), axis=1)),
        "specific_spread": jnp.mean(jnp.std(motion_specific.mean, axis=(0, 1))),
    }


def _shifts(key: Key[Array, ""], most: int, clips: int) -> Int[Array, " B"] | None:
    """Frames by which the motion-specific code of each clip is shifted; None for no shift at all."""
    return None if most == 0 else jax.random.randint(key, (clips,), -most, most + 1)


def _random_codes(
    codec: Codec, params: Params, keys: Any, steps: Float[Array, "B N C"]
) -> tuple[list[Array], Gaussian | None]:
    """Random specific codes of every clip, two or none if no loss needs them, and their Gaussian, if any.

    Codes of other clips of the batch, or from the mapping net, or from the standard normal distribution.
    """
    config = codec.config
    if config.stored_codes:
        needed = any(getattr(config, f"{name}_weight") > 0 for name in _OF_RANDOM_CODES)
        return [jax.lax.stop_gradient(jnp.roll(steps, by, axis=0)) for by in (1, 2)] if needed else [], None
    if not config.mapping:
        drawn = jax.random.normal(keys[2], (2 * len(steps), *steps.shape[1:]), steps.dtype)
        return list(jnp.split(drawn, 2)), None
    # DCT bands are mapped from noise with the statistics of the code in time.
    frames = codec.to_frames(steps)
    mapped = codec.map_noise(params, jnp.concatenate([code_noise(key, frames) for key in keys[:2]]))
    return list(jnp.split(mapped.sample(keys[2]), 2)), mapped


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
        **translation_terms(codec, batch.pose, pose, turns, target, [rebuilt, transferred]),
        "alignment": losses.alignment_loss(s_audio, s_motion),
        "spread": losses.spread_loss(audio_shared.mean) + losses.spread_loss(motion_shared.mean),
        **_shared_kl(codec, audio_shared, motion_shared),
        "reconstruction": losses.position_loss(rebuilt, target),
        "shared_spread": jnp.mean(jnp.std(audio_shared.mean, axis=1)),
    }


def _shared_kl(codec: Codec, audio: Gaussian, motion: Gaussian) -> Terms:
    """KL divergence of the shared codes; no term for an autoencoder's, which have no variance."""
    if codec.config.latent == "dct":
        return {}
    return {"kl_shared": codec.reductions.kl(audio) + codec.reductions.kl(motion)}
