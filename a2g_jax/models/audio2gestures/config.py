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
    smoothing: int = 0
    """Binomial filters over time at the decoder's end, trained with it; none in the papers. Motion has no energy at the
    frame rate, but a decoder of frame-wise codes has jitter there."""
    initialisation: str = "xavier"
    """Initial weights: ``xavier`` (uniform, as in the papers), or ``normal`` with a standard deviation of 0.01 (the
    authors' code)."""
    initial_log_variance: float = 0.0
    """Log-variance of all codes at initialisation, about: the initial bias of the heads. At 0 the noise is two to ten
    times as large as the codes, the decoder learns to ignore both, and their encoders receive no gradient."""
    specific_frames: int = 1
    """Frames for one step of the motion-specific code; 1 in the papers. A code at the rate of the motion also carries
    the times of the strokes, which belong to the shared code; a divisor of 128."""
    specific_jitter: int = 0
    """Largest shift in time, frames, of the motion-specific code against the shared one in training, drawn for every
    clip, so that the times of strokes are to be found in the shared code alone; 0 in the papers."""
    stored_codes: bool = False
    """Whether I_R is a training clip's encoded code, stored with the weights, in place of the mapping net's output.

    The mapping net has the mean and standard deviation of one clip's code, and no other property of it: samples lack
    the variety of encoded codes (extended paper, Sec. 6.2.1). In training, that of another clip of the batch is taken.
    """
    adversarial_steps: int = 0
    """Training steps of a second stage, in which the decoder is trained against a discriminator; none in the papers."""
    discriminator_channels: tuple[int, ...] = (64, 96, 128, 128)
    """Convolutions of the discriminator, each at half the rate of the one before."""
    adversarial_weight: float = 0.2
    """Weight of the adversarial loss in that stage, of encoded and of drawn codes."""
    matching_weight: float = 0.4
    """Weight of the distance of the discriminator's features between the motion of encoded codes and the truth."""

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
    kl_restarts: bool = False
    """Whether the KL weights fall back and rise again after every ramp, as in the authors' code."""
    free_nats: float = 0.0
    """KL divergence of a channel below which it has no gradient (free bits), nats for each step of the code."""
    spread_weight: float = 0.0
    """Weight of the hinge on the standard deviation of the shared codes (VICReg's variance term): aligned codes are
    otherwise aligned fastest by making both constant."""
    reductions: str = "paper"
    """``paper``: distances summed over x, y, z and averaged over the joints; KL averaged over frames, summed over
    channels. ``authors``: their code's, see :mod:`a2g_jax.models.audio2gestures.reductions`."""
    relative_losses: bool = False
    """Whether rotation, position and speed losses are divided by those of the batch's mean pose, so that the weights
    fit every pose representation and frame rate: 1 is a motion that stands still."""
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
    sampled_stft_weight: float = 0.0
    """Weight of the distance of spectra between motions with a random specific code and the truth."""
    bicycle_weight: float = 0.1
    bicycle_shared_weight: float = 0.0
    """Weight of the L1 distance between the shared code and the one encoded from a motion with a random specific code;
    0.1 in the authors' code (``cyc_share``), not in the papers."""
    diversity_weight: float = 0.1
    diversity_reference: str = "sample"
    """The motion from which a sampled one is to differ: another ``sample`` (the papers' Eq. 21 as its text describes
    it), or the audio's ``transfer`` g(S_A, I_M), as in the authors' code."""
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
            "specific_frames",
        ):
            if getattr(self, name) < 1:
                raise InputError(f"--{name.replace('_', '-')}: expected 1 or more; got {getattr(self, name)}.")
        if self.clip_frames < 2:
            raise InputError(f"--clip-frames: expected 2 or more, for speeds; got {self.clip_frames}.")
        if self.attention_window < 2 or self.attention_window % 2:
            raise InputError(f"--attention-window: expected an even number above 0; got {self.attention_window}.")
        for name, choices in _CHOICES.items():
            if getattr(self, name) not in choices:
                flag = name.replace("_", "-")
                raise InputError(f"--{flag}: expected one of {', '.join(choices)}; got {getattr(self, name)!r}.")
        self._check_specific()
        if self.latent == "dct" and self.clip_frames % self.dct_points:
            raise InputError(
                f"--clip-frames: expected a multiple of --dct-points {self.dct_points}; got {self.clip_frames}."
            )
        if self.latent == "dct" and not self.split:
            raise InputError("--latent dct: needs --split true; the baseline has no DCT variant.")
        if self.latent == "dct" and BLOCK % self.dct_points:
            raise InputError(f"--dct-points: expected a divisor of {BLOCK}; got {self.dct_points}.")
        for name in ("smoothing", "specific_jitter"):
            if getattr(self, name) < 0:
                raise InputError(f"--{name.replace('_', '-')}: expected 0 or more; got {getattr(self, name)}.")
        if not 0 <= self.dropout < 1:
            raise InputError(f"--dropout: expected 0 or more and below 1; got {self.dropout}.")
        for field in fields(self):
            value = getattr(self, field.name)
            bounded = field.name.endswith(("_weight", "_steps", "_threshold", "_frames", "_nats"))
            if bounded and not 0 <= value < float("inf"):
                raise InputError(f"--{field.name.replace('_', '-')}: expected 0 or more; got {value}.")

    def _check_specific(self) -> None:
        """Refuse a motion-specific code that does not fit the blocks of generation, the clips or the latent space."""
        if BLOCK % self.specific_frames:
            raise InputError(f"--specific-frames: expected a divisor of {BLOCK}; got {self.specific_frames}.")
        if self.clip_frames % self.specific_frames:
            raise InputError(
                f"--clip-frames: expected a multiple of --specific-frames {self.specific_frames};"
                f" got {self.clip_frames}."
            )
        if self.latent == "dct" and self.specific_frames > 1:
            raise InputError("--latent dct: has bands in place of steps; it needs --specific-frames 1.")
        if self.latent == "dct" and self.adversarial_steps:
            raise InputError("--latent dct: has no adversarial stage; it needs --adversarial-steps 0.")
        for name in ("stored_codes", "adversarial_steps"):
            if getattr(self, name) and not self.split:
                flag = name.replace("_", "-")
                raise InputError(f"--{flag}: needs --split true; without a split there is no specific code to draw.")


