"""Settings of Speech2Gesture and its presets."""

from dataclasses import dataclass, fields

from a2g_jax.errors import InputError

#: Convolutions of the audio encoder: every second of the first six halves the bands, the last one takes all
#: bands that remain.
AUDIO_LAYERS = 8


@dataclass(frozen=True)
class Speech2GestureConfig:
    """Networks and losses; the defaults are those of Ginosar et al. (2019), from their code where the paper is silent.

    The motion losses of poses with rotations are those of Audio2Gestures, whose comparison trains Speech2Gesture with
    "the same losses as our method" (extended paper, Sec. 5.4).
    """

    audio_channels: tuple[int, ...] = (64, 64, 128, 128, 256, 256, 256, 256)
    """Channels of the eight layers of the audio encoder."""
    channels: int = 256
    """Channels of every layer of the U-Net."""
    depth: int = 5
    """Halvings of time in the U-Net; it has ``2 + 2 * depth + decoder_layers`` layers, 16 in the paper."""
    decoder_layers: int = 4
    """Layers of the U-Net after time is back at its full rate."""
    normalise: bool = True
    """Whether a layer normalisation follows each convolution, in place of the authors' batch normalisation."""
    discriminator_channels: tuple[int, ...] = (64, 128, 256)
    """Channels of the discriminator's layers before its output; all but the last halve time."""
    clip_frames: int = 128
    """Frames in a training crop: 128 in 3D, 64 in 2D (at 15 fps)."""

    rotation_weight: float = 1.0
    """Weight of the angle between rotations, where poses are rotations."""
    position_weight: float = 1.0
    """Weight of the L1 distance of joint positions, where poses are rotations."""
    speed_weight: float = 5.0
    """Weight of the L1 distance of joint velocities, where poses are rotations."""
    value_weight: float = 1.0
    """Weight of the L1 distance of z-scores, where poses are keypoints or directions."""
    value_speed_weight: float = 0.0
    """Weight of the L1 distance of differences between frames' z-scores; the authors leave it out."""
    adversarial_weight: float = 1.0
    """Weight of the translation network's adversarial loss; 0 trains without a discriminator ("S2G w/o GAN")."""

    def __post_init__(self) -> None:
        if len(self.audio_channels) != AUDIO_LAYERS or min(self.audio_channels) < 1:
            raise InputError(f"--audio-channels: expected {AUDIO_LAYERS} numbers above 0; got {self.audio_channels}.")
        if not self.discriminator_channels or min(self.discriminator_channels) < 1:
            raise InputError(
                f"--discriminator-channels: expected numbers above 0 such as 64,128; got {self.discriminator_channels}."
            )
        if self.channels < 1:
            raise InputError(f"--channels: expected 1 or more; got {self.channels}.")
        if not 1 <= self.depth <= 7:
            # Windows of generation start at multiples of 128 frames.
            raise InputError(f"--depth: expected a number from 1 to 7; got {self.depth}.")
        if self.decoder_layers < 0:
            raise InputError(f"--decoder-layers: expected 0 or more; got {self.decoder_layers}.")
        if self.clip_frames < 2:
            raise InputError(f"--clip-frames: expected 2 or more, for speeds; got {self.clip_frames}.")
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("_weight") and not 0 <= value < float("inf"):
                raise InputError(f"--{field.name.replace('_', '-')}: expected 0 or more; got {value}.")

    @property
    def stride(self) -> int:
        """Frames that become one at the bottom of the U-Net."""
        return 2**self.depth


PRESETS: dict[str, Speech2GestureConfig] = {
    "paper": Speech2GestureConfig(),
    "tiny": Speech2GestureConfig(
        audio_channels=(8, 8, 16, 16, 32, 32, 64, 64), channels=64, discriminator_channels=(16, 32, 64)
    ),
}
