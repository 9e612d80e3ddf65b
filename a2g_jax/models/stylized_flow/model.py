"""The stylized flow as a record of pure functions."""

import math
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.geometry.rotation import matrix_from_6d, matrix_to_6d
from a2g_jax.models.base import Data, Model, Params, Summary
from a2g_jax.models.stylized_flow.conditioning import hidden
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.controls import asked, check_controls, parse_curves
from a2g_jax.models.stylized_flow.likelihood import log_likelihood, make_score
from a2g_jax.models.stylized_flow.networks import Carried, FlowNetworks, Heard, Told
from a2g_jax.nn.flow.priors import spread
from a2g_jax.nn.noise import frame_normal


def build(config: StylizedFlowConfig, data: Data) -> Model:
    """The flow for a corpus's poses; see :class:`a2g_jax.models.base.Model` for its parts.

    Raises:
        InputError: the perceptual loss has no feature network, or poses tell no style controls.
    """
    check_controls(config.style_controls, data)
    if config.perceptual_weight > 0 and config.reverse_share > 0 and data.perceptual is None:
        raise InputError("--perceptual-weight: needs a feature network; add --features RUN, or set it to 0.")
    networks = FlowNetworks(config, data)
    curves = parse_curves(config.control_curves, config.style_controls)
    likelihood, reverse = _likelihood(networks), _reverse(networks)

    def noisy(key: Key[Array, ""], flat: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
        if config.input_noise == 0:
            return flat
        # Drawn once: XLA would draw it anew, in code of its own, for each of the many windows that see it, and compile
        # for minutes.
        noise = jax.lax.optimization_barrier(jax.random.normal(key, flat.shape, flat.dtype))
        return flat + config.input_noise * noise

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Bits per frame, and on a share of the batches the losses of the reverse pass."""
        del step
        hide_key, which_key, reverse_key, noise_key = jax.random.split(key, 4)
        flat = noisy(noise_key, networks.flat(batch.pose))
        clips, frames = len(flat), networks.inner(flat).shape[1]
        seen = hidden(hide_key, config.frame_dropout, (clips, frames, config.history_frames))
        # Style controls are those of the poses without noise, which would be speed.
        told = networks.told(params, batch.audio, flat, seen, networks.controls(batch.pose))
        bits, terms = likelihood(params, flat, told)
        if not config.reverses:
            return bits, terms
        taken = jax.random.bernoulli(which_key, config.reverse_share)
        nothing = lambda: (jnp.zeros(()), jnp.zeros(()))  # noqa: E731
        reconstruction, perceptual = jax.lax.cond(
            taken, lambda: reverse(params, reverse_key, batch.pose, flat, told), nothing
        )
        # Reported as they are on a batch that takes the pass.
        share = max(config.reverse_share, 1e-9)
        terms |= {"reconstruction": reconstruction / share, "perceptual": perceptual / share}
        return bits + config.reconstruction_weight * reconstruction + config.perceptual_weight * perceptual, terms

    def validation_loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Bits per frame with every pose seen, through the noise that training has."""
        del step
        flat = noisy(key, networks.flat(batch.pose))
        return likelihood(
            params, flat, networks.told(params, batch.audio, flat, controls=networks.controls(batch.pose))
        )

    def warm_start(params: Params, batch: Batch) -> Params:
        """Actnorms set from the first batch, as likelihoods see it."""
        flat = noisy(jax.random.key(0), networks.flat(batch.pose))
        return networks.fitted(params, batch.audio, flat, networks.controls(batch.pose))

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """Mean over time of the latents of every clip, the range of its poses, and its mean style controls if any."""
        del key
        flat = networks.flat(batch.pose)
        z, _ = networks.latents(params, networks.inner(flat), networks.told(params, batch.audio, flat))
        means = {
            "latent_mean": jnp.mean(z, axis=1),
            "pose_low": jnp.min(flat, axis=1),
            "pose_high": jnp.max(flat, axis=1),
        }
        if config.style_controls:
            means["control_mean"] = jnp.mean(networks.controls(batch.pose), axis=1)
        return means

    def condition(params: Params, audio: Float[Array, "T bands"]) -> Heard:
        """All that comes of the audio alone."""
        return networks.heard(params, audio)

    def begin(params: Params, summary: Summary, key: Key[Array, ""]) -> Carried:
        """The mean pose before the first frame, and recurrent layers at rest."""
        del summary, key
        return networks.start(params, 1)

    def proceed(
        params: Params, summary: Summary, key: Key[Array, ""], heard: Heard, start: Int[Array, ""], carried: Carried
    ) -> tuple[Float[Array, "T R D"], Carried]:
        """The next frames of a motion, and what those after them need."""
        if curves:
            frames = heard.embedding.shape[0]
            controls = asked(curves, jnp.asarray(summary["control_mean"]), start, frames, data.fps)
            heard = networks.steered(params, heard, controls)
        z = draw_latents(config, key, start, heard.embedding.shape[0], networks.channels)
        flat, carried = networks.proceed(params, z[:, None], heard, carried, networks.limits(summary))
        return networks.pose(jnp.swapaxes(flat, 0, 1))[0], carried

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], heard: Heard, start: Int[Array, ""]
    ) -> Float[Array, "T R D"]:
        """A motion from its first frame."""
        return proceed(params, summary, key, heard, start, begin(params, summary, key))[0]

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """The most likely frame after the true ones before it; the ends of a clip as they are."""
        flat = networks.flat(batch.pose)
        told = networks.told(params, batch.audio, flat)
        likely = networks.motion(params, jnp.zeros_like(networks.inner(flat)), told)
        first = config.history_frames
        return networks.pose(flat.at[:, first : first + likely.shape[1]].set(likely))

    return Model(
        "stylized_flow",
        config,
        config.clip_frames,
        max(config.history_frames, config.lookahead_frames),
        networks.init,
        loss,
        summarise,
        condition,
        sample,
        reconstruct,
        validation_loss,
        warm_start,
        begin,
        proceed,
        score=make_score(networks),
    )


