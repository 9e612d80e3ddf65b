"""Settings of the stylized flow and its presets."""

from dataclasses import dataclass, fields, replace

from a2g_jax.errors import InputError
from a2g_jax.models.train_config import TrainConfig

#: Frames on either side that the audio encoder depends on, and frames ahead of its second output:
#: :mod:`a2g_jax.models.stylized_flow.audio_encoder`.
REACH, AHEAD = 22, 14
#: Knots after a frame's own that a spline's frame depends on.
AFTER = 2

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
    stride: int = 1
    """Frames between the poses of the flow. 1 in the papers, whose poses are the frames themselves.

    Above 1, they are the knots of a cubic B-spline fitted to the motion (:mod:`a2g_jax.nn.spline`), with the bandwidth
    of talking people at 3 for 30 frames a second. All counts of poses below are then counts of knots.
    """
    history_frames: int = 5
    """Poses before a frame in its conditioning; its audio reaches as far back."""
    history_input: str = "steps"
    """With ``predictor``, how networks see these poses: ``poses``, the visible ones divided by their share, so that
    their sum is the same in training and in generation; or ``steps`` from each to the next and the last one. Without
    it they are as in the papers: poses, not rescaled."""
    lookahead_frames: int = 20
    """Frames of audio after its own in the conditioning of a frame."""
    frame_dropout: float = 0.4
    """Share of the conditioning poses that are masked in training, so that the audio matters."""
    history_dropout: float = 0.0
    """Share of the training clips all of whose conditioning poses are masked."""
    least_std: float = 0.0
    """Channels with a smaller standard deviation over the corpus, in their own unit, are constant: they are left out of
    the density, and generated at their mean. 0 keeps all, as the papers do."""
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
    strided_norm: bool = False
    """Whether the global encoder's two strided convolutions also have a normalisation and a ReLU, and all of its
    convolutions Kaiming's initial weights (Sec. 3.4); without it, Xavier's."""
    audio_channels: int = 0
    """Width of an audio encoder in front of the couplings: see :mod:`a2g_jax.models.stylized_flow.audio_encoder`. 0 for
    the published audio window of mel bands."""
    style_channels: int = 0
    """Width of a style code, of poses of another clip of the same recording; 0 for none."""
    style_dropout: float = 0.2
    """Share of the training clips whose style code is hidden, for generation without a style and for guidance."""
    mirror_flag: bool = False
    """Whether networks are given which clips are mirrored (``--mirror``), so that generation keeps the corpus's
    handedness."""
    recompute: bool = False
    """Whether the backward pass of training computes every flow step again, in place of storing the states of its
    recurrent layers: a sixth of the gradient's buffers (MoGlow, 80 clips, by XLA's account), and half as much time
    again."""
    reverse_share: float = 0.2
    """Share of the batches that also take the reverse pass; every fifth in the authors' code."""
    reconstruction_weight: float = 1.0
    """Weight of the L1 distance of poses generated in the reverse pass; 0 for none."""
    perceptual_weight: float = 0.0
    """Weight of the gesture perceptual loss (Eq. 10), 0.1 in the paper; needs ``a2g train --features RUN``."""
    style_controls: tuple[str, ...] = ()
    """Conditioning on the motion of the hands: any of height, left_height, right_height, speed and radius.

    Averages of the clip's own poses over four seconds. If never masked, the likelihood is that of poses given their
    averages, and cannot be compared with that of a model without them.
    """
    control_dropout: float = 0.0
    """Share of the clips in which a style control is hidden, each one independently. Above 0, a control that is not
    requested in generation is hidden, and likelihoods are those without controls; at 0 it is the median."""
    clip_frames: int = 120
    """Frames in a training clip; the first ``history_frames`` and the last ``lookahead_frames`` are conditioning
    only."""

    def __post_init__(self) -> None:
        for name in (
            *("flow_steps", "hidden", "layers", "history_frames", "encoder_channels"),
            *("encoder_blocks", "embedding_channels", "stride"),
        ):
            if getattr(self, name) < 1:
                raise InputError(f"--{name.replace('_', '-')}: expected 1 or more; got {getattr(self, name)}.")
        for name in ("lookahead_frames", "global_channels", "audio_channels", "style_channels"):
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
        if self.history_input not in ("poses", "steps"):
            raise InputError(f"--history-input: expected poses or steps; got {self.history_input!r}.")
        for name in ("frame_dropout", "reverse_share", "history_dropout", "style_dropout", "control_dropout"):
            if not 0 <= getattr(self, name) <= 1:
                raise InputError(f"--{name.replace('_', '-')}: expected 0 to 1; got {getattr(self, name)}.")
        if self.predictor and self.history_input == "poses" and self.frame_dropout == 1:
            raise InputError("--frame-dropout: expected less than 1 with --history-input poses; got 1.")
        if self.audio_channels and (self.before < REACH or self.lookahead_frames < AHEAD + REACH):
            raise InputError(
                f"--audio-channels: the audio encoder needs --history-frames times --stride of {REACH} or more and"
                f" --lookahead-frames of {AHEAD + REACH} or more; got {self.before} and {self.lookahead_frames}."
            )
        for field in fields(self):
            value = getattr(self, field.name)
            bounded = field.name in ("freedom", "input_noise", "least_std") or field.name.endswith("_weight")
            if bounded and not 0 <= value < float("inf"):
                raise InputError(f"--{field.name.replace('_', '-')}: expected 0 or more; got {value}.")
        if self.clip_frames <= self.before + self.lookahead_frames + self.stride - 1:
            times = f" times --stride {self.stride}" if self.stride > 1 else ""
            raise InputError(
                f"--clip-frames: expected more than --history-frames {self.history_frames}{times} and"
                f" --lookahead-frames {self.lookahead_frames} together; got {self.clip_frames}."
            )

    @property
    def audio_frames(self) -> int:
        """Frames of audio in the conditioning of a frame."""
        return self.before + 1 + self.lookahead_frames

    @property
    def before(self) -> int:
        """Frames before a frame in its conditioning."""
        return self.history_frames * self.stride

    @property
    def after(self) -> int:
        """Poses at the end of a clip that only their audio is of use."""
        return -(-self.lookahead_frames // self.stride)

    @property
    def overlap(self) -> int:
        """Frames after the last one of a motion that its last frames depend on: those of the knots around them."""
        return AFTER * self.stride if self.stride > 1 else 0

    @property
    def score_controls(self) -> bool:
        """Whether likelihoods are those of poses given their controls."""
        return bool(self.style_controls) and self.control_dropout == 0

    @property
    def reverses(self) -> bool:
        """Whether any batch takes the reverse pass."""
        return self.reverse_share > 0 and (self.reconstruction_weight > 0 or self.perceptual_weight > 0)


_MOGLOW = StylizedFlowConfig(hidden=512, cell="lstm", freedom=0.0, global_channels=0, reverse_share=0.0)

_TINY = StylizedFlowConfig(
    flow_steps=8,
    hidden=64,
    layers=1,
    global_channels=16,
    encoder_channels=32,
    encoder_blocks=1,
    embedding_channels=16,
    strided_norm=True,
)

PRESETS: dict[str, StylizedFlowConfig] = {
    "paper": StylizedFlowConfig(perceptual_weight=0.1, strided_norm=True),
    "ted": StylizedFlowConfig(
        history_frames=12, lookahead_frames=0, clip_frames=42, perceptual_weight=0.1, strided_norm=True
    ),
    "moglow": _MOGLOW,
    "moglow_styled": replace(_MOGLOW, style_controls=("height", "speed", "radius")),
    "tiny": replace(
        _TINY,
        hidden=96,
        stride=3,
        history_frames=8,
        history_input="poses",
        lookahead_frames=36,
        frame_dropout=0.25,
        history_dropout=0.1,
        input_noise=0.015,
        least_std=0.0101,
        clip_frames=180,
        predictor=True,
        audio_channels=48,
        style_channels=8,
        mirror_flag=True,
        style_controls=("height", "speed", "radius"),
        control_dropout=0.5,
    ),
    "tiny_published": replace(_TINY, history_frames=5, lookahead_frames=20, clip_frames=120),
}
"""``paper`` and ``ted``: the stylized flow on Trinity and on TED. ``moglow``: the settings that MoGlow's authors prefer
for StyleGestures, apart from our ``input_noise``, which they do not have (``--input-noise 0``). ``moglow_styled``: the
same with style controls, all in one model, and the height that of both hands; StyleGestures trains one model for each
control, and its height is that of the right hand (``--style-controls right_height``). ``tiny``: the shipped flow, at
30 frames a second and the bandwidth of the motion, with a linear first layer and an audio encoder.
``tiny_published``: ``paper`` at the size of ``tiny``, for tables. Training settings: :data:`TRAINING_PRESETS`.
"""

#: Both flows clip gradients and have the same learning-rate schedule.
_FLOW = TrainConfig(
    steps=80_000, learning_rate=1.5e-3, schedule="noam", warmup_steps=3_000, clip_value=5.0, clip_norm=100.0
)

_TINY_TRAINING = replace(_FLOW, steps=4_000, batch_size=16, warmup_steps=200, checkpoint_every=500, validate_every=500)

TRAINING_PRESETS: dict[str, TrainConfig] = {
    "paper": replace(_FLOW, steps=30_000, batch_size=100),
    "ted": replace(_FLOW, batch_size=200, learning_rate=1e-3),
    "moglow": replace(_FLOW, batch_size=80),
    "moglow_styled": replace(_FLOW, batch_size=80),
    "tiny": replace(_TINY_TRAINING, learning_rate=2e-3, schedule="cosine", augmentation=0.5, mirror=0.5),
    "tiny_published": _TINY_TRAINING,
}
"""The stylized flow's training (Sec. 4), and MoGlow's as its authors prefer it for StyleGestures."""
