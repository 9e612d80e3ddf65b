"""The losses of decoded motions against the recorded one, unweighted."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.features.similarity import lpips, ssim, stft_distance
from a2g_jax.models.audio2gestures.codec import Codec

Terms = dict[str, Array]

#: Added to the losses of a motion that stands still, for batches without any motion.
_STILL_EPSILON = 1e-6


def motion_terms(
    codec: Codec, truth: Float[Array, "B T R D"], pose: Float[Array, "B2 T R D"]
) -> tuple[Terms, dict[str, Any]]:
    """The motion losses of decoded poses against the truth, and their weights.

    Args:
        pose: raw outputs, twice as many clips as the truth has.
    """
    rotations, places = codec.positions(jnp.concatenate([truth, pose]))
    target, *made = jnp.split(places, 3)
    turns = None if rotations is None else jnp.split(rotations, 3)
    terms = translation_terms(codec, truth, pose, turns, target, made)
    return terms, {name: getattr(codec.config, f"{name}_weight") for name in terms}


def translation_terms(
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
    config, reduce, scale = codec.config, codec.reductions, _scales(codec, target, turns)
    both, twice = jnp.concatenate(made), jnp.concatenate([target, target])
    values = {
        "position": reduce.position(both, twice) / scale["position"],
        "speed": reduce.speed(both, twice) / scale["speed"],
    }
    if turns is not None:
        rotation = reduce.rotation(jnp.concatenate(turns[1:3]), jnp.concatenate([turns[0]] * 2))
        values["rotation"] = rotation / scale["rotation"]
    if config.stft_weight > 0:
        values["stft"] = jnp.mean(stft_distance(_flat(both), _flat(twice)))
    if config.ssim_weight > 0:
        values["ssim"] = 1.0 - jnp.mean(ssim(_flat(both), _flat(twice)))
    if config.lpips_weight > 0:
        features = codec.data.perceptual
        assert features is not None
        valid = codec.valid(pose, None if turns is None else jnp.concatenate(turns[1:3]))
        ours, theirs = features(valid), features(truth)
        values["lpips"] = jnp.mean(lpips(ours, [jnp.concatenate([block, block]) for block in theirs]))
    return values


def sampled_terms(
    codec: Codec, target: Array, turns: list[Array] | None, sampled: list[Array], transferred: Array
) -> Terms:
    """Losses of motions with a random specific code (Eq. 19 and 21, and the authors' code).

    Args:
        turns: rotations of the truth, of both reconstructions, and of the samples; None for poses without rotations.
        sampled: positions of two samples, or of one where samples are to differ from the transferred motion.
        transferred: positions of g(S_A, I_M).
    """
    config, reduce, scale = codec.config, codec.reductions, _scales(codec, target, turns)
    reference = sampled[1] if config.diversity_reference == "sample" else jax.lax.stop_gradient(transferred)
    values = {
        "relaxed": reduce.relaxed(sampled[0], target) / scale["position"],
        "sampled_speed": reduce.speed(sampled[0], target) / scale["speed"],
        "diversity": -reduce.position(sampled[0], reference) / scale["position"],
    }
    if turns is not None:
        values["sampled_rotation"] = reduce.rotation(turns[3], turns[0]) / scale["rotation"]
    if config.sampled_stft_weight > 0:
        values["sampled_stft"] = jnp.mean(stft_distance(_flat(sampled[0]), _flat(target)))
    return values


def _scales(codec: Codec, target: Array, turns: list[Array] | None) -> dict[str, Any]:
    """What the motion losses are divided by: 1, or the losses of a motion that stands still in the mean pose.

    Args:
        target: positions of the truth.
        turns: its rotations first; None for poses without rotations.
    """
    if not codec.config.relative_losses:
        return {"rotation": 1.0, "position": 1.0, "speed": 1.0}
    reduce, data = codec.reductions, codec.data
    mean = jnp.broadcast_to(jnp.asarray(data.pose_statistics.mean)[None, None], (1, 1, *data.space.shape))
    rotations, places = codec.positions(mean)
    still = {
        "position": reduce.position(jnp.broadcast_to(places, target.shape), target),
        "speed": reduce.speed(jnp.zeros_like(target), target),
    }
    if turns is not None and rotations is not None:
        still["rotation"] = reduce.rotation(jnp.broadcast_to(rotations, turns[0].shape), turns[0])
    return {name: value + _STILL_EPSILON for name, value in still.items()}


def _flat(array: Float[Array, "B T R D"]) -> Float[Array, "B T _"]:
    return array.reshape(*array.shape[:2], -1)
