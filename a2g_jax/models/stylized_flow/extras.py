"""Conditioning of the flow that is neither audio nor poses: style controls, style codes and mirroring."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from a2g_jax.models.stylized_flow.conditioning import inner
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.stylized_flow.controls import scaled


class Extras(NamedTuple):
    """Conditioning of clips apart from audio and poses; what is None is hidden."""

    controls: Float[Array, "B T K"] | None = None
    """Style controls of every frame, metres and m/s."""
    shown: Bool[Array, "B T K"] | Bool[Array, "B 1 K"] | None = None
    """Which controls are visible; all of those given if None."""
    style: Float[Array, "B S"] | None = None
    """Style codes, of :meth:`a2g_jax.models.stylized_flow.networks.FlowNetworks.style`."""
    styled: Bool[Array, " B"] | None = None
    """Which style codes are visible; all of those given if None."""
    mirrored: Bool[Array, " B"] | None = None
    """Which clips are mirrored; none if None."""


#: Nothing but audio and poses.
PLAIN = Extras()


def extra_width(config: StylizedFlowConfig) -> int:
    """Values of :class:`Extras` in the context."""
    controls = (2 if config.control_dropout > 0 else 1) * len(config.style_controls)
    return int(config.mirror_flag) + (config.style_channels + 1 if config.style_channels else 0) + controls


def extra_values(config: StylizedFlowConfig, extras: Extras, like: Float[Array, "B N D"]) -> Float[Array, "B N E"]:
    """Values of the context that are not audio, for the N poses of each clip that are conditioned on them."""
    clips, count = like.shape[:2]
    parts = [jnp.zeros((clips, count, 0), like.dtype)]
    over = lambda values: jnp.broadcast_to(values[:, None], (clips, count, values.shape[1]))  # noqa: E731
    if config.mirror_flag:
        mirrored = jnp.zeros(clips) if extras.mirrored is None else extras.mirrored.astype(like.dtype)
        parts.append(over(mirrored[:, None]))
    if config.style_channels:
        code = jnp.zeros((clips, config.style_channels)) if extras.style is None else extras.style
        styled = jnp.full(clips, extras.style is not None) if extras.styled is None else extras.styled
        visible = styled.astype(like.dtype)[:, None]
        parts.append(over(jnp.concatenate([code * visible, visible], axis=-1)))
    if names := config.style_controls:
        hidden = jnp.zeros((clips, count, len(names)), like.dtype)
        values, visible = hidden, hidden
        if extras.controls is not None:
            values = _at(config, scaled(names, extras.controls), count)
            visible = jnp.ones_like(values)
            if extras.shown is not None:
                visible = jnp.broadcast_to(_at(config, extras.shown.astype(like.dtype), count), values.shape)
        parts += [values * visible, visible] if config.control_dropout > 0 else [values]
    return jnp.concatenate(parts, axis=-1)


def _at(config: StylizedFlowConfig, by_frame: Float[Array, "B T K"], count: int) -> Float[Array, "B N K"]:
    """Values of whole clips at the N poses; those of N frames, or of a clip, as they are."""
    if by_frame.shape[1] in (1, count):
        return by_frame
    return inner(config, by_frame[:, :: config.stride])
