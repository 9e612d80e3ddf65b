"""The stylized flow as a record of pure functions."""

import math
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.models.base import Condition, Controls, Data, Model, Params, Stage, Summary, Update
from a2g_jax.models.control_curves import parse_curves
from a2g_jax.models.stylized_flow.conditioning import pose_mask
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.controls import check_controls, requested
from a2g_jax.models.stylized_flow.likelihood import log_likelihood, make_density
from a2g_jax.models.stylized_flow.networks import AudioContext, Conditioning, FlowNetworks, State
from a2g_jax.models.stylized_flow.sampling import StylizedFlowSampling
from a2g_jax.nn.flow.priors import spread
from a2g_jax.nn.noise import frame_normal

#: Latents as in training.
_DEFAULT = StylizedFlowSampling()


def build(config: StylizedFlowConfig, data: Data, sampling: StylizedFlowSampling = _DEFAULT) -> Model:
    """The flow for a corpus's poses; see :class:`a2g_jax.models.base.Model` for its parts.

    Raises:
        InputError: style controls that cannot be measured on these poses, or requested ones that the run does not have.
    """
    check_controls(config.style_controls, data)
    parse_curves(sampling.controls, config.style_controls)
    networks = FlowNetworks(config, data)
    likelihood, reverse = _likelihood(networks), _reverse(networks)

    def noisy(key: Key[Array, ""], flat: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
        if config.input_noise == 0:
            return flat
        # Drawn once: otherwise XLA repeats the draw in the code of each of the many windows that use it, and compiles
        # for minutes.
        noise = jax.lax.optimization_barrier(jax.random.normal(key, flat.shape, flat.dtype))
        return flat + config.input_noise * noise

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Bits per frame, and for a share of the batches the losses of the reverse pass."""
        del step
        mask_key, which_key, reverse_key, noise_key = jax.random.split(key, 4)
        flat = noisy(noise_key, networks.flat(batch.pose))
        clips, frames = len(flat), networks.inner(flat).shape[1]
        mask = pose_mask(mask_key, config.frame_dropout, (clips, frames, config.history_frames))
        # Style controls are those of the poses without noise, which would be speed.
        given = networks.conditioning(params, batch.audio, flat, mask, networks.controls(batch.pose))
        bits, terms = likelihood(params, flat, given)
        if not config.reverses:
            return bits, terms
        taken = jax.random.bernoulli(which_key, config.reverse_share)
        skipped = lambda: (jnp.zeros(()), jnp.zeros(()))  # noqa: E731
        reconstruction, perceptual = jax.lax.cond(
            taken, lambda: reverse(params, reverse_key, batch.pose, flat, given), skipped
        )
        # Reported so that the mean over batches is that of the batches with the pass.
        share = max(config.reverse_share, 1e-9)
        terms |= {"reconstruction": reconstruction / share, "perceptual": perceptual / share}
        return bits + config.reconstruction_weight * reconstruction + config.perceptual_weight * perceptual, terms

    def validation_loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Bits per frame without a mask on the conditioning poses, with the noise of training."""
        del step
        flat = noisy(key, networks.flat(batch.pose))
        return likelihood(
            params, flat, networks.conditioning(params, batch.audio, flat, controls=networks.controls(batch.pose))
        )

    def warm_start(params: Params, batch: Batch) -> Params:
        """Parameters with actnorms fitted to the first batch, with the noise of training."""
        flat = noisy(jax.random.key(0), networks.flat(batch.pose))
        return networks.fitted(params, batch.audio, flat, networks.controls(batch.pose))

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """Mean over time of the latents of every clip, the range of its poses, and its mean style controls if any."""
        del key
        flat = networks.flat(batch.pose)
        z, _ = networks.latents(params, networks.inner(flat), networks.conditioning(params, batch.audio, flat))
        means = {
            "latent_mean": jnp.mean(z, axis=1),
            "pose_low": jnp.min(flat, axis=1),
            "pose_high": jnp.max(flat, axis=1),
        }
        if config.style_controls:
            means["control_mean"] = jnp.mean(networks.controls(batch.pose), axis=1)
        return means

    def condition(params: Params, summary: Summary, given: Condition) -> AudioContext:
        """The part of the conditioning that does not depend on poses."""
        controls = None
        if given.controls is not None:
            controls = requested(given.controls, jnp.asarray(summary["control_mean"]))
        return networks.audio_context(params, given.audio, controls, given.latents)

    def begin(
        params: Params, summary: Summary, key: Key[Array, ""], seed_poses: Float[Array, "S R D"] | None = None
    ) -> State:
        """State before the first frame: the seed poses or the mean pose, and hidden states of zero."""
        del summary, key
        return networks.start(params, 1, None if seed_poses is None else networks.flat(seed_poses[None])[0])

    def proceed(
        params: Params, summary: Summary, key: Key[Array, ""], given: AudioContext, start: Int[Array, ""], state: State
    ) -> tuple[Float[Array, "T R D"], State]:
        """The next frames of a motion, and the state after them."""
        frames = given.embedding.shape[0]
        z = draw_latents(sampling.temperature, config.freedom, key, start, frames, networks.channels)
        z = given.latents.mean + given.latents.scale * z
        flat, state = networks.proceed(params, z[:, None], given, state, networks.limits(summary))
        return networks.pose(jnp.swapaxes(flat, 0, 1))[0], state

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], given: AudioContext, start: Int[Array, ""]
    ) -> Float[Array, "T R D"]:
        """A motion from frame ``start`` on, after the mean pose."""
        return proceed(params, summary, key, given, start, begin(params, summary, key))[0]

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """Each frame of latent zero, given the true frames before it; the ends of a clip are unchanged."""
        flat = networks.flat(batch.pose)
        given = networks.conditioning(params, batch.audio, flat)
        likely = networks.motion(params, jnp.zeros_like(networks.inner(flat)), given)
        first = config.history_frames
        return networks.pose(flat.at[:, first : first + likely.shape[1]].set(likely))

    def encode(
        params: Params, audio: Float[Array, "T bands"], pose: Float[Array, "T R D"], controls: Float[Array, "T K"]
    ) -> Float[Array, "N C"]:
        """Latents of a clip's frames, given its own speech and its own poses before them."""
        flat = networks.flat(pose[None])
        given = networks.conditioning(params, audio[None], flat, controls=controls[None])
        return networks.latents(params, networks.inner(flat), given)[0][0]

    names = config.style_controls
    return Model(
        "stylized_flow",
        config,
        config.clip_frames,
        max(config.history_frames, config.lookahead_frames),
        networks.init,
        (Stage((Update(loss),), validation_loss=validation_loss, warm_start=warm_start),),
        summarise,
        needs_perceptual=config.perceptual_weight > 0 and config.reverse_share > 0,
        condition=condition,
        condition_fields=("audio", "seed_poses", "latents", *(("controls",) if names else ())),
        sample=sample,
        begin=begin,
        proceed=proceed,
        seed_frames=config.history_frames,
        lookahead=config.lookahead_frames,
        controls=Controls(names, networks.controls) if names else None,
        reconstruct=reconstruct,
        encode=encode,
        density=make_density(networks),
    )