def draw_latents(
    config: StylizedFlowConfig, key: Key[Array, ""], start: Int[Array, ""], frames: int, channels: int
) -> Float[Array, "T C"]:
    """Latents of the frames from ``start``, a multiple of 128: each a function of the key and its number."""
    normal_key, divisor_key = jax.random.split(key)
    normal = frame_normal(normal_key, start, frames, channels)

    def one(number, latent):
        return spread(latent, jax.random.fold_in(divisor_key, number.astype(jnp.uint32)), config.freedom)

    return config.temperature * jax.vmap(one)(start + jnp.arange(frames), normal)


def _likelihood(networks: FlowNetworks) -> Any:
    """Bits per frame of the frames of clips."""

    def bits(params: Params, flat: Float[Array, "B T C"], told: Told) -> tuple[Float[Array, ""], dict[str, Array]]:
        log_density, z = log_likelihood(networks, params, flat, told)
        per_frame = -jnp.mean(log_density) / math.log(2.0)
        return per_frame, {"bits_per_dim": per_frame / networks.channels, "latent_std": jnp.std(z)}

    return bits


def _reverse(networks: FlowNetworks) -> Any:
    """Distances from the truth of what random latents become after the true poses (Sec. 3.2 and 3.3)."""
    config, data = networks.config, networks.data

    def losses(
        params: Params, key: Key[Array, ""], pose: Float[Array, "B T R D"], flat: Float[Array, "B T C"], told: Told
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        inner = networks.inner(flat)
        keys = jax.random.split(key)
        z = spread(jax.random.normal(keys[0], inner.shape), keys[1], config.freedom)
        made = networks.motion(params, z, told)
        reconstruction = jnp.mean(jnp.abs(made - inner))
        if config.perceptual_weight == 0 or data.perceptual is None:
            return reconstruction, jnp.zeros(())
        poses = networks.pose(made)
        if data.representation == "6d":
            poses = matrix_to_6d(matrix_from_6d(poses))
        # Of the features, the deepest but one: the fourth block of the authors' network.
        ours, theirs = data.perceptual(poses)[-2], data.perceptual(networks.inner(pose))[-2]
        return reconstruction, jnp.mean(jnp.abs(ours - theirs))

    return losses
