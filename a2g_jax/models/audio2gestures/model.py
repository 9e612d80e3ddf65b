"""Audio2Gestures as a record of pure functions."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.models.audio2gestures.adversary import adversarial_stage, init_discriminator
from a2g_jax.models.audio2gestures.codec import Codec as Codec
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.edits import Edit, apply_edits, parse_edit
from a2g_jax.models.audio2gestures.networks import MAPPING_LAYERS, Gaussian
from a2g_jax.models.audio2gestures.objective import check_objective, terms, total, weights
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.audio2gestures.stored import (
    EMOTION,
    LABELS,
    VALUES,
    Request,
    clip_properties,
    control_names,
    emotion_names,
    request,
    stored_steps,
)
from a2g_jax.models.base import Condition, Controls, Data, Model, Params, Stage, Summary, Update
from a2g_jax.models.control_curves import parse_curves, parse_gains
from a2g_jax.nn.noise import blended_draws, frame_normal
from a2g_jax.nn.rates import adaptive_reach
from a2g_jax.nn.tcn import receptive_halo

#: Frames of context on either side for a GRU, whose memory is unbounded but fades.
RECURRENT_REACH = 256

Code = Float[Array, "1 T C"]


class Given(NamedTuple):
    """The output of ``condition``."""

    shared: Gaussian
    """The shared code S_A of the audio."""
    request: Request | None = None
    """What controls request of the stored clips; None without a request."""


#: Draws as in the papers.
_PAPER = Audio2GesturesSampling()


def build(config: Audio2GesturesConfig, data: Data, sampling: Audio2GesturesSampling = _PAPER) -> Model:
    """Audio2Gestures for a corpus's poses and audio features; see :class:`a2g_jax.models.base.Model` for its parts.

    Raises:
        InputError: clips too short for a loss, or sampling settings that do not apply to this latent space.
    """
    codec = Codec(config, data)
    check_objective(config)
    check_sampling(config, sampling)
    names = control_names(config, data)
    categories = {EMOTION: emotion_names(data)} if EMOTION in names else {}
    check_controls(config, sampling, names, categories)
    weighted = weights(config)

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Sum of weighted terms; each term is reported unweighted under its name."""
        values = terms(codec, params, key, batch)
        return total(values, weighted(step)), values

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """The specific code of every clip with the clip's properties, or the mean and standard deviation of the code
        over time for the mapping net."""
        specific = codec.encode_motion(params, batch.pose)[1]
        if specific is None:
            return {}
        if config.stored_codes:
            return {"specific_code": specific.mean.astype(jnp.float16), **clip_properties(config, data, names, batch)}
        # Over its steps, as the noise has in training: interpolation would narrow it.
        code = codec.to_frames(specific.sample(key))
        return {"specific_mean": jnp.mean(code, axis=1), "specific_std": jnp.std(code, axis=1)}

    def condition(params: Params, summary: Summary, given: Condition) -> Given:
        """The shared code S_A of an audio, and what controls request of the stored clips."""
        shared = codec.encode_audio(params, given.audio[None])
        if given.controls is None:
            return Given(shared)
        return Given(shared, request(names, sampling, summary, given.controls))

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], given: Given, start: Int[Array, ""]
    ) -> Float[Array, "T R D"]:
        """The motion g(S_A, I_R) for the output of :func:`condition`."""
        codes = draw_codes(codec, sampling, params, summary, key, given.shared, start, given.request)
        return codec.decode(params, *codes, sampling=sampling)[0]

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """The motion g(S_M, I_M) of mean codes."""
        shared, specific = codec.encode_motion(params, batch.pose)
        again = None if specific is None else codec.specific_to_frames(specific.mean)
        return codec.decode(params, codec.to_frames(shared.mean), again)

    stages = [Stage((Update(loss),))]
    if config.adversarial_steps:
        stages.append(adversarial_stage(codec))

    def init(key: Key[Array, ""]) -> Params:
        """Initial parameters of all networks, a discriminator's included."""
        if not config.adversarial_steps:
            return codec.init(key)
        return {**codec.init(key), "discriminator": init_discriminator(jax.random.fold_in(key, 1), codec)}

    return Model(
        "audio2gestures",
        config,
        config.clip_frames,
        _halo(config, sampling),
        init,
        tuple(stages),
        summarise,
        needs_perceptual=config.lpips_weight > 0,
        summary_fields=("audio", "pose", *(("emotion",) if EMOTION in names else ())),
        condition=condition,
        condition_fields=("audio", *(("controls",) if names else ())),
        sample=sample,
        controls=Controls(
            names,
            categories=categories,
            stored=(VALUES, *((LABELS,) if EMOTION in names else ())),
            free=True,
        )
        if names
        else None,
        reconstruct=reconstruct,
    )


def check_sampling(config: Audio2GesturesConfig, sampling: Audio2GesturesSampling) -> None:
    """Refuse sampling settings that do not apply to a latent space.

    Raises:
        InputError: an invalid edit, or one that needs another code.
    """
    for edit in sampling.all_edits:
        if parse_edit(edit, config.dct_points).action == "swap":
            raise InputError(f"--edit {edit!r}: takes bands from another code; this is possible from Python only.")


