"""Audio2Gestures as a record of pure functions."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.models.audio2gestures.codec import Codec as Codec
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.edits import Edit, apply_edits, parse_edit
from a2g_jax.models.audio2gestures.networks import MAPPING_LAYERS, Gaussian
from a2g_jax.models.audio2gestures.objective import check_objective, terms, total, weights
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.base import Condition, Data, Model, Params, Stage, Summary, Update
from a2g_jax.nn.noise import blended_draws, frame_normal, slow_normal
from a2g_jax.nn.tcn import receptive_halo

#: Frames of context on either side for a GRU, whose memory is unbounded but fades.
RECURRENT_REACH = 256

Code = Float[Array, "1 T C"]

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
    weighted = weights(config)

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Sum of weighted terms; each term is reported unweighted under its name."""
        values = terms(codec, params, key, batch)
        return total(values, weighted(step)), values

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """Mean and standard deviation over time of the specific code of every clip in the batch."""
        specific = codec.encode_motion(params, batch.pose)[1]
        if specific is None:
            return {}
        code = codec.to_time(specific.sample(key))
        return {"specific_mean": jnp.mean(code, axis=1), "specific_std": jnp.std(code, axis=1)}

    def condition(params: Params, summary: Summary, given: Condition) -> Gaussian:
        """The shared code S_A of an audio."""
        del summary
        return codec.encode_audio(params, given.audio[None])

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], shared: Gaussian, start: Int[Array, ""]
    ) -> Float[Array, "T R D"]:
        """The motion g(S_A, I_R) for the output of :func:`condition`."""
        return codec.decode(params, *draw_codes(codec, sampling, params, summary, key, shared, start))[0]

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """The motion g(S_M, I_M) of mean codes."""
        shared, specific = codec.encode_motion(params, batch.pose)
        time = codec.to_time
        return codec.decode(params, time(shared.mean), None if specific is None else time(specific.mean))

    return Model(
        "audio2gestures",
        config,
        config.clip_frames,
        _halo(config),
        codec.init,
        (Stage((Update(loss),)),),
        summarise,
        needs_perceptual=config.lpips_weight > 0,
        condition=condition,
        sample=sample,
        reconstruct=reconstruct,
    )


def check_sampling(config: Audio2GesturesConfig, sampling: Audio2GesturesSampling) -> None:
    """Refuse sampling settings that do not apply to a latent space.

    Raises:
        InputError: slow noise for DCT bands, an invalid edit, or one that needs another code.
    """
    if config.latent == "dct" and sampling.noise_frames > 1:
        raise InputError("--noise-frames: bands of the DCT have no order in time; use 1 with a DCT latent space.")
    for edit in sampling.all_edits:
        if parse_edit(edit, config.dct_points).action == "swap":
            raise InputError(f"--edit {edit!r}: takes bands from another code; this is possible from Python only.")


def draw_codes(
    codec: Codec,
    sampling: Audio2GesturesSampling,
    params: Params,
    summary: Summary,
    key: Key[Array, ""],
    shared: Gaussian,
    start: Int[Array, ""],
) -> tuple[Code, Code | None]:
    """The codes S_A and I_R that generation decodes: drawn, in time, edited.

    Args:
        sampling: settings of the draw and of the edits.
        shared: output of ``condition``.
        start: first frame of the window in the whole audio, a multiple of 128.
    """
    config = codec.config
    edits = [parse_edit(text, config.dct_points) for text in sampling.all_edits]
    drawn = _draw(codec, sampling, params, summary, key, shared, start)

    def edited(place: int, name: str) -> Code:
        def other(edit: Edit) -> Code:
            # A sample number that --samples does not reach.
            again = jax.random.fold_in(key, 2**31 + int(edit.value))
            code: Code = _draw(codec, sampling, params, summary, again, shared, start)[place]
            return code

        chosen = [edit for edit in edits if edit.code == name]
        code = drawn[place]
        assert code is not None
        return apply_edits(code, chosen, config.dct_points, other)

    return edited(0, "shared"), None if drawn[1] is None else edited(1, "specific")


def _draw(codec, sampling, params, summary, key, shared, start):
    """Codes before any edit; I_R from the mapping net, or standard normal without one."""
    config = codec.config
    frames, channels = shared.mean.shape[1:]
    which, noise_key, shared_key, code_key = jax.random.split(key, 4)
    audio_code = shared.mean
    if sampling.sample_codes:
        audio_code = shared.shift(frame_normal(shared_key, start, frames, channels)[None])
    audio_code = codec.to_time(audio_code)
    if not config.split:
        return audio_code, None
    noise = sampling.noise_scale * slow_normal(noise_key, start, frames, channels, sampling.noise_frames)
    if not config.mapping:
        return audio_code, noise[None]
    mean, std = blended_draws(
        which, (summary["specific_mean"], summary["specific_std"]), start, frames, sampling.redraw_frames
    )
    mapped = codec.map_noise(params, (mean + std * noise)[None])
    specific = mapped.mean
    if sampling.sample_codes:
        specific = mapped.shift(frame_normal(code_key, start, frames, channels)[None])
    return audio_code, codec.to_time(specific)


def _halo(config: Audio2GesturesConfig) -> int:
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
        mapping = MAPPING_LAYERS * (config.kernel_size // 2)
    # The decoder takes codes from an encoder or from the mapping net; the one that reaches farther counts.
    return max(reach, mapping) + receptive_halo(len(config.decoder_channels), config.kernel_size)