def draw_latents(
    temperature: float, freedom: float, key: Key[Array, ""], start: Int[Array, ""], frames: int, channels: int
) -> Float[Array, "T C"]:
    """Latents of the frames from ``start``, a multiple of 128: each a function of the key and its number."""
    normal_key, divisor_key = jax.random.split(key)
    normal = frame_normal(normal_key, start, frames, channels)

    def one(number, latent):
        return spread(latent, jax.random.fold_in(divisor_key, number.astype(jnp.uint32)), freedom)

    return temperature * jax.vmap(one)(start + jnp.arange(frames), normal)


def _likelihood(networks: FlowNetworks) -> Any:
    """A function of clips: the mean bits per frame, and terms."""

    def bits(
        params: Params, flat: Float[Array, "B T C"], given: Conditioning
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        log_density, z = log_likelihood(networks, params, flat, given)
        per_frame = -jnp.mean(log_density) / math.log(2.0)
        return per_frame, {"bits_per_dim": per_frame / networks.channels, "latent_std": jnp.std(z)}

    return bits


def _reverse(networks: FlowNetworks) -> Any:
    """Losses of the reverse pass: distance from the truth of frames of random latents (Sec. 3.2 and 3.3)."""
    config, data = networks.config, networks.data

    def losses(
        params: Params,
        key: Key[Array, ""],
        pose: Float[Array, "B T R D"],
        flat: Float[Array, "B T C"],
        given: Conditioning,
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        inner = networks.inner(flat)
        keys = jax.random.split(key)
        z = spread(jax.random.normal(keys[0], inner.shape), keys[1], config.freedom)
        made = networks.motion(params, z, given)
        reconstruction = jnp.mean(jnp.abs(made - inner))
        if config.perceptual_weight == 0 or data.perceptual is None:
            return reconstruction, jnp.zeros(())
        poses = data.space.valid(networks.pose(made))
        # Of the features, the deepest but one: the fourth block of the authors' network.
        ours, theirs = data.perceptual(poses)[-2], data.perceptual(networks.inner(pose))[-2]
        return reconstruction, jnp.mean(jnp.abs(ours - theirs))

    return losses
