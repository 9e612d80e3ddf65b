"""Settings of the stylized flow and its presets."""

from dataclasses import dataclass, fields, replace

from a2g_jax.errors import InputError
from a2g_jax.models.train_config import TrainConfig

#: Style controls that :mod:`a2g_jax.models.stylized_flow.controls` measures.
STYLE_CONTROLS = ("height", "left_height", "right_height", "speed", "radius")


@dataclass(frozen=True)
class StylizedFlowConfig:
    """Flow, global encoder and losses; the defaults are those of the paper on Trinity (Sec. 4)."""

    flow_steps: int = 16
    """Steps of actnorm, invertible convolution and coupling."""
    hidden: int = 800
    """Width of the recurrent layers in every coupling."""
    layers: int = 2
    """Recurrent layers in every coupling."""
    cell: str = "gru"
    """``gru`` (stylized flow) or ``lstm`` (MoGlow)."""
    exact_identity: bool = False
    """Whether couplings are the identity at first, as the paper says; the authors' scale by s(2) = 0.88."""
    history_frames: int = 5
    """Poses before a frame in its conditioning; its audio reaches as far back."""
    lookahead_frames: int = 20
    """Frames of audio after its own in the conditioning of a frame."""
    frame_dropout: float = 0.4
    """Share of the conditioning poses that are masked in training, so that the audio matters."""
    input_noise: float = 0.02
    """Standard deviation of the noise on poses whose likelihood is computed, in z-scores; 0 for none.

    Channels that hardly move, or that follow from others as the six numbers of a rotation do, have an unbounded
    density: the likelihood and its gradient grow by fitting only them. The noise bounds it; the papers mention none.
    """
    predictor: bool = False
    """Whether the first layer subtracts a linear extrapolation of each channel and whitens the residual, fitted to the
    first batch: see :mod:`a2g_jax.nn.flow.predictor`. The published flows have none; without it a small flow of smooth
    motion stays far behind a linear one for thousands of steps. ``frame_dropout`` masks none of its poses.
    """
    freedom: float = 50.0
    """Degrees of freedom of the Student-t prior; 0 for a normal one (MoGlow)."""
    global_channels: int = 32
    """Width of the global feature; 0 for no global encoder."""
    encoder_channels: int = 256
    """Channels of the convolutions of the global encoder."""
    encoder_blocks: int = 5
    """Residual blocks of each of the global encoder's two networks."""
    embedding_channels: int = 64
    """Width of the embedding of each of the global encoder's two networks."""
    reverse_share: float = 0.2
    """Share of the batches that also take the reverse pass; every fifth in the authors' code."""
    reconstruction_weight: float = 1.0
    """Weight of the L1 distance of poses generated in the reverse pass; 0 for none."""
    perceptual_weight: float = 0.0
    """Weight of the gesture perceptual loss (Eq. 8), 0.1 in the paper; needs ``a2g train --features RUN``."""
    style_controls: tuple[str, ...] = ()
    """Conditioning on the motion of the hands: any of height, left_height, right_height, speed and radius.

    Averages of the clip's own poses over four seconds, never masked. The likelihood is then that of poses given their
    averages, and cannot be compared with that of a model without them.
    """
    clip_frames: int = 120
    """Frames in a training clip; the first ``history_frames`` and the last ``lookahead_frames`` are conditioning
    only."""

    def __post_init__(self) -> None:
        for name in (
            *("flow_steps", "hidden", "layers", "history_frames", "encoder_channels"),
            *("encoder_blocks", "embedding_channels"),
        ):
            if getattr(self, name) < 1:
                raise InputError(f"--{name.replace('_', '-')}: expected 1 or more; got {getattr(self, name)}.")
        for name in ("lookahead_frames", "global_channels"):
            if getattr(self, name) < 0:
                raise InputError(f"--{name.replace('_', '-')}: expected 0 or more; got {getattr(self, name)}.")
        for name in self.style_controls:
            if name not in STYLE_CONTROLS or self.style_controls.count(name) > 1:
                raise InputError(
                    f"--style-controls: expected any of {', '.join(STYLE_CONTROLS)}, each once; got {name!r}."
                )
        if self.predictor and self.history_frames < 2:
            raise InputError(f"--predictor: needs --history-frames 2 or more; got {self.history_frames}.")
        if self.cell not in ("gru", "lstm"):
            raise InputError(f"--cell: expected gru or lstm; got {self.cell!r}.")
        for name in ("frame_dropout", "reverse_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise InputError(f"--{name.replace('_', '-')}: expected 0 to 1; got {getattr(self, name)}.")
        for field in fields(self):
            value = getattr(self, field.name)
            bounded = field.name in ("freedom", "input_noise") or field.name.endswith("_weight")
            if bounded and not 0 <= value < float("inf"):
                raise InputError(f"--{field.name.replace('_', '-')}: expected 0 or more; got {value}.")
        if self.clip_frames <= self.history_frames + self.lookahead_frames:
            raise InputError(
                f"--clip-frames: expected more than --history-frames {self.history_frames} and --lookahead-frames"
                f" {self.lookahead_frames} together; got {self.clip_frames}."
            )

    @property
    def audio_frames(self) -> int:
        """Frames of audio in the conditioning of a frame."""
        return self.history_frames + 1 + self.lookahead_frames

    @property
    def reverses(self) -> bool:
        """Whether any batch takes the reverse pass."""
        return self.reverse_share > 0 and (self.reconstruction_weight > 0 or self.perceptual_weight > 0)


_MOGLOW = StylizedFlowConfig(hidden=512, cell="lstm", freedom=0.0, global_channels=0, reverse_share=0.0)

PRESETS: dict[str, StylizedFlowConfig] = {
    "paper": StylizedFlowConfig(perceptual_weight=0.1),
    "ted": StylizedFlowConfig(history_frames=12, lookahead_frames=0, clip_frames=42, perceptual_weight=0.1),
    "moglow": _MOGLOW,
    "moglow_styled": replace(_MOGLOW, style_controls=("height", "speed", "radius")),
    "tiny": StylizedFlowConfig(
        flow_steps=8,
        hidden=64,
        layers=1,
        history_frames=5,
        lookahead_frames=10,
        clip_frames=64,
        predictor=True,
        global_channels=16,
        encoder_channels=32,
        encoder_blocks=1,
        embedding_channels=16,
    ),
}
"""``paper`` and ``ted``: the stylized flow on Trinity and on TED. ``moglow``: the settings that MoGlow's authors prefer
for StyleGestures, apart from our ``input_noise``, which they do not have (``--input-noise 0``). ``moglow_styled``: the
same with style controls, all in one model, and the height that of both hands; StyleGestures trains one model for each
control, and its height is that of the right hand (``--style-controls right_height``). Training settings:
:data:`TRAINING_PRESETS`.
"""

#: Both flows clip gradients and have the same learning-rate schedule.
_FLOW = TrainConfig(
    steps=80_000, learning_rate=1.5e-3, schedule="noam", warmup_steps=3_000, clip_value=5.0, clip_norm=100.0
)

TRAINING_PRESETS: dict[str, TrainConfig] = {
    "paper": replace(_FLOW, steps=30_000, batch_size=100),
    "ted": replace(_FLOW, batch_size=200, learning_rate=1e-3),
    "moglow": replace(_FLOW, batch_size=80),
    "moglow_styled": replace(_FLOW, batch_size=80),
    "tiny": replace(_FLOW, steps=4_000, batch_size=16, warmup_steps=200, checkpoint_every=500, validate_every=500),
}
"""The stylized flow's training (Sec. 4), and MoGlow's as its authors prefer it for StyleGestures."""
