"""Settings of the motion autoencoder."""

from dataclasses import dataclass

from a2g_jax.errors import InputError


@dataclass(frozen=True)
class MotionAutoencoderConfig:
    """Networks and losses; five residual blocks span 125 frames, as in the extended Audio2Gestures paper (Sec. 4.1.3).

    The paper gives the width of the fourth block's features (128) and nothing more; the other widths are ours.
    """

    encoder_channels: tuple[int, ...] = (128, 128, 128, 128, 64)
    """Residual blocks of the encoder; the last one is the bottleneck."""
    decoder_channels: tuple[int, ...] = (64, 128, 128, 128, 128)
    """Residual blocks of the decoder."""
    kernel_size: int = 3
    clip_frames: int = 128
    """Frames in a training crop, and in an evaluated clip."""
    rotation_weight: float = 1.0
    position_weight: float = 1.0
    speed_weight: float = 5.0
    value_weight: float = 1.0
    """Weight of the L1 distance of normalised values, where poses are not rotations."""
    noise: float = 0.0
    """Standard deviation of noise on the normalised input, which is not part of the target; 0 for none."""

    def __post_init__(self) -> None:
        for name in ("encoder_channels", "decoder_channels"):
            channels = getattr(self, name)
            if not channels or min(channels) < 1:
                raise InputError(f"--{name.replace('_', '-')}: expected numbers above 0 such as 64,64; got {channels}.")
        if len(self.encoder_channels) < 4:
            raise InputError("--encoder-channels: expected four blocks or more; the fourth gives the features.")
        if self.kernel_size < 1 or self.kernel_size % 2 == 0:
            raise InputError(f"--kernel-size: expected an odd number; got {self.kernel_size}.")
        if self.clip_frames < 2:
            raise InputError(f"--clip-frames: expected 2 or more, for speeds; got {self.clip_frames}.")
        for name in ("rotation_weight", "position_weight", "speed_weight", "value_weight", "noise"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"--{name.replace('_', '-')}: expected 0 or more; got {getattr(self, name)}.")


PRESETS: dict[str, MotionAutoencoderConfig] = {
    "paper": MotionAutoencoderConfig(),
    # The fourth block keeps the paper's 128 features.
    "tiny": MotionAutoencoderConfig(encoder_channels=(64, 64, 64, 128, 32), decoder_channels=(32, 64, 64, 64, 64)),
}
