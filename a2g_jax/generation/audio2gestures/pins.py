"""Motion clips pinned to moments of a generated motion, through their codes (Audio2Gestures, extended, Sec. 6.4).

The motion-specific code of the clip takes the place of the drawn one from frame t to t + n; the decoder makes the
transitions. The shared code stays the audio's, as in the paper; a share of the clip's own can be blended in.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.audio2gestures.latent_space import Codes, LatentSpace
from a2g_jax.generation.clips import read_on_skeleton
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.onto import face
from a2g_jax.geometry.skeleton import Skeleton

#: Shortest clip that is pinned, seconds: shorter ones are lost in their transitions.
SHORTEST = 0.2
#: A file, a second from 0 on, and optionally the length in seconds.
_FORM = re.compile(r"(?P<path>.+)@(?P<start>\d+\.?\d*|\.\d+)(\+(?P<length>\d+\.?\d*|\.\d+))?")


class Pin(NamedTuple):
    """A clip and its place in time."""

    name: str
    """Its file, for messages."""
    start: float
    """Seconds from the beginning of the speech."""
    motion: Motion
    """On the run's skeleton, at its frame rate."""
    turned: float = 0.0
    """Degrees about the vertical by which it was turned to the facing direction of the run's motions."""

    @property
    def first(self) -> int:
        """First frame of the stretch."""
        return round(self.start * self.motion.fps)

    @property
    def stop(self) -> int:
        """Frame after the last one of the stretch."""
        return self.first + self.motion.frames


def parse_pin(text: str) -> tuple[Path, float, float | None]:
    """File, second and length of ``wave.bvh@3.2`` (the whole clip) or ``wave.bvh@3.2+1.5`` (its first 1.5 seconds).

    Raises:
        InputError: another form.
    """
    found = _FORM.fullmatch(text)
    if found is None:
        raise InputError(
            f"--pin {text}: expected a file and a second from 0 on, such as wave.bvh@3.2, or wave.bvh@3.2+1.5 for the"
            " clip's first 1.5 seconds."
        )
    length = found["length"]
    return Path(found["path"]), float(found["start"]), None if length is None else float(length)


def read_pin(text: str, skeleton: Skeleton, fps: float, facing: Float[np.ndarray, "3 3"] | None = None) -> Pin:
    """The clip of a pin: any humanoid BVH, or an NPZ that this package wrote, on the run's skeleton.

    Args:
        text: as :func:`parse_pin` takes it.
        facing: mean rotation of the run's root, to which :func:`face` turns the clip; not turned if None.

    Raises:
        InputError: a file that cannot be read, a rig that is not recognised, a clip shorter than a fifth of a second,
            or one shorter than the requested length.
    """
    path, start, length = parse_pin(text)
    motion = read_on_skeleton(path, skeleton, fps)
    if length is not None:
        frames = round(length * fps)
        if frames > motion.frames:
            raise InputError(f"--pin {text}: lasts {motion.seconds:.2f} s; request no more than that.")
        motion = replace(motion, rotations=motion.rotations[:frames], root=motion.root[:frames])
    if motion.seconds < SHORTEST:
        raise InputError(f"--pin {text}: lasts {motion.seconds:.2f} s; give a clip of {SHORTEST} s or more.")
    turned = 0.0
    if facing is not None:
        motion, turned = face(motion, facing)
    return Pin(str(path), start, motion, turned)


def check_pins(pins: Sequence[Pin], frames: int, fps: float) -> list[Pin]:
    """The pins in order of time.

    Raises:
        InputError: a pin that ends after the speech, or two that overlap.
    """
    ordered = sorted(pins, key=lambda pin: pin.first)
    for pin in ordered:
        if pin.stop > frames:
            raise InputError(
                f"--pin {pin.name}@{pin.start:g}: ends at {pin.stop / fps:.2f} s, the speech at {frames / fps:.2f} s;"
                " pin it earlier, or cut it."
            )
    for before, after in zip(ordered, ordered[1:], strict=False):
        if after.first < before.stop:
            raise InputError(
                f"--pin {after.name}@{after.start:g}: begins before {before.name} ends at {before.stop / fps:.2f} s;"
                " pins must not overlap."
            )
    return ordered


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
        pins: from :func:`check_pins`.
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
