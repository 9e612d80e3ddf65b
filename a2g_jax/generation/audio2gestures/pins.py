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
from a2g_jax.geometry.motion import Motion, resample
from a2g_jax.geometry.retarget import find_rig, match_rigs, retarget
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.npz import read_motion_npz

#: Shortest clip that is pinned, seconds: shorter ones drown in their transitions.
SHORTEST = 0.2
#: Degrees by which a bone at rest may point elsewhere before a clip on the same joints is retargeted.
_SAME_REST = 1.0
#: A second from 0 on, and maybe how many seconds of the clip.
_FORM = re.compile(r"(?P<path>.+)@(?P<start>\d+\.?\d*|\.\d+)(\+(?P<length>\d+\.?\d*|\.\d+))?")


class Pin(NamedTuple):
    """A clip and where it is wanted."""

    name: str
    """Its file, for messages."""
    start: float
    """Seconds."""
    motion: Motion
    """On the run's skeleton, at its frame rate."""
    turned: float = 0.0
    """Degrees about the vertical by which it was turned to face as the run's motions do."""

    @property
    def first(self) -> int:
        """First frame of the stretch."""
        return round(self.start * self.motion.fps)

    @property
    def stop(self) -> int:
        """Frame after its last."""
        return self.first + self.motion.frames


def parse_pin(text: str) -> tuple[Path, float, float | None]:
    """File, second and seconds of ``wave.bvh@3.2`` (the whole clip) or ``wave.bvh@3.2+1.5`` (its first 1.5 seconds).

    Raises:
        InputError: of another form.
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
        facing: the root's usual rotation, by which the clip is turned as :func:`face` does.

    Raises:
        InputError: a file that cannot be read, a rig that is not understood, a clip shorter than a fifth of a second,
            or one shorter than what is asked of it.
    """
    path, start, length = parse_pin(text)
    motion = read_on_skeleton(path, skeleton, fps)
    if length is not None:
        frames = round(length * fps)
        if frames > motion.frames:
            raise InputError(f"--pin {text}: lasts {motion.seconds:.2f} s; ask for no more than that.")
        motion = replace(motion, rotations=motion.rotations[:frames], root=motion.root[:frames])
    if motion.seconds < SHORTEST:
        raise InputError(f"--pin {text}: lasts {motion.seconds:.2f} s; give a clip of {SHORTEST} s or more.")
    turned = 0.0
    if facing is not None:
        motion, turned = face(motion, facing)
    return Pin(str(path), start, motion, turned)


def read_on_skeleton(path: Path, skeleton: Skeleton, fps: float) -> Motion:
    """Any humanoid BVH, or an NPZ that this package wrote, on a run's skeleton at its frame rate.

    Raises:
        InputError: a file that cannot be read, or a rig that is not understood.
    """
    motion = read_motion_npz(path) if path.suffix.lower() == ".npz" else read_bvh(path)
    return on_skeleton(motion, skeleton, fps, str(path))


def on_skeleton(motion: Motion, skeleton: Skeleton, fps: float, name: str) -> Motion:
    """The rotations of a humanoid motion on another skeleton, at another rate.

    Args:
        name: of the motion, for messages.

    Raises:
        InputError: a rig that is not understood.
    """
    if not same_rest(motion.skeleton, skeleton):
        source = find_rig(motion, name=name)
        motion = retarget(motion, match_rigs(source, find_rig(skeleton, name="the run's skeleton")))
    # Bones of other lengths on the same joints need no retargeting: models see rotations alone.
    return resample(replace(motion, skeleton=skeleton), fps)


def same_rest(first: Skeleton, second: Skeleton) -> bool:
    """Whether joints are the same and bones at rest point the same way, whatever their lengths."""
    if not first.same_tree(second):
        return False
    ours, theirs = (np.asarray(skeleton.offsets, np.float64)[1:] for skeleton in (first, second))
    lengths = np.linalg.norm(ours, axis=1) * np.linalg.norm(theirs, axis=1)
    bones = lengths > 1e-8
    cosine = (ours * theirs).sum(axis=1)[bones] / lengths[bones]
    return bool(np.all(cosine > np.cos(np.deg2rad(_SAME_REST))))


def face(motion: Motion, facing: Float[np.ndarray, "3 3"]) -> tuple[Motion, float]:
    """A motion turned about the vertical so that its root is, on the whole, nearest to a rotation; and the degrees.

    The angle has the least sum of squared differences of matrices in closed form: with ``A`` the sum of
    ``R_t F^T`` over frames, ``trace(Y A)`` is greatest.
    """
    moment = np.einsum("tij,kj->ik", np.asarray(motion.rotations[:, 0], np.float64), facing)
    angle = np.arctan2(moment[2, 0] - moment[0, 2], moment[0, 0] + moment[2, 2])
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    rotations, root = np.array(motion.rotations), np.asarray(motion.root)
    rotations[:, 0] = turn @ rotations[:, 0]
    turned = replace(motion, rotations=rotations, root=(root @ turn.T).astype(root.dtype))
    return turned, float(np.rad2deg(angle))


def check_pins(pins: Sequence[Pin], frames: int, fps: float) -> list[Pin]:
    """The pins in their order in time.

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
    """One from ``first`` to ``stop - 1``, falling to zero over ``blend`` frames on either side as a raised cosine."""
    frame = np.arange(frames)
    outside = np.maximum(np.maximum(first - frame, frame - (stop - 1)), 0)
    return 0.5 + 0.5 * np.cos(np.pi * np.minimum(outside / (blend + 1), 1.0))


def pin_codes(
    space: LatentSpace, codes: Codes, pins: Sequence[Pin], *, blend: float = 0.75, shared: float = 0.0
) -> Codes:
    """The codes with those of the clips in their places.

    Around a clip its first and last pose are held for the width of the blend, weaker and weaker.

    Args:
        pins: as :func:`check_pins` gives them.
        blend: seconds on either side of a clip.
        shared: from 0 to 1, how far the clip's own shared code replaces the audio's; the paper has 0.
    """
    total = len(codes.specific)
    places = [(codes.context + pin.first, codes.context + pin.stop) for pin in pins]
    weights = np.zeros((len(pins), total))
    for number, (pin, (first, stop)) in enumerate(zip(pins, places, strict=True)):
        weights[number] = pin_weights(total, first, stop, round(blend * pin.motion.fps))
    # Where a clip stands, no neighbour's blend reaches in; between two close ones they share.
    for number, (first, stop) in enumerate(places):
        weights[np.arange(len(pins)) != number, first:stop] = 0.0
    weights /= np.maximum(weights.sum(axis=0), 1.0)
    left = jnp.asarray(1.0 - weights.sum(axis=0), jnp.float32)[:, None]
    mixed = {"specific": left * codes.specific}
    mixed["shared"] = (1.0 - shared * (1.0 - left)) * codes.shared
    for pin, weight, (first, _) in zip(pins, weights, places, strict=True):
        own = space.from_motion(pin.motion)
        # Row r of the speech's codes shows what row r - shift of the clip's does.
        rows = np.clip(np.arange(total) - (first - own.context), 0, len(own.specific) - 1)
        share = jnp.asarray(weight, jnp.float32)[:, None]
        mixed["specific"] = mixed["specific"] + share * own.specific[rows]
        mixed["shared"] = mixed["shared"] + shared * share * own.shared[rows]
    return replace(codes, specific=mixed["specific"], shared=mixed["shared"])
