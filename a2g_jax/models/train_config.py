"""Settings of a training run, the same for every model."""

from dataclasses import dataclass

from a2g_jax.errors import InputError


@dataclass(frozen=True)
class TrainConfig:
    """How a model is trained; the defaults are Audio2Gestures' (extended paper, Sec. 5.3.3)."""

    steps: int = 180_000
    """Training steps, those done before a resume included; a model may add stages with their own number of steps."""
    stage_steps: tuple[int, ...] = ()
    """Steps of each stage, in place of those of the settings; written by ``--resume --steps`` with more steps, which
    extends the last stage."""
    batch_size: int = 32
    """Clips in a batch."""
    learning_rate: float = 1e-4
    """Learning rate of Adam; its peak if a schedule changes it."""
    schedule: str = "constant"
    """'constant'; 'cosine': half a cosine down to a hundredth of the peak at the last step; or 'noam': decay with
    the inverse root of the step, to a tenth of the peak."""
    warmup_steps: int = 0
    """Steps over which the learning rate rises linearly from zero."""
    clip_norm: float = 0.0
    """Gradients longer than this are scaled down to it; 0 for no clipping."""
    clip_value: float = 0.0
    """Entries of gradients beyond this are cut to it, before ``clip_norm``; 0 for no clipping."""
    augmentation: float = 0.0
    """Strength of the random gain, equaliser and noise on audio features; 0 for none, 1 for strong."""
    mirror: float = 0.0
    """Share of the clips of a step whose left and right are exchanged; needs poses of rotations."""
    seed: int = 0
    """Seed of initial weights, batches and all random draws of training."""
    checkpoint_every: int = 1_000
    """Steps between checkpoints."""
    validate_every: int = 1_000
    """Steps between validation losses."""
    log_every: int = 20
    """Steps between lines of metrics.jsonl and checks for NaN."""
    keep_checkpoints: int = 2
    """Number of latest checkpoints that are kept."""
    device_megabytes: float = 2_000.0
    """Corpora up to this size are kept on the device; larger ones are read from disk batch by batch."""
    part_steps: int = 500
    """Steps on one part of a corpus prepared with --on-demand before the next part; other corpora are one part."""
    patience: int = 0
    """Validations without a better loss after which the last stage ends; its weights of the best loss are kept. 0 to
    train to the end and keep the last weights."""
    frozen: tuple[str, ...] = ()
    """Networks that are not trained, such as audio_encoder."""
    precision: str = "float32"
    """'float32', or 'bf16': products and convolutions of the networks take bfloat16 and add up in float32, in which
    parameters, optimisers and losses stay; for GPUs: on a CPU operands are rounded alike, and nothing is faster."""
    tensorboard: bool = False
    """Also write TensorBoard event files (needs the 'tensorboard' extra)."""

    def __post_init__(self) -> None:
        counts = (
            "steps",
            "batch_size",
            "checkpoint_every",
            "validate_every",
            "log_every",
            "keep_checkpoints",
            "part_steps",
        )
        for name in counts:
            if getattr(self, name) < 1:
                raise InputError(f"--{name.replace('_', '-')}: expected 1 or more; got {getattr(self, name)}.")
        if any(steps < 0 for steps in self.stage_steps):
            raise InputError(f"--stage-steps: expected 0 or more for each stage; got {self.stage_steps}.")
        for name in ("warmup_steps", "patience", "clip_norm", "clip_value", "augmentation", "device_megabytes"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"--{name.replace('_', '-')}: expected 0 or more; got {getattr(self, name)}.")
        if not 0 <= self.mirror <= 1:
            raise InputError(f"--mirror: expected a share from 0 to 1; got {self.mirror}.")
        if not 0 < self.learning_rate < float("inf"):
            raise InputError(f"--learning-rate: expected a number above 0; got {self.learning_rate}.")
        if self.schedule not in ("constant", "cosine", "noam"):
            raise InputError(f"--schedule: expected 'constant', 'cosine' or 'noam'; got {self.schedule!r}.")
        if self.precision not in ("float32", "bf16"):
            raise InputError(f"--precision: expected 'float32' or 'bf16'; got {self.precision!r}.")
        if not 0 <= self.seed < 2**31:
            raise InputError(f"--seed: expected a whole number from 0 to 2147483647; got {self.seed}.")


TRAIN_PRESETS: dict[str, TrainConfig] = {
    "paper": TrainConfig(),
    "tiny": TrainConfig(
        steps=3_000,
        batch_size=8,
        learning_rate=1e-3,
        schedule="cosine",
        warmup_steps=300,
        clip_norm=1.0,
        augmentation=1.0,
        checkpoint_every=500,
        validate_every=500,
    ),
}
