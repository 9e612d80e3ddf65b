"""Settings of Audio2Gestures and its presets."""

from dataclasses import dataclass, fields

from a2g_jax.errors import InputError
from a2g_jax.nn.blocks import BLOCK


@dataclass(frozen=True)
class Audio2GesturesConfig:
    """Networks and losses; defaults are the papers' (extended paper, Sec. 5.3; the authors' code where silent)."""

    audio_channels: tuple[int, ...] = (128, 128, 96, 96, 64)
    """Residual blocks of the audio encoder."""
    motion_channels: tuple[int, ...] = (256, 256, 128, 128, 64)
    """Residual blocks of the motion encoder."""
    decoder_channels: tuple[int, ...] = (64, 128, 128, 256, 256)
    """Residual blocks of the decoder."""
    kernel_size: int = 3
    head_channels: int = 32
    """Hidden width of the heads that predict means and log-variances."""
    code_channels: int = 16
    """Width of the shared and of the motion-specific code."""
    dropout: float = 0.0
    backbone: str = "tcn"
    """Layers of both encoders: ``tcn``, ``gru`` or ``transformer`` (Sec. 6.2.4); the decoder is always a TCN."""
    recurrent_layers: int = 5
    """Bidirectional layers of the GRU backbone."""
    recurrent_channels: int = 32
    """Width of a GRU layer, each direction."""
    attention_layers: int = 5
    """Layers of the Transformer backbone."""
    attention_channels: int = 16
    """Width of query, key and value, and of the Transformer's layers."""
    attention_hidden: int = 256
    """Hidden width of the two linear layers after each attention."""
    attention_window: int = 32
    """Frames in the attention window of a Transformer layer, half of them before and half after."""
    split: bool = True
    """Whether there is a motion-specific code; without one all codes are shared (Table 2, baseline)."""
    mapping: bool = True
    """Whether noise with the statistics of I_M goes through the mapping net; otherwise I_R is standard normal noise."""
    latent: str = "time"
    """``time``, or ``dct``: heads take the discrete cosine transform of the encoders' features (Sec. 6.3), and the
    shared code has no variance."""
    dct_points: int = 128
    """Frames of a DCT block; training clips are a multiple of it."""
    normalise_pose: bool = False
    """Whether networks take and predict 6D rotations as z-scores of the training split; the papers use them raw."""

    clip_frames: int = 128
    """Frames in a training crop."""

    rotation_weight: float = 1.0
    position_weight: float = 1.0
    speed_weight: float = 5.0
    alignment_weight: float = 0.1
    alignment_ramp_steps: int = 0
    """Steps over which the alignment weight rises linearly from zero; 0 for none.

    At the initial (Xavier) weights the two shared codes are far apart, and the fastest way to align them is to make
    both constant.
    """
    kl_shared_weight: float = 1e-3
    """Weight of the KL divergence of the shared codes S_A and S_M."""
    kl_specific_weight: float = 1e-3
    """Weight of the KL divergence of the motion-specific codes I_M and I_R."""
    kl_ramp_steps: int = 100_000
    """Steps over which the KL weights rise linearly from zero; 0 for none."""
    relaxed_weight: float = 1.0
    relaxed_threshold: float = 0.002
    """Rho of the relaxed motion loss (Eq. 19), metres: 0.2 cm in the extended paper, 2 cm in the first."""
    sampled_rotation_weight: float = 0.0
    """Weight of the rotation loss on motions with a random specific code; 1 in the authors' code, not in the papers."""
    sampled_speed_weight: float = 0.0
    """Weight of the speed loss on motions with a random specific code; 5 in the authors' code, not in the papers."""
    stft_weight: float = 0.0
    """Weight of the distance of spectra over short windows (Eq. 6), added to the motion reconstruction losses."""
    ssim_weight: float = 0.0
    """Weight of one minus the structural similarity over time (Eq. 7)."""
    lpips_weight: float = 0.0
    """Weight of the perceptual distance (Eq. 14) in the feature network of ``a2g train --features RUN``."""
    bicycle_weight: float = 0.1
    diversity_weight: float = 0.1
    diversity_decay_steps: int = 500_000
    """Steps over which the diversity weight falls linearly to zero; 0 for no decay."""

    def __post_init__(self) -> None:
        for name in ("audio_channels", "motion_channels", "decoder_channels"):
            channels = getattr(self, name)
            if not channels or min(channels) < 1:
                raise InputError(f"--{name.replace('_', '-')}: expected numbers above 0 such as 64,64; got {channels}.")
        if self.kernel_size < 1 or self.kernel_size % 2 == 0:
            raise InputError(f"--kernel-size: expected an odd number; got {self.kernel_size}.")
        for name in (
            "head_channels",
            "code_channels",
            "recurrent_layers",
            "recurrent_channels",
            "attention_layers",
            "attention_channels",
            "attention_hidden",
            "dct_points",
        ):
            if getattr(self, name) < 1:
                raise InputError(f"--{name.replace('_', '-')}: expected 1 or more; got {getattr(self, name)}.")
        if self.clip_frames < 2:
            raise InputError(f"--clip-frames: expected 2 or more, for speeds; got {self.clip_frames}.")
        if self.attention_window < 2 or self.attention_window % 2:
            raise InputError(f"--attention-window: expected an even number above 0; got {self.attention_window}.")
        for name, choices in (("backbone", ("tcn", "gru", "transformer")), ("latent", ("time", "dct"))):
            if getattr(self, name) not in choices:
                raise InputError(f"--{name}: expected one of {', '.join(choices)}; got {getattr(self, name)!r}.")
        if self.latent == "dct" and self.clip_frames % self.dct_points:
            raise InputError(
                f"--clip-frames: expected a multiple of --dct-points {self.dct_points}; got {self.clip_frames}."
            )
        if self.latent == "dct" and not self.split:
            raise InputError("--latent dct: needs --split true; the baseline has no DCT variant.")
        if self.latent == "dct" and BLOCK % self.dct_points:
            raise InputError(f"--dct-points: expected a divisor of {BLOCK}; got {self.dct_points}.")
        if not 0 <= self.dropout < 1:
            raise InputError(f"--dropout: expected 0 or more and below 1; got {self.dropout}.")
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith(("_weight", "_steps", "_threshold", "_frames")) and not (0 <= value < float("inf")):
                raise InputError(f"--{field.name.replace('_', '-')}: expected 0 or more; got {value}.")


PRESETS: dict[str, Audio2GesturesConfig] = {
    "paper": Audio2GesturesConfig(),
    "tiny": Audio2GesturesConfig(
        audio_channels=(64, 64, 64, 64, 64),
        motion_channels=(64, 64, 64, 64, 64),
        decoder_channels=(64, 64, 64, 96, 96),
        normalise_pose=True,
        # In metres the motion losses are hundredths. At the papers' weights the alignment and KL losses
        # collapse the shared code within the first hundreds of steps; a narrow specific code, and the losses on sampled
        # motions from the authors' code, make the decoder use it.
        kl_shared_weight=1e-6,
        kl_specific_weight=2e-4,
        kl_ramp_steps=1_000,
        alignment_weight=0.01,
        alignment_ramp_steps=1_000,
        sampled_rotation_weight=1.0,
        sampled_speed_weight=10.0,
        bicycle_weight=0.02,
        diversity_weight=0.02,
        diversity_decay_steps=0,
    ),
}
