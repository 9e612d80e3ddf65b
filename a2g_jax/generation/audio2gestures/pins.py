"""Motion clips pinned to moments of a generated motion through their codes (Audio2Gestures, extended, Sec. 6.4).

The motion-specific code of the clip takes the place of the drawn one from frame t to t + n; the decoder makes the
transitions. The shared code stays the audio's, as in the paper; a share of the clip's own can be blended in.
"""

from collections.abc import Sequence
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.generation.audio2gestures.latent_space import Codes, LatentSpace
from a2g_jax.generation.pins.request import Pin


def pin_weights(frames: int, first: int, stop: int, blend: int) -> Float[np.ndarray, " frames"]:
    """Weights: one from ``first`` to ``stop - 1``, then a raised cosine to zero over ``blend`` frames."""
    frame = np.arange(frames)
    outside = np.maximum(np.maximum(first - frame, frame - (stop - 1)), 0)
    return 0.5 + 0.5 * np.cos(np.pi * np.minimum(outside / (blend + 1), 1.0))


def pin_codes(
    space: LatentSpace, codes: Codes, pins: Sequence[Pin], *, blend: float = 0.75, shared: float = 0.0
) -> Codes:
    """The codes with those of the clips in their places.

    Within the blend around a clip, its first and last pose are repeated with falling weight.

    Args:
        pins: from :func:`~a2g_jax.generation.pins.request.check_pins`.
        blend: seconds of blending on either side of a clip.
        shared: share of a clip's own shared code that replaces the audio's, from 0 to 1; 0 in the paper.
    """
    total = len(codes.specific)
    places = [(codes.context + pin.first, codes.context + pin.stop) for pin in pins]
    weights = np.zeros((len(pins), total))
    for number, (pin, (first, stop)) in enumerate(zip(pins, places, strict=True)):
        weights[number] = pin_weights(total, first, stop, round(blend * pin.motion.fps))
    # Inside a clip its neighbours' blends have no weight; between two close clips the weights are normalised.
    for number, (first, stop) in enumerate(places):
        weights[np.arange(len(pins)) != number, first:stop] = 0.0
    weights /= np.maximum(weights.sum(axis=0), 1.0)
    left = jnp.asarray(1.0 - weights.sum(axis=0), jnp.float32)[:, None]
    mixed = {"specific": left * codes.specific}
    mixed["shared"] = (1.0 - shared * (1.0 - left)) * codes.shared
    for pin, weight, (first, _) in zip(pins, weights, places, strict=True):
        own = space.from_motion(pin.motion)
        # Row r of the speech's codes corresponds to row r - (first - own.context) of the clip's.
        rows = np.clip(np.arange(total) - (first - own.context), 0, len(own.specific) - 1)
        share = jnp.asarray(weight, jnp.float32)[:, None]
        mixed["specific"] = mixed["specific"] + share * own.specific[rows]
        mixed["shared"] = mixed["shared"] + shared * share * own.shared[rows]
    return replace(codes, specific=mixed["specific"], shared=mixed["shared"])
