"""The style of a clip: its latents of a flow, and how they drive other speech (Stylized flow, ECCV 2022, Sec. 4.5).

Runs trained for it also take the clip's style code, and the height, speed and radius of its hands.

The paper replaces the drawn latent of a frame by the clip's. That ends with the clip, and all samples are equal. Here
latents are ``mean_t + scale_t * drawn_t``, with a share ``w`` of style:

- ``repeat``: ``w z_t + sqrt(1 - w^2) drawn_t``, with the clip's latents forwards and backwards in turn, so that
  consecutive latents stay consecutive. Share 1 is the paper's.
- ``statistics``: ``w m + sqrt(w^2 s^2 + 1 - w^2) drawn_t``, with the clip's mean ``m`` and standard deviation ``s`` of
  each channel over time: the average of ``repeat``, without the clip's order in time.

Under a flow that fits, the latents of all clips together have mean 0 and variance 1 in every channel, and so have both
mixtures for every share. Share 0 is plain generation. A flow that fits would also have latents that are independent
from frame to frame, as draws are; where those of a clip vary more slowly, ``statistics`` moves faster than the clip.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.errors import InputError
from a2g_jax.models.base import Latents

MODES = ("repeat", "statistics")
#: Largest standard deviation of a channel of latents over a clip; those of training clips are within.
_WIDEST_CHANNEL = 1.3
#: Largest deviation of a value. Clips have more values beyond three than draws do, where they move fast; with another
#: speech, hands throw themselves about there.
_LARGEST_VALUE = 1.5
#: Sine of the angle between two means below which they are interpolated linearly.
_COLLINEAR = 1e-4


@dataclass(frozen=True, eq=False)
class Style:
    """Latents of a clip, and how they are mixed with drawn ones."""

    latents: Float[np.ndarray, "T C"]
    """From :meth:`a2g_jax.generation.stylized_flow.latent_space.FlowSpace.encode`."""
    mode: str = "repeat"
    """``repeat`` or ``statistics``."""
    share: float = 1.0
    """Share of the style, from 0 to 1."""
    code: Float[np.ndarray, " S"] | None = None
    """The clip's style code, for runs with ``style_channels``; used with every share above 0."""
    controls: Float[np.ndarray, " K"] | None = None
    """The clip's mean style controls, metres and m/s, for runs with ``style_controls``."""
    trust: float = 1.0
    """Factor on the share for the latents alone, from 0 to 1: those of a clip far from the training data hold little
    of its style."""
    requests: Float[np.ndarray, " K"] | None = None
    """Quantiles of the training clips that are requested of each control, so that the motion for one speech gets the
    clip's: :meth:`a2g_jax.generation.stylized_flow.latent_space.FlowSpace.match`."""

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
        """Mean of the latents over time."""
        return self.latents.mean(axis=0)

    @property
    def std(self) -> Float[np.ndarray, " C"]:
        """Standard deviation of the latents over time."""
        return self.latents.std(axis=0)


def within_training(
    latents: Float[np.ndarray, "T C"], clip_means: Float[np.ndarray, "N C"] | None
) -> Float[np.ndarray, "T C"]:
    """Latents of a clip, no larger than those of training clips, and with the order of the clip's own.

    The mean over time keeps its direction, and its norm is at most the 99th percentile of the training clips'.
    Deviations from it keep their order: those of a channel are scaled to a standard deviation of at most 1.3, values
    are clipped to 1.5, and the whole is scaled to a mean square of at most 1, the variance of draws.

    Args:
        clip_means: mean latents of training clips; None leaves the clip's mean as it is.
    """
    mean = latents.mean(axis=0)
    if clip_means is not None:
        longest = float(np.percentile(np.linalg.norm(clip_means, axis=1), 99))
        mean = mean * min(1.0, longest / max(float(np.linalg.norm(mean)), 1e-9))
    around = latents - latents.mean(axis=0)
    around = around * np.minimum(1.0, _WIDEST_CHANNEL / np.maximum(around.std(axis=0), 1e-9))
    around = np.clip(around, -_LARGEST_VALUE, _LARGEST_VALUE)
    around = around * min(1.0, 1.0 / max(float(np.sqrt(np.square(around).mean())), 1e-9))
    return np.asarray(mean + around, np.float32)