def check_controls(
    config: Audio2GesturesConfig,
    sampling: Audio2GesturesSampling,
    names: tuple[str, ...],
    categories: dict[str, tuple[str, ...]],
) -> None:
    """Refuse controls that a run does not have.

    Raises:
        InputError: a request or a gain of such a control, or one that is not well formed.
    """
    if sampling.controls and not names:
        why = "its poses have no wrists" if config.stored_codes else "it was trained without --stored-codes"
        raise InputError(f"--control {sampling.controls[0]!r}: the run has no controls, since {why}; use 'demo'.")
    parse_curves(sampling.controls, names, categories)
    parse_gains(sampling.control_gains if names else (), names)


def draw_codes(
    codec: Codec,
    sampling: Audio2GesturesSampling,
    params: Params,
    summary: Summary,
    key: Key[Array, ""],
    shared: Gaussian,
    start: Int[Array, ""],
    requested: Request | None = None,
) -> tuple[Code, Code | None]:
    """The codes S_A and I_R that generation decodes: drawn, in time, edited.

    Args:
        sampling: settings of the draw and of the edits.
        shared: output of ``condition``.
        start: first frame of the window in the whole audio, a multiple of 128.
        requested: what controls request of the stored clips.
    """
    config = codec.config
    edits = [parse_edit(text, config.dct_points) for text in sampling.all_edits]
    drawn = _draw(codec, sampling, params, summary, key, shared, start, requested)

    def edited(place: int, name: str) -> Code:
        def other(edit: Edit) -> Code:
            # A sample number that --samples does not reach.
            again = jax.random.fold_in(key, 2**31 + int(edit.value))
            code: Code = _draw(codec, sampling, params, summary, again, shared, start, requested)[place]
            return code

        chosen = [edit for edit in edits if edit.code == name]
        code = drawn[place]
        assert code is not None
        return apply_edits(code, chosen, config.dct_points, other)

    return edited(0, "shared"), None if drawn[1] is None else edited(1, "specific")


def _draw(codec, sampling, params, summary, key, shared, start, requested):
    """Codes before any edit; I_R of training clips or of the mapping net, or standard normal without either."""
    config = codec.config
    frames, channels = shared.mean.shape[1:]
    which, noise_key, shared_key, code_key = jax.random.split(key, 4)
    audio_code = shared.mean
    if sampling.sample_codes:
        audio_code = shared.shift(frame_normal(shared_key, start, frames, channels)[None])
    audio_code = codec.to_frames(audio_code)
    if not config.split:
        return audio_code, None
    size = config.specific_frames
    if config.stored_codes:
        codes = summary["specific_code"]
        weights, shift = (None, None) if requested is None else requested
        steps = stored_steps(which, codes, sampling, start // size, frames // size, size, weights, shift)
        return audio_code, codec.specific_to_frames(steps[None])
    # One draw for each step, that of its first frame: a function of the key and the absolute frame alone.
    noise = sampling.noise_scale * frame_normal(noise_key, start, frames, channels)[::size]
    if not config.mapping:
        return audio_code, codec.specific_to_frames(noise[None])
    mean, std = blended_draws(
        which, (summary["specific_mean"], summary["specific_std"]), start, frames, sampling.redraw_frames
    )
    # Blending with constant variance may pass zero.
    mapped = codec.map_noise(params, (mean[::size] + jnp.maximum(std[::size], 0.0) * noise)[None])
    specific = mapped.mean
    if sampling.sample_codes:
        specific = mapped.shift(frame_normal(code_key, start, frames, channels)[None, ::size])
    return audio_code, codec.specific_to_frames(specific)


def _halo(config: Audio2GesturesConfig, sampling: Audio2GesturesSampling) -> int:
    """Frames on either side that an output frame depends on; for the GRU, those with a noticeable effect."""
    if config.latent == "dct":
        reach = config.dct_points - 1
    elif config.backbone == "gru":
        reach = RECURRENT_REACH
    elif config.backbone == "transformer":
        reach = config.attention_layers * (config.attention_window // 2)
    else:
        reach = receptive_halo(len(config.audio_channels), config.kernel_size)
    if config.latent == "dct":
        # The mapping net works in time before its bands are taken.
        mapping = config.dct_points - 1 + MAPPING_LAYERS * (config.kernel_size // 2)
    else:
        # Stored codes take none.
        mapping = 0 if config.stored_codes else MAPPING_LAYERS * (config.kernel_size // 2)
    # Interpolation takes one more step.
    mapping = (mapping + 1) * config.specific_frames if config.specific_frames > 1 else mapping
    # The decoder takes codes from an encoder or from the mapping net; the one that reaches farther counts.
    filters = config.smoothing if sampling.rest_smoothing == 0 else adaptive_reach(sampling.rest_smoothing)
    return max(reach, mapping) + receptive_halo(len(config.decoder_channels), config.kernel_size) + filters
