"""The likelihood of a motion under the flow, frame by frame.

A frame's density is that of its z-scores given the poses before it and the audio around it; over a clip the
logarithms add up to that of the whole, since the density of a frame depends on no later one (MoGlow, Eq. 5). Channels
that hardly move, below ``least_std``, are left out. With a ``stride``, the density is that of the spline's knots,
and that of a knot is spread evenly over the frames up to the next one.

Poses have a little normal noise in training (``input_noise``), so the learned density is that of poses *plus noise*:
the true one convolved with a normal distribution of that width. It is evaluated at the pose itself, with the poses
before it unchanged: nothing is drawn, and the same motion always gets the same values. So a value measures the
probability mass around a pose, no finer than the noise; it stays bounded where a channel never moves. At the pose
itself such a channel counts half a nat more than the noisy poses of training do on average, so the mean over a
held-out motion is a little above the log-likelihood that training reports;
:func:`a2g_jax.evaluation.likelihood.bits_per_dim` gives both.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.models.base import Density, Params
from a2g_jax.models.stylized_flow.networks import Conditioning, FlowNetworks
from a2g_jax.nn.flow.priors import log_prob


def log_likelihood(
    networks: FlowNetworks, params: Params, flat: Float[Array, "B M C"], given: Conditioning
) -> tuple[Float[Array, "B N"], Float[Array, "B N C"]]:
    """Log-density of each frame in nats, and the latents.

    Args:
        flat: the flow's poses of whole clips; those with history and lookahead are evaluated.
        given: conditioning of those frames.
    """
    z, log_det = networks.latents(params, networks.inner(flat), given)
    return log_prob(z, networks.config.freedom) + log_det, z


def make_density(networks: FlowNetworks) -> Density:
    """The model's density: see :class:`a2g_jax.models.base.Density`."""
    config = networks.config

    def frame_log_likelihood(
        params: Params,
        audio: Float[Array, "B T bands"],
        pose: Float[Array, "B T R D"],
        clean: Float[Array, "B T R D"] | None = None,
    ) -> Float[Array, "B N"]:
        """Log-density in nats of the frames with history and lookahead; hidden states are zero before them."""
        flat = networks.flat(pose)
        extras = networks.scored(pose if clean is None else clean)
        given = networks.conditioning(params, audio, flat, extras=extras)
        by_pose = log_likelihood(networks, params, flat, given)[0] / config.stride
        count = pose.shape[1] - config.before - networks.lookahead
        return jnp.repeat(by_pose, config.stride, axis=1)[:, :count]

    # Encoders are left out: they are functions of the rest.
    plain = networks.without_parameters()

    def conditioning(
        audio: Float[Array, "B T bands"], pose: Float[Array, "B T R D"], clean: Float[Array, "B T R D"]
    ) -> tuple[Float[Array, "B N H"], Float[Array, "B N C"]]:
        """Pose history, audio window and style controls of the evaluated poses, and their z-scores."""
        flat = plain.flat(pose)
        given = plain.conditioning({}, audio, flat, extras=plain.scored(clean))
        return jnp.concatenate([given.history, given.context], axis=-1), plain.inner(flat)

    return Density(
        frame_log_likelihood,
        conditioning,
        config.before,
        networks.lookahead,
        config.input_noise,
        networks.channels,
        config.stride,
    )
