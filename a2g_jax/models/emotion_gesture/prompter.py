"""The spatial-temporal prompter: a prompt for every frame of a clip from its initial poses (Sec. III-C)."""

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float

from a2g_jax.models.emotion_gesture.mining import bent, dense
from a2g_jax.nn.conv import Conv1D
from a2g_jax.nn.se_resnet import group_norm


class PosePrompter(nn.Module):
    """Initial poses as they are, and predicted ones after them, the first of which are pulled to the initial ones.

    Everything is computed for each sample by itself. In the authors' code the product of Eq. 4 runs over the batch, and
    a sample's prompt depends on its neighbours.

    Args:
        features: width of the prompt.
        frames: of the clip (N).
        transition: poses on either side of the transition (L).
        kind: see :attr:`~a2g_jax.models.emotion_gesture.config.EmotionGestureConfig.prompter`.
        space: ``"features"`` of poses, or ``"poses"``.
        scaled: whether products are divided by the root of their length (Eq. 3) and by it (Eq. 4).
    """

    features: int
    frames: int
    transition: int
    kind: str
    space: str
    scaled: bool
    dropout: float

    @nn.compact
    def __call__(self, poses: Float[Array, "B M C"], deterministic: bool) -> Float[Array, "B N D"]:
        encode = PoseEncoder(self.features, self.dropout)
        if self.kind in ("zero", "duplicate"):
            return encode(_padded(poses, self.frames, self.kind), deterministic)
        if self.space == "poses":
            return encode(self._prompt(poses, deterministic), deterministic)
        return self._prompt(encode(poses, deterministic), deterministic)

    def _prompt(self, x: Float[Array, "B M W"], deterministic: bool) -> Float[Array, "B N W"]:
        future = PosePredictor(self.frames - x.shape[1])(x)
        recent, near = x[:, x.shape[1] - self.transition :], future[:, : self.transition]
        width = x.shape[-1]
        if self.kind in ("spatial", "spatial-temporal"):
            spatial = ChunkEncoder(width, self.dropout, name="spatial")(recent, deterministic)[:, None]
            near = interpolate(near, spatial, width**0.5 if self.scaled else 1.0)
        if self.kind == "spatial-temporal":
            # An encoder of its own, as in the authors' code.
            spatial = ChunkEncoder(width, self.dropout, name="memory")(recent, deterministic)
            temporal = ChunkEncoder(self.transition, self.dropout, name="temporal")(near, deterministic)
            near = reinforce(near, spatial, temporal, float(width) if self.scaled else 1.0)
        return jnp.concatenate([x, near, future[:, self.transition :]], axis=1)


class PoseEncoder(nn.Module):
    """Features of each pose by itself."""

    features: int
    dropout: float

    @nn.compact
    def __call__(self, poses: Float[Array, "B N C"], deterministic: bool) -> Float[Array, "B N D"]:
        hidden = nn.Dropout(self.dropout)(bent(dense(self.features)(poses)), deterministic=deterministic)
        encoded: Float[Array, "B N D"] = dense(self.features)(hidden)
        return encoded


class PosePredictor(nn.Module):
    """Future poses from initial ones: convolutions over the values of a pose, with frames as channels."""

    frames: int

    @nn.compact
    def __call__(self, x: Float[Array, "B M W"]) -> Float[Array, "B S W"]:
        y = jnp.swapaxes(x, 1, 2)
        for _ in range(2):
            y = group_norm(self.frames)(nn.relu(Conv1D(self.frames)(y)))
        return jnp.swapaxes(y, 1, 2)


class ChunkEncoder(nn.Module):
    """One vector of a chunk of frames."""

    features: int
    dropout: float

    @nn.compact
    def __call__(self, chunk: Float[Array, "B L W"], deterministic: bool) -> Float[Array, "B D"]:
        hidden = bent(dense(self.features)(chunk.reshape(len(chunk), -1)))
        encoded: Float[Array, "B D"] = dense(self.features)(
            nn.Dropout(self.dropout)(hidden, deterministic=deterministic)
        )
        return encoded


def interpolate(near: Float[Array, "B L W"], spatial: Float[Array, "B 1 W"], divisor: float) -> Float[Array, "B L W"]:
    """Spatial-interpolation prompt (Eq. 3): ``s f + (1 - s) F_S`` with ``s = sigmoid(F_S . f / divisor)``."""
    score = jax.nn.sigmoid(jnp.sum(near * spatial, axis=-1, keepdims=True) / divisor)
    return score * near + (1.0 - score) * spatial


def reinforce(
    near: Float[Array, "B L W"], spatial: Float[Array, "B W"], temporal: Float[Array, "B L"], divisor: float
) -> Float[Array, "B L W"]:
    """Temporal-reinforcement prompt (Eq. 4): ``f + f w`` with ``w = softmax((F_Te (x) F_S) (x) F_S / divisor)``.

    For one sample the product of L x 1, 1 x W and W x 1 is ``F_Te |F_S|^2``; the softmax runs over the L frames.
    """
    correlation = temporal * jnp.sum(spatial * spatial, axis=-1, keepdims=True) / divisor
    return near + near * jax.nn.softmax(correlation, axis=1)[..., None]


def _padded(poses: Float[Array, "B M C"], frames: int, kind: str) -> Float[Array, "B N C"]:
    """Initial poses repeated one after another, or followed by zeros."""
    missing = frames - poses.shape[1]
    if kind == "zero":
        return jnp.pad(poses, ((0, 0), (0, missing), (0, 0)))
    return jnp.tile(poses, (1, -(-frames // poses.shape[1]), 1))[:, :frames]
