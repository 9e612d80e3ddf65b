"""The four networks of Audio2Gestures with the pose space around them: poses, codes and positions."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from flax import linen as nn
from jaxtyping import Array, Float, Key

from a2g_jax.features.dct import block_idct
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.networks import AudioEncoder, Decoder, Gaussian, MappingNet, MotionEncoder
from a2g_jax.models.audio2gestures.reductions import Reductions, make_reductions
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.base import Data, Params
from a2g_jax.nn.rates import adaptively_smoothed, interpolated, smoothed

#: Standard deviation of the authors' initial weights.
_NORMAL_STD = 0.01


@dataclass(frozen=True, eq=False)
class Codec:
    """The four networks with the pose space around them.

    Codes are in time, or with the DCT latent space in the bands of consecutive blocks; decoding takes them in time:
    see :meth:`to_frames` and :meth:`specific_to_frames`.
    """

    config: Audio2GesturesConfig
    data: Data

    @property
    def width(self) -> int:
        """Number of values of a pose."""
        rows, values = self.data.pose_statistics.mean.shape
        return rows * values

    @property
    def modules(self) -> tuple[AudioEncoder, MotionEncoder, Decoder, MappingNet]:
        c = self.config
        return AudioEncoder(c), MotionEncoder(c), Decoder(c, self.width), MappingNet(c)

    def init(self, key: Key[Array, ""]) -> Params:
        """Parameters of all networks, for clips of any length."""
        audio, motion, decoder, mapping = self.modules
        keys = jax.random.split(key, 4)
        frames = self.config.dct_points if self.config.latent == "dct" else 8 * self.config.specific_frames
        sound, pose = jnp.zeros((1, frames, self.data.audio_bands)), jnp.zeros((1, frames, self.width))
        code = jnp.zeros((1, frames, self.config.code_channels))
        params = {
            "audio_encoder": audio.init(keys[0], sound)["params"],
            "motion_encoder": motion.init(keys[1], pose)["params"],
            "decoder": decoder.init(keys[2], code, code if self.config.split else None)["params"],
        }
        if self.config.split and self.config.mapping and not self.config.stored_codes:
            params["mapping_net"] = mapping.init(keys[3], code)["params"]
        return _redrawn(key, params) if self.config.initialisation == "normal" else params

    def encode_audio(
        self, params: Params, audio: Float[Array, "B T bands"], dropout_key: Key[Array, ""] | None = None
    ) -> Gaussian:
        """The shared code of audio, S_A."""
        code: Gaussian = self._by_clip(
            lambda clips: _apply(self.modules[0], params["audio_encoder"], dropout_key, clips), audio
        )
        return code

    def encode_motion(
        self, params: Params, pose: Float[Array, "B T R D"], dropout_key: Key[Array, ""] | None = None
    ) -> tuple[Gaussian, Gaussian | None]:
        """The shared and the motion-specific code of motion, S_M and I_M; the latter is None without a split."""
        values = self.data.pose_statistics.normalise(pose) if self.normalises else pose
        codes: tuple[Gaussian, Gaussian | None] = self._by_clip(
            lambda clips: _apply(self.modules[1], params["motion_encoder"], dropout_key, clips),
            values.reshape(*pose.shape[:2], -1),
        )
        return codes

    def decode(
        self,
        params: Params,
        shared: Float[Array, "B T C"],
        specific: Float[Array, "B T C"] | None,
        dropout_key: Key[Array, ""] | None = None,
        sampling: Audio2GesturesSampling | None = None,
    ) -> Float[Array, "B T R D"]:
        """Poses of a full code in time: 6D vectors before Gram-Schmidt, or the values of another kind of pose.

        Exponential maps are not wrapped: those of a corpus are at most pi long, and no joint turns that far in speech.

        Args:
            sampling: settings of generation, which may smooth otherwise than training does.
        """
        flat = _apply(self.modules[2], params["decoder"], dropout_key, shared, specific)
        flat = self._smoothed(flat, sampling)
        pose = flat.reshape(*flat.shape[:2], *self.data.pose_statistics.mean.shape)
        return self.data.pose_statistics.denormalise(pose) if self.normalises else pose

    def _smoothed(self, flat: Float[Array, "B T C"], sampling: Audio2GesturesSampling | None) -> Float[Array, "B T C"]:
        """Output of the decoder smoothed as in training, or by the settings of generation."""
        if sampling is None or sampling.rest_smoothing == 0:
            return smoothed(flat, self.config.smoothing)
        speed = sampling.rest_speed / self.data.fps
        unit = 1.0 if self.normalises else np.asarray(self.data.pose_statistics.std, np.float32).reshape(-1)
        return adaptively_smoothed(flat, sampling.rest_smoothing, speed * unit)

    def map_noise(self, params: Params, noise: Float[Array, "B T C"]) -> Gaussian:
        """The random specific code I_R, mapped from noise in time."""
        mapping: Any = self.modules[3].apply({"params": params["mapping_net"]}, noise)
        return mapping

    def to_frames(self, code: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
        """A shared code in time, as the decoder takes it; also a specific one without steps of several frames."""
        return block_idct(code, self.config.dct_points) if self.config.latent == "dct" else code

    def specific_to_frames(self, steps: Float[Array, "B N C"]) -> Float[Array, "B T C"]:
        """A motion-specific code in time: its steps interpolated linearly, or its bands transformed back."""
        return self.to_frames(interpolated(steps, self.config.specific_frames))

    @cached_property
    def reductions(self) -> Reductions:
        """How distances of motions and codes become losses."""
        c = self.config
        return make_reductions(c.reductions, self.data.space, c.relaxed_threshold, c.free_nats)

    @property
    def normalises(self) -> bool:
        """Whether networks take z-scores: if the settings say so, and always for poses that are not of unit scale."""
        return self.config.normalise_pose or not self.data.space.unit_scale

    def positions(
        self, pose: Float[Array, "B T R D"]
    ) -> tuple[Float[Array, "B T R 3 3"] | None, Float[Array, "B T R _"]]:
        """Rotations, and joint positions in metres with the root at the origin.

        For poses without rotations (2D keypoints, bone directions): None, and the values as z-scores, which have no
        unit and are of order 1 for any camera and speaker.
        """
        rotations = self.data.space.rotations(pose)
        if rotations is None:
            return None, self.data.pose_statistics.normalise(pose)
        return rotations, self.data.space.joint_positions(rotations)

    def valid(
        self, pose: Float[Array, "B T R D"], rotations: Float[Array, "B T R 3 3"] | None
    ) -> Float[Array, "B T R D"]:
        """The pose written from its rotations, in place of the raw output; the pose itself without rotations."""
        return pose if rotations is None else self.data.space.valid(pose, rotations)

    def _by_clip(self, encode: Callable[[Array], Any], x: Float[Array, "B T C"]) -> Any:
        """Codes of clips; for the DCT latent space each block is encoded on its own, as in training (Sec. 6.3)."""
        points, (clips, frames) = self.config.dct_points, x.shape[:2]
        if self.config.latent != "dct" or frames == points:
            return encode(x)
        if frames % points:
            raise ValueError(f"expected a multiple of {points} frames, the length of a DCT block; got {frames}")
        codes = encode(x.reshape(clips * frames // points, points, x.shape[-1]))
        return jax.tree.map(lambda code: code.reshape(clips, frames, -1), codes)


def _redrawn(key: Key[Array, ""], params: Params) -> Params:
    """Parameters with every weight drawn from a normal distribution of standard deviation 0.01; biases stay."""
    leaves, tree = jax.tree.flatten(params)
    keys = jax.random.split(key, len(leaves))
    drawn = [
        _NORMAL_STD * jax.random.normal(one, leaf.shape, leaf.dtype) if leaf.ndim > 1 else leaf
        for one, leaf in zip(keys, leaves, strict=True)
    ]
    return jax.tree.unflatten(tree, drawn)


def _apply(module: nn.Module, params: Params, dropout_key: Key[Array, ""] | None, *inputs: Array | None) -> Any:
    """Output of a network; with dropout only if a key is given."""
    rngs = None if dropout_key is None else {"dropout": dropout_key}
    return module.apply({"params": params}, *inputs, deterministic=dropout_key is None, rngs=rngs)
