"""The losses of EmotionGesture's generator (Sec. III, Eqs. 2, 6 and 7)."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

#: In place of minus infinity, whose gradients are NaN.
_NEVER = -1e9
#: Added to squared lengths before division.
_EPSILON = 1e-12


def beat_alignment(
    text: Float[Array, "B N D"],
    beat: Float[Array, "B N D"],
    starts: Bool[Array, "B N"],
    temperature: float,
    form: str,
) -> Float[Array, ""]:
    """Contrastive loss between words and beat features, the mean over clips; clips without words have none.

    The text feature of a frame at which a word starts is an anchor. The beat feature of the same frame is its positive,
    those of all other frames of the clip are its negatives. Similarities are cosines ``s`` over the temperature.

    ``"words"`` is InfoNCE, the mean over a clip's U anchors of ``-log(exp s_uu / sum_i exp s_ui)``. ``"printed"`` is
    Eq. 2, ``-log sum_u (exp s_uu / sum_{i != u} exp s_ui)``, whose positive is not in the denominator; it can be below
    zero. Words that start within one frame share that frame's anchor, and words at the end of a clip are like others.

    Args:
        text: features of the transcript at its frames.
        beat: beat features of the audio.
        starts: whether a word starts within each frame.
        form: ``"words"`` or ``"printed"``.
    """
    scores = jnp.einsum("bud,bid->bui", _unit(text), _unit(beat)) / temperature
    own = jnp.diagonal(scores, axis1=1, axis2=2)
    if form == "words":
        each = jax.nn.logsumexp(scores, axis=2) - own
        count = jnp.sum(starts, axis=1)
        clips = jnp.sum(jnp.where(starts, each, 0.0), axis=1) / jnp.maximum(count, 1)
        return jnp.mean(clips)
    same = jnp.eye(scores.shape[1], dtype=bool)[None]
    ratios = own - jax.nn.logsumexp(jnp.where(same, _NEVER, scores), axis=2)
    spoken = jnp.any(starts, axis=1)
    # Clips without words are left out before the logarithm, not after it.
    kept = jnp.where(starts | ~spoken[:, None], ratios, _NEVER)
    return jnp.mean(jnp.where(spoken, -jax.nn.logsumexp(kept, axis=1), 0.0))


def motion_smooth(target: Float[Array, "B N C"], made: Float[Array, "B N C"], temperature: float) -> Float[Array, ""]:
    """Motion-smooth loss (Eq. 6): ``KL(softmax(d / temperature) || softmax(d'))``, the mean over channels and clips.

    ``d`` and ``d'`` are the differences between neighbouring frames of the true and the generated motion. The paper
    does not say over which axis the softmax runs. Here it is time, in each channel by itself: the distribution then
    says when a channel moves, and channels of different units are not compared. The loss is zero if and only if
    ``d' - d / temperature`` is constant in time in every channel, because a softmax does not change when a constant is
    added.
    """
    true = jax.nn.log_softmax(jnp.diff(target, axis=1) / temperature, axis=1)
    ours = jax.nn.log_softmax(jnp.diff(made, axis=1), axis=1)
    return jnp.mean(jnp.sum(jnp.exp(true) * (true - ours), axis=1))


def reconstruction(target: Float[Array, "B N C"], made: Float[Array, "B N C"]) -> Float[Array, ""]:
    """Mean absolute difference (Eq. 7)."""
    return jnp.mean(jnp.abs(target - made))


def generator_adversarial(logits: Float[Array, " L"]) -> Float[Array, ""]:
    """``-log D`` of generated motion: the generator's side of Eq. 8 in its non-saturating form."""
    return jnp.mean(jax.nn.softplus(-logits))


def discriminator_adversarial(real: Float[Array, " L"], fake: Float[Array, " M"]) -> Float[Array, ""]:
    """``-log D`` of true motion and ``-log(1 - D)`` of generated motion: minus Eq. 8."""
    return jnp.mean(jax.nn.softplus(-real)) + jnp.mean(jax.nn.softplus(fake))


def _unit(x: Float[Array, "B N D"]) -> Float[Array, "B N D"]:
    return x * jax.lax.rsqrt(jnp.sum(x * x, axis=-1, keepdims=True) + _EPSILON)
