"""The stylized flow as a record of pure functions."""

import math
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.models.base import Condition, Controls, Data, Model, Params, Stage, Summary, Update
from a2g_jax.models.control_curves import parse_curves, parse_gains, public_name
from a2g_jax.models.stylized_flow import autoregression
from a2g_jax.models.stylized_flow.autoregression import Limits, Sampling, State
from a2g_jax.models.stylized_flow.conditioning import pose_mask
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.controls import check_controls, requested
from a2g_jax.models.stylized_flow.extras import Extras
from a2g_jax.models.stylized_flow.likelihood import log_likelihood, make_density
from a2g_jax.models.stylized_flow.networks import AudioContext, Conditioning, FlowNetworks
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
    gains = parse_gains(sampling.control_gains, config.style_controls)
    networks = FlowNetworks(config, data)
    likelihood, reverse = _likelihood(networks), _reverse(networks)

    noise = config.input_noise if sampling.denoise else 0.0
    guidance = sampling.style_guidance

    def noisy(key: Key[Array, ""], flat: Float[Array, "B M C"]) -> Float[Array, "B M C"]:
        if config.input_noise == 0:
            return flat
        # Drawn once: otherwise XLA repeats the draw in the code of each of the many windows that use it, and compiles
        # for minutes.
        noise = jax.lax.optimization_barrier(jax.random.normal(key, flat.shape, flat.dtype))
        return flat + config.input_noise * noise

    def extras(params: Params, show_key: Key[Array, ""], style_key: Key[Array, ""], batch: Batch) -> Extras:
        """Controls and style codes, hidden in some clips."""
        # Style controls are those of the poses without noise, which would be speed.
        found = Extras(networks.controls(batch.pose), mirrored=batch.mirrored)
        clips = len(batch.pose)
        if config.control_dropout > 0:
            stay = 1.0 - config.control_dropout
            found = found._replace(shown=jax.random.bernoulli(show_key, stay, (clips, 1, len(config.style_controls))))
        if config.style_channels:
            assert batch.other_pose is not None
            code = networks.style(params, networks.flat(batch.other_pose))
            found = found._replace(
                style=code, styled=jax.random.bernoulli(style_key, 1.0 - config.style_dropout, (clips,))
            )
        return found

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Bits per frame, and for a share of the batches the losses of the reverse pass."""
        del step
        mask_key, which_key, reverse_key, noise_key = jax.random.split(key, 4)
        flat = noisy(noise_key, networks.flat(batch.pose))
        clips, count = len(flat), networks.inner(flat).shape[1]
        mask = pose_mask(mask_key, config.frame_dropout, (clips, count, config.history_frames))
        hide_key, show_key, style_key = jax.random.split(jax.random.fold_in(key, 0), 3)
        if config.history_dropout > 0:
            mask &= jax.random.bernoulli(hide_key, 1.0 - config.history_dropout, (clips, 1, 1))
        given = networks.conditioning(params, batch.audio, flat, mask, extras(params, show_key, style_key, batch))
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
        given = networks.conditioning(params, batch.audio, flat, extras=networks.scored(batch.pose, batch.mirrored))
        return likelihood(params, flat, given)

    def warm_start(params: Params, batch: Batch) -> Params:
        """Parameters with actnorms fitted to the first batch, with the noise of training."""
        flat = noisy(jax.random.key(0), networks.flat(batch.pose))
        return networks.fitted(params, batch.audio, flat, networks.scored(batch.pose, batch.mirrored))

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """Mean over time of the latents of every clip, the range of its poses, and its mean style controls if any."""
        del key
        flat = networks.flat(batch.pose)
        given = networks.conditioning(params, batch.audio, flat, extras=networks.scored(batch.pose))
        z, _ = networks.latents(params, networks.inner(flat), given)
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
        controls = shown = style = None
        if given.controls is not None:
            controls = requested(given.controls, jnp.asarray(summary["control_mean"]), gains)[None]
            shown = ~jnp.isnan(given.controls)[None] if config.control_dropout > 0 else None
        if given.style is not None:
            style = given.style[None]
        conditions = Extras(controls, shown, style)
        guided = guidance != 1.0 and style is not None
        return networks.audio_context(params, given.audio, conditions, given.latents, guided)

    def how(summary: Summary) -> Sampling:
        return Sampling(Limits.of(summary), noise, guidance)

    def begin(
        params: Params, summary: Summary, key: Key[Array, ""], seed_poses: Float[Array, "S R D"] | None = None
    ) -> State:
        """State before the first frame: the seed poses or the mean pose, and hidden states of zero."""
        del key
        seed = None if seed_poses is None else networks.flat(seed_poses[None])[0]
        return autoregression.start(networks, params, 1, seed, how(summary))

    def proceed(
        params: Params, summary: Summary, key: Key[Array, ""], given: AudioContext, start: Int[Array, ""], state: State
    ) -> tuple[Float[Array, "T R D"], State]:
        """The next frames of a motion, and the state after them."""
        frames = given.embedding.shape[0]
        z = draw_latents(sampling.temperature, config.freedom, key, start, frames, networks.channels)
        z = given.latents.mean + given.latents.scale * z
        flat, state = autoregression.proceed(networks, params, z[:, None], given, state, start, how(summary))
        return networks.form.frames(flat)[0], state

    def sample(
        params: Params, summary: Summary, key: Key[Array, ""], given: AudioContext, start: Int[Array, ""]
    ) -> Float[Array, "T R D"]:
        """A motion from frame ``start`` on, after the mean pose."""
        if config.overlap:
            given = jax.tree.map(lambda array: jnp.pad(array, ((0, config.overlap), (0, 0)), mode="edge"), given)
        return proceed(params, summary, key, given, start, begin(params, summary, key))[0]

    def reconstruct(params: Params, batch: Batch) -> Float[Array, "B T R D"]:
        """Each frame of latent zero, given the true frames before it; the ends of a clip are unchanged."""
        flat = networks.flat(batch.pose)
        given = networks.conditioning(params, batch.audio, flat, extras=networks.scored(batch.pose, batch.mirrored))
        likely = networks.motion(params, jnp.zeros_like(networks.inner(flat)), given)
        first = config.history_frames
        return networks.pose(flat.at[:, first : first + likely.shape[1]].set(likely))[:, : batch.pose.shape[1]]

    def encode(
        params: Params,
        audio: Float[Array, "T bands"],
        pose: Float[Array, "T R D"],
        controls: Float[Array, "T K"],
        style: Float[Array, " S"] | None = None,
    ) -> Float[Array, "N C"]:
        """Latents of a clip's frames, given its own speech and its own poses before them; with a stride, those of the
        pose at or before each."""
        flat = networks.flat(pose[None])
        conditions = Extras(controls[None], style=None if style is None else style[None])
        given = networks.conditioning(params, audio[None], flat, extras=conditions)
        z = networks.latents(params, networks.inner(flat), given)[0][0]
        return jnp.repeat(z, config.stride, axis=0)[: len(pose) - config.before - networks.lookahead]

    def style_code(params: Params, pose: Float[Array, "T R D"]) -> Float[Array, " S"]:
        """The style code of a clip, about as long as those of training."""
        return networks.style(params, networks.flat(pose[None]))[0]

    names = config.style_controls
    return Model(
        "stylized_flow",
        config,
        config.clip_frames,
        max(config.before, networks.lookahead),
        networks.init,
        (Stage((Update(loss),), validation_loss=validation_loss, warm_start=warm_start),),
        summarise,
        batch_fields=("audio", "pose", *(("other_pose",) if config.style_channels else ())),
        needs_perceptual=config.perceptual_weight > 0 and config.reverse_share > 0,
        condition=condition,
        condition_fields=(
            *("audio", "seed_poses", "latents"),
            *(("controls",) if names else ()),
            *(("style",) if config.style_channels else ()),
        ),
        sample=sample,
        begin=begin,
        proceed=proceed,
        seed_frames=config.before,
        lookahead=networks.lookahead,
        overlap=config.overlap,
        controls=Controls(tuple(map(public_name, names)), networks.controls, stored=("control_mean",))
        if names
        else None,
        reconstruct=reconstruct,
        encode=encode,
        style_code=style_code if config.style_channels else None,
        density=make_density(networks),
    )


def draw_latents(
    temperature: float, freedom: float, key: Key[Array, ""], start: Int[Array, ""], frames: int, channels: int
) -> Float[Array, "T C"]:
    """Latents of the frames from ``start``: each a function of the key and its number."""
    normal_key, divisor_key = jax.random.split(key)
    normal = frame_normal(normal_key, start, frames, channels)

    def one(number, latent):
        return spread(latent, jax.random.fold_in(divisor_key, number.astype(jnp.uint32)), freedom)

    return temperature * jax.vmap(one)(start + jnp.arange(frames), normal)


def _likelihood(networks: FlowNetworks) -> Any:
    """A function of clips: the mean bits per frame, and terms."""

    def bits(
        params: Params, flat: Float[Array, "B M C"], given: Conditioning
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
        flat: Float[Array, "B M C"],
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
        # The deepest features but one: of our five blocks the fourth. The authors take the second convolution.
        ours, theirs = data.perceptual(poses)[-2], data.perceptual(networks.inner_frames(pose))[-2]
        return reconstruction, jnp.mean(jnp.abs(ours - theirs))

    return losses
