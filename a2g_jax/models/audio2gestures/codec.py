"""Between poses, codes and positions: the four networks with the pose representation and the body around them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from flax import linen as nn
from jaxtyping import Array, Float, Key

from a2g_jax.features.dct import block_idct
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.networks import AudioEncoder, Decoder, Gaussian, MappingNet, MotionEncoder
from a2g_jax.models.base import Data, Params


@dataclass(frozen=True, eq=False)
class Codec:
    """The four networks with the pose space around them.

    Codes are in time, or in the DCT bands of consecutive blocks where the latent space is that of the DCT; decoding
    takes them in time: :meth:`to_time`.
    """

    config: Audio2GesturesConfig
    data: Data

    @property
    def width(self) -> int:
        """Values of a pose."""
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
        frames = self.config.dct_points if self.config.latent == "dct" else 8
        sound, pose = jnp.zeros((1, frames, self.data.audio_bands)), jnp.zeros((1, frames, self.width))
        code = jnp.zeros((1, frames, self.config.code_channels))
        params = {
            "audio_encoder": audio.init(keys[0], sound)["params"],
            "motion_encoder": motion.init(keys[1], pose)["params"],
            "decoder": decoder.init(keys[2], code, code if self.config.split else None)["params"],
        }
        if self.config.split and self.config.mapping:
            params["mapping_net"] = mapping.init(keys[3], code)["params"]
        return params

    def encode_audio(self, params: Params, audio: Float[Array, "B T bands"], dropout_key=None) -> Gaussian:
        """S_A."""
        code: Gaussian = self._by_clip(
            lambda clips: _apply(self.modules[0], params["audio_encoder"], dropout_key, clips), audio
        )
        return code

    def encode_motion(
        self, params: Params, pose: Float[Array, "B T R D"], dropout_key=None
    ) -> tuple[Gaussian, Gaussian | None]:
        """S_M and I_M; the latter is None where the code is not split."""
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
        dropout_key=None,
    ) -> Float[Array, "B T R D"]:
        """Motion of a full code in time: 6D vectors that Gram-Schmidt makes rotations, or values as they are.

        Exponential maps are not wrapped: those of a corpus are at most pi long, and speech turns no joint so far.
        """
        flat = _apply(self.modules[2], params["decoder"], dropout_key, shared, specific)
        pose = flat.reshape(*flat.shape[:2], *self.data.pose_statistics.mean.shape)
        return self.data.pose_statistics.denormalise(pose) if self.normalises else pose

    def map_noise(self, params: Params, noise: Float[Array, "B T C"]) -> Gaussian:
        """I_R, from noise in time."""
        mapping: Any = self.modules[3].apply({"params": params["mapping_net"]}, noise)
        return mapping

    def to_time(self, code: Float[Array, "B T C"]) -> Float[Array, "B T C"]:
        """A code as the decoder takes it."""
        return block_idct(code, self.config.dct_points) if self.config.latent == "dct" else code

    @property
    def normalises(self) -> bool:
        """Whether networks take z-scores: by the settings, and always where poses are not of unit scale."""
        return self.config.normalise_pose or not self.data.space.unit_scale

    def positions(
        self, pose: Float[Array, "B T R D"]
    ) -> tuple[Float[Array, "B T R 3 3"] | None, Float[Array, "B T R _"]]:
        """Rotations, and joint positions in metres with the root at the origin.

        Where poses are no rotations (2D keypoints, bone directions): None, and the values as z-scores, which have no
        unit and are near 1 whatever the camera or the speaker.
        """
        rotations = self.data.space.rotations(pose)
        if rotations is None:
            return None, self.data.pose_statistics.normalise(pose)
        return rotations, self.data.space.joint_positions(rotations)

    def valid(
        self, pose: Float[Array, "B T R D"], rotations: Float[Array, "B T R 3 3"] | None
    ) -> Float[Array, "B T R D"]:
        """The pose that the rotations stand for, instead of the raw output; values without rotations as they are."""
        return pose if rotations is None else self.data.space.valid(pose, rotations)

    def _by_clip(self, encode: Callable[[Array], Any], x: Float[Array, "B T C"]) -> Any:
        """The codes of each block encoded on its own, as in training, where blocks are transformed (Sec. 6.3)."""
        points, (clips, frames) = self.config.dct_points, x.shape[:2]
        if self.config.latent != "dct" or frames == points:
            return encode(x)
        if frames % points:
            raise ValueError(f"expected a multiple of {points} frames, which the DCT takes together; got {frames}")
        codes = encode(x.reshape(clips * frames // points, points, x.shape[-1]))
        return jax.tree.map(lambda code: code.reshape(clips, frames, -1), codes)


def _apply(module: nn.Module, params: Params, dropout_key: Key[Array, ""] | None, *inputs: Array | None) -> Any:
    """A network's output; dropout acts only when given a key."""
    rngs = None if dropout_key is None else {"dropout": dropout_key}
    return module.apply({"params": params}, *inputs, deterministic=dropout_key is None, rngs=rngs)
