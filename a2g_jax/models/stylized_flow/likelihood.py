"""How likely a motion is to the flow, frame by frame.

A frame's density is that of its z-scores given the poses before it and the audio around it; over a clip the
logarithms add up to that of the whole, since a frame's place depends on no later one (MoGlow, Eq. 5).

Training shows poses through a little normal noise (``input_noise``), so the density learned is that of poses *plus
noise*: the true one smeared by a normal distribution of that width. It is taken here at the pose itself, with the poses
before it as they are: nothing is drawn, and the same motion always gets the same values. So a value tells how much mass
the model puts around a pose, no nearer than the noise; where a channel never moves it stays bounded. At the pose itself
such a channel counts half a nat more than the noisy poses of training do on average, so the mean over a held-out motion
is a little above the log-likelihood that training reports: :func:`a2g_jax.evaluation.likelihood.bits_per_dim` has both.
"""

from collections.abc import Callable

from jaxtyping import Array, Float

from a2g_jax.models.base import Params
from a2g_jax.models.stylized_flow.networks import FlowNetworks, Told
from a2g_jax.nn.flow.priors import log_prob


def log_likelihood(
    networks: FlowNetworks, params: Params, flat: Float[Array, "B T C"], told: Told
) -> tuple[Float[Array, "B N"], Float[Array, "B N C"]]:
    """Log-density of each frame in nats, and the latents.

    Args:
        flat: z-scores of whole clips, of which the frames with history and lookahead are looked at.
        told: what those frames are told.
    """
    z, log_det = networks.latents(params, networks.inner(flat), told)
    return log_prob(z, networks.config.freedom) + log_det, z


def make_score(networks: FlowNetworks) -> Callable[..., Array]:
    """The model's answer to ``score``: see :class:`a2g_jax.models.base.Model`."""

    def score(
        params: Params,
        audio: Float[Array, "B T bands"],
        pose: Float[Array, "B T R D"],
        clean: Float[Array, "B T R D"] | None = None,
    ) -> Float[Array, "B N"]:
        """Of the frames with history and lookahead; recurrent layers are at rest before the first of them."""
        flat = networks.flat(pose)
        controls = None if clean is None else networks.controls(clean)
        told = networks.told(params, audio, flat, controls=controls)
        return log_likelihood(networks, params, flat, told)[0]

    return score
