"""The style of a clip: its latents of a flow, and how they drive other speech (Stylized flow, ECCV 2022, Sec. 4.5).

The paper puts the clip's latent of a frame in the place of the drawn one. That ends with the clip, and every sample is
the same. Here latents are ``mean_t + scale_t * drawn_t``, and a share ``w`` of style takes the place of what is drawn:

- ``repeat``: ``w z_t + sqrt(1 - w^2) drawn_t``, with the clip's latents forwards and backwards in turn, so that
  neighbours stay neighbours. Share 1 is the paper's.
- ``statistics``: ``w m + sqrt(w^2 s^2 + 1 - w^2) drawn_t``, with the clip's mean ``m`` and standard deviation ``s`` of
  each channel over time: what ``repeat`` has on average, with nothing of the clip's course in time.

To a flow that fits, the latents of all clips together have mean 0 and variance 1 in every channel, and so have both
mixtures for every share. Share 0 is plain generation. A flow that fits would also have latents that are independent
from frame to frame, as draws are; where those of a clip are slower, ``statistics`` moves faster than the clip.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.errors import InputError
from a2g_jax.models.base import Latents

MODES = ("repeat", "statistics")
#: Sine of the angle between two means below which there is no arc from one to the other.
_NO_ARC = 1e-4


@dataclass(frozen=True, eq=False)
class Style:
    """Latents of a clip, and how they are mixed with drawn ones."""

    latents: Float[np.ndarray, "T C"]
    """Of :meth:`a2g_jax.generation.stylized_flow.latent_space.FlowSpace.encode`."""
    mode: str = "repeat"
    """``repeat`` or ``statistics``."""
    share: float = 1.0
    """Share of the style, from 0 to 1."""

    def __post_init__(self) -> None:
        """Refuse an unknown mode, a share out of range, and a clip without frames."""
        if self.mode not in MODES:
            raise InputError(f"no style mode {self.mode!r}; there are: {', '.join(MODES)}.")
        if not 0.0 <= self.share <= 1.0:
            raise InputError(f"the share of a style: expected 0 to 1; got {self.share}.")
        if len(self.latents) == 0:
            raise InputError("a style has no frames; encode a longer clip.")

    @property
    def mean(self) -> Float[np.ndarray, " C"]:
        """Over time."""
        return self.latents.mean(axis=0)

    @property
    def std(self) -> Float[np.ndarray, " C"]:
        """Over time."""
        return self.latents.std(axis=0)


def drive(style: Style | None, frames: int, channels: int) -> Latents | None:
    """Mean and scale of the latents of so many frames; None, for drawn latents, without a style.

    Raises:
        InputError: a style of another number of channels.
    """
    if style is None:
        return None
    if style.latents.shape[1] != channels:
        raise InputError(
            f"the style has {style.latents.shape[1]} channels, the run {channels}; encode the clip with this run."
        )
    rest = 1.0 - style.share**2
    if style.mode == "repeat":
        mean = style.share * style.latents[there_and_back(frames, len(style.latents))]
        scale = np.full(channels, np.sqrt(rest))
    else:
        mean = np.broadcast_to(style.share * style.mean, (frames, channels))
        scale = np.sqrt(style.share**2 * style.std**2 + rest)
    parts: Any = np.asarray(mean, np.float32), np.tile(np.asarray(scale, np.float32), (frames, 1))
    return Latents(*parts)


def there_and_back(frames: int, length: int) -> Int[np.ndarray, " frames"]:
    """Frames of a clip of that length, forwards and backwards in turn; its ends come once each time."""
    period = max(2 * (length - 1), 1)
    at = np.arange(frames) % period
    return np.minimum(at, period - at)


def blend(first: Style, second: Style, share: float) -> Style:
    """A style between two: the first for share 0, the second for 1; mode and share of style are the first's.

    Means over time go along the arc from one to the other, and their lengths linearly: two styles that stand out from
    the average have a blend that stands out as much. Around the means, latents are mixed with the cosine and the sine
    of ``share`` quarter turns, and every channel is brought to the standard deviation that such a mixture of
    independent latents has, so that a style blended with itself stays as it is. The shorter clip is repeated there and
    back up to the longer one's length. Opposite means have no arc; they are mixed linearly.

    Raises:
        InputError: a share outside of 0 to 1, or styles of different runs.
    """
    if not 0.0 <= share <= 1.0:
        raise InputError(f"the share of the second style in a blend: expected 0 to 1; got {share}.")
    if first.latents.shape[1] != second.latents.shape[1]:
        raise InputError(
            f"two styles have {first.latents.shape[1]} and {second.latents.shape[1]} channels; encode both clips with"
            " one run."
        )
    if share in (0.0, 1.0):
        return replace(first, latents=(first, second)[int(share)].latents)
    length = max(len(first.latents), len(second.latents))
    ours, theirs = (style.latents[there_and_back(length, len(style.latents))] for style in (first, second))
    cos, sin = np.cos(0.5 * np.pi * share), np.sin(0.5 * np.pi * share)
    mixed = cos * (ours - ours.mean(axis=0)) + sin * (theirs - theirs.mean(axis=0))
    wanted, found = np.sqrt((cos * ours.std(axis=0)) ** 2 + (sin * theirs.std(axis=0)) ** 2), mixed.std(axis=0)
    mixed *= np.where(found > 1e-6, wanted / np.maximum(found, 1e-6), 1.0)
    mean = _along_the_arc(ours.mean(axis=0), theirs.mean(axis=0), share)
    return replace(first, latents=np.asarray(mean + mixed, np.float32))


def _along_the_arc(
    start: Float[np.ndarray, " C"], end: Float[np.ndarray, " C"], share: float
) -> Float[np.ndarray, " C"]:
    """Spherical interpolation of directions, linear of lengths."""
    lengths = float(np.linalg.norm(start)), float(np.linalg.norm(end))
    angle = np.arccos(np.clip(start @ end / max(lengths[0] * lengths[1], 1e-12), -1.0, 1.0))
    if np.sin(angle) < _NO_ARC or min(lengths) < 1e-6:
        return (1.0 - share) * start + share * end
    direction = np.sin((1.0 - share) * angle) * start / lengths[0] + np.sin(share * angle) * end / lengths[1]
    return direction / np.sin(angle) * ((1.0 - share) * lengths[0] + share * lengths[1])