def drive(style: Style | None, frames: int, channels: int) -> Latents | None:
    """Mean and scale of the latents of ``frames`` frames; None, for drawn latents, without a style.

    Raises:
        InputError: a style of another number of channels.
    """
    if style is None:
        return None
    if style.latents.shape[1] != channels:
        raise InputError(
            f"the style has {style.latents.shape[1]} channels, the run {channels}; encode the clip with this run."
        )
    share = style.trust * style.share
    rest = 1.0 - share**2
    if style.mode == "repeat":
        mean = share * style.latents[there_and_back(frames, len(style.latents))]
        scale = np.full(channels, np.sqrt(rest))
    else:
        mean = np.broadcast_to(share * style.mean, (frames, channels))
        scale = np.sqrt(share**2 * style.std**2 + rest)
    parts: Any = np.asarray(mean, np.float32), np.tile(np.asarray(scale, np.float32), (frames, 1))
    return Latents(*parts)


def there_and_back(frames: int, length: int) -> Int[np.ndarray, " frames"]:
    """Frames of a clip of that length, forwards and backwards in turn, without repeating its ends."""
    period = max(2 * (length - 1), 1)
    at = np.arange(frames) % period
    return np.minimum(at, period - at)


def blend(first: Style, second: Style, share: float) -> Style:
    """A style between two: the first for share 0, the second for 1; mode and share of style are the first's.

    Directions of the means over time are interpolated spherically and their lengths linearly, so that the blend of two
    distinct styles is as distinct. Around the means, latents are mixed with the cosine and the sine of ``share``
    quarter turns, and every channel is rescaled to the standard deviation of such a mixture of independent latents, so
    that a style blended with itself is unchanged. The shorter clip is repeated there and back up to the longer one's
    length. Opposite means are mixed linearly.

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
        whole = (first, second)[int(share)]
        return replace(whole, mode=first.mode, share=first.share, requests=None)
    length = max(len(first.latents), len(second.latents))
    ours, theirs = (style.latents[there_and_back(length, len(style.latents))] for style in (first, second))
    cos, sin = np.cos(0.5 * np.pi * share), np.sin(0.5 * np.pi * share)
    mixed = cos * (ours - ours.mean(axis=0)) + sin * (theirs - theirs.mean(axis=0))
    target, current = np.sqrt((cos * ours.std(axis=0)) ** 2 + (sin * theirs.std(axis=0)) ** 2), mixed.std(axis=0)
    mixed *= np.where(current > 1e-6, target / np.maximum(current, 1e-6), 1.0)
    mean = _interpolate_means(ours.mean(axis=0), theirs.mean(axis=0), share)
    between = lambda a, b: None if a is None or b is None else (1.0 - share) * a + share * b  # noqa: E731
    code, controls = between(first.code, second.code), between(first.controls, second.controls)
    trust = (1.0 - share) * first.trust + share * second.trust
    latents = np.asarray(mean + mixed, np.float32)
    return replace(first, latents=latents, code=code, controls=controls, trust=trust, requests=None)


def _interpolate_means(
    start: Float[np.ndarray, " C"], end: Float[np.ndarray, " C"], share: float
) -> Float[np.ndarray, " C"]:
    """Spherical interpolation of directions, linear of lengths."""
    lengths = float(np.linalg.norm(start)), float(np.linalg.norm(end))
    angle = np.arccos(np.clip(start @ end / max(lengths[0] * lengths[1], 1e-12), -1.0, 1.0))
    if np.sin(angle) < _COLLINEAR or min(lengths) < 1e-6:
        return (1.0 - share) * start + share * end
    direction = np.sin((1.0 - share) * angle) * start / lengths[0] + np.sin(share * angle) * end / lengths[1]
    return direction / np.sin(angle) * ((1.0 - share) * lengths[0] + share * lengths[1])