_CHOICES = {
    "backbone": ("tcn", "gru", "transformer"),
    "latent": ("time", "dct"),
    "initialisation": ("xavier", "normal"),
    "reductions": ("paper", "authors"),
    "diversity_reference": ("sample", "transfer"),
}

PRESETS: dict[str, Audio2GesturesConfig] = {
    "paper": Audio2GesturesConfig(),
    "authors": Audio2GesturesConfig(
        initialisation="normal",
        clip_frames=64,
        speed_weight=1.0,
        kl_restarts=True,
        reductions="authors",
        relaxed_threshold=0.02,
        sampled_rotation_weight=1.0,
        sampled_speed_weight=5.0,
        bicycle_shared_weight=0.1,
        diversity_reference="transfer",
    ),
    "tiny": Audio2GesturesConfig(
        audio_channels=(64, 64, 64, 64, 64),
        motion_channels=(64, 64, 64, 64, 64),
        decoder_channels=(64, 64, 64, 96, 96),
        normalise_pose=True,
        initial_log_variance=-5.0,
        specific_frames=16,
        stored_codes=True,
        specific_jitter=8,
        smoothing=2,
        code_channels=32,
        adversarial_steps=1_500,
        clip_frames=256,
        relative_losses=True,
        speed_weight=2.0,
        alignment_weight=0.5,
        spread_weight=1.0,
        kl_shared_weight=1e-4,
        kl_specific_weight=5e-4,
        kl_ramp_steps=500,
        relaxed_weight=0.0,
        bicycle_weight=0.0,
        diversity_weight=0.0,
        diversity_decay_steps=0,
    ),
}
