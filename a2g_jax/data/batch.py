"""A batch of clips: the arrays that models are trained on."""

from typing import NamedTuple

from jaxtyping import Array, Float, Int


class Batch(NamedTuple):
    """B clips of T frames."""

    audio: Float[Array, "B T bands"]
    """Normalised audio features."""
    pose: Float[Array, "B T R D"]
    """Poses as the corpus writes them down, not normalised; in 6D the first two columns of each local rotation."""
    emotion: Int[Array, " B"] | None = None
    """Index into :attr:`a2g_jax.models.base.Data.emotions`."""
    speaker: Int[Array, " B"] | None = None
    """Index into :attr:`a2g_jax.models.base.Data.speakers`."""
