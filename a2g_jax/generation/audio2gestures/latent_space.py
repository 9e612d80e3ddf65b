"""The latent space of a trained Audio2Gestures: encoding, drawing, editing and decoding of codes."""

from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.features.dct import block_dct
from a2g_jax.generation.controls import control_rows
from a2g_jax.generation.engine import WINDOW
from a2g_jax.generation.generator import plant_rotations, speech_features
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.edit_presets import expanded
from a2g_jax.models.audio2gestures.edits import apply_edits, parse_edit
from a2g_jax.models.audio2gestures.model import draw_codes
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.base import Condition
from a2g_jax.nn.blocks import BLOCK
from a2g_jax.training.run import Run

Code = Float[Array, "T C"]


@dataclass(frozen=True)
class Codes:
    """Both codes of a stretch of motion, in time, with whole blocks of context before and after it."""

    shared: Code
    specific: Code
    context: int
    """Frames of context before the stretch; at least as many follow it."""
    frames: int
    """Frames of the stretch itself."""

    def bands(self, name: str, points: int = BLOCK) -> Float[np.ndarray, "points C"]:
        """Root mean square of each DCT band over the stretch's blocks.

        Args:
            name: ``"shared"`` or ``"specific"``.
        """
        stop = self.context + -(-self.frames // points) * points
        inside = block_dct(getattr(self, name)[self.context : stop], points)
        blocks = np.asarray(inside).reshape(-1, points, inside.shape[-1])
        root: Float[np.ndarray, "points C"] = np.sqrt(np.mean(np.square(blocks), axis=0))
        return root


class LatentSpace:
    """Codes of speech and motion, and motion of codes; compiles once for each number of 1024-frame windows.

    Example:
        >>> import a2g_jax
        >>> space = a2g_jax.LatentSpace(a2g_jax.demo_run())
        >>> codes = space.from_audio(a2g_jax.talk(2.0, seed=5).audio, seed=0)
        >>> space.to_motion(space.edit(codes, "calmer")).frames
        60
    """

    def __init__(self, run: Run) -> None:
        """
        Raises:
            InputError: the run is not of Audio2Gestures on a skeleton with both codes.
        """
        config = run.config.model_config
        if not isinstance(config, Audio2GesturesConfig) or not config.split:
            raise InputError(
                f"a run of {run.config.model} has no shared and specific codes; use a run of audio2gestures."
            )
        self._skeleton, self._run = run.config.skeleton, run
        self.points: int = config.dct_points
        #: Sampling settings; their edits are applied by :meth:`edit` only.
        self.sampling: Audio2GesturesSampling = run.config.sampling_settings
        plain = replace(self.sampling, edits=(), keep_shared=None, keep_specific=None)
        codec, model = Codec(config, run.config.data()), run.config.build()
        condition = model.condition
        assert condition is not None
        space = run.config.space
        self._context = -(-model.halo // BLOCK) * BLOCK
        self._params, self._summary = jax.device_put(run.params), jax.device_put(run.summary)

        def draw(params, summary, audio, key, controls):
            shared, weights = condition(params, summary, Condition(audio, controls=controls))
            return draw_codes(codec, plain, params, summary, key, shared, jnp.int32(-self._context), weights)

        def encode(params, pose):
            shared, specific = codec.encode_motion(params, pose[None])
            assert specific is not None
            return codec.to_frames(shared.mean), codec.specific_to_frames(specific.mean)

        self._draw, self._encode = jax.jit(draw), jax.jit(encode)
        self._write, self._space = space.from_rotations, space
        self._decode = jax.jit(
            lambda params, s, i: space.rotations(codec.decode(params, s[None], i[None], sampling=plain)[0])
        )

    def from_audio(self, audio: Any, seed: int = 0, sample: int = 0, *, sample_rate: int | None = None) -> Codes:
        """S_A of speech and a drawn I_R: those of ``a2g generate --seed`` for this sample number.

        Args:
            audio: (N,), mono.
            sample_rate: of the audio, Hz, which is resampled to the run's; None for the run's own.
        """
        config, features = self._run.config, speech_features(self._run, audio, sample_rate)
        frames = len(features)
        padded = np.pad(features, ((self._context, self._after(frames)), (0, 0)), constant_values=features.min())
        normalised = np.asarray(config.statistics["audio"].normalise(padded), np.float32)
        key = jax.random.fold_in(jax.random.key(seed), sample)
        controls: Any = None
        if self.sampling.controls:
            rows = control_rows(self._run, self.sampling.controls, frames)
            controls = np.pad(rows, ((self._context, self._after(frames)), (0, 0)), mode="edge")
        shared, specific = self._draw(self._params, self._summary, normalised, key, controls)
        assert specific is not None
        return Codes(shared[0], specific[0], self._context, frames)

    def from_motion(self, motion: Motion) -> Codes:
        """S_M and I_M of a motion of the run's skeleton and frame rate, padded with its first and last pose.

        Raises:
            InputError: another skeleton or frame rate.
        """
        if not motion.skeleton.same_tree(self._skeleton) or motion.fps != self._run.config.fps:
            raise InputError(
                f"the motion has {motion.skeleton.joints} joints at {motion.fps:g} fps, the run"
                f" {self._skeleton.joints} at {self._run.config.fps:g}; retarget and resample it first."
            )
        pose = np.asarray(self._write(jnp.asarray(motion.rotations)))
        around = ((self._context, self._after(len(pose))), (0, 0), (0, 0))
        shared, specific = self._encode(self._params, np.pad(pose, around, mode="edge"))
        return Codes(shared[0], specific[0], self._context, len(pose))

    def to_motion(self, codes: Codes) -> Motion:
        """The decoded motion g(S, I) with the run's dynamics, and a root that plants the feet."""
        stop, space = codes.context + codes.frames, self._run.config.space
        rotations = np.asarray(self._decode(self._params, codes.shared, codes.specific))[codes.context : stop]
        if self._run.dynamics is not None:
            rotations = rotations_from_rows(self._run.finished(space.write(rotations)), space.kind)
        return plant_rotations(self._run, rotations)

    def edit(self, codes: Codes, *edits: str, other: Codes | None = None) -> Codes:
        """Codes with their DCT bands edited; see :mod:`a2g_jax.models.audio2gestures.edits`.

        Args:
            edits: lines, or names of :data:`~a2g_jax.models.audio2gestures.edit_presets.EDIT_PRESETS`.
            other: codes from which ``swap`` and ``sample`` take bands; at least as long.

        Raises:
            InputError: an invalid edit, or one that needs ``other``.
        """
        parsed = [parse_edit(text, self.points) for text in expanded(edits)]
        if other is None and any(edit.action in ("swap", "sample") for edit in parsed):
            raise InputError(f"{', '.join(edits)}: takes bands from another code; give one as 'other'.")
        if other is not None and other.frames < codes.frames:
            raise InputError(f"the other codes are {other.frames} frames long, these {codes.frames}; give longer ones.")

        def changed(name: str) -> Code:
            code: Code = getattr(codes, name)
            chosen = [edit for edit in parsed if edit.code == name]
            return apply_edits(code, chosen, self.points, lambda _edit: getattr(other, name)[: len(code)])

        return replace(codes, shared=changed("shared"), specific=changed("specific"))

    def swap(self, codes: Codes, other: Codes) -> Codes:
        """These shared codes with the other's specific ones.

        Raises:
            InputError: the other is shorter.
        """
        if other.frames < codes.frames:
            raise InputError(f"the other codes are {other.frames} frames long, these {codes.frames}; give longer ones.")
        return replace(codes, specific=other.specific[: len(codes.shared)])

    def _after(self, frames: int) -> int:
        """Frames of context after speech: up to whole windows, so that few lengths are compiled."""
        return -frames % WINDOW + self._context
