"""Sampling settings of the flow; they can change without retraining."""

from dataclasses import dataclass, field

from a2g_jax.errors import InputError
from a2g_jax.models.control_curves import parse_curve


@dataclass(frozen=True)
class StylizedFlowSampling:
    """How latents are drawn, and the requested style controls."""

    temperature: float = 1.0
    """Scale of the latents; 1 is the scale of training."""
    denoise: bool = False
    """Whether the noise of training is removed from what is generated (Tweedie's formula), for runs without --stride:
    :mod:`a2g_jax.models.stylized_flow.autoregression`. Noise of spline knots is a thirtieth of that of frames."""
    style_guidance: float = 1.0
    """Weight of a style clip's code, for runs with --style-channels: 1 as in training, more for a stronger style."""
    style_gain: float = 1.0
    """Factor on the distance of a style clip's controls from the medians of the training clips, for runs with
    --style-controls: the inverse of how far motion follows a request."""
    controls: tuple[str, ...] = field(default=(), metadata={"flag": "control", "repeat": True})
    """Requested style controls in percentiles of the training clips, such as 'height=90', or over seconds
    'height=10@0 90@5'. Those that are not named are free, or 50 in runs trained without --control-dropout. For runs
    with --style-controls; may be repeated."""

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        if not 0 <= self.temperature < float("inf"):
            raise InputError(f"--temperature: expected 0 or more; got {self.temperature}.")
        for name in ("style_guidance", "style_gain"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"--{name.replace('_', '-')}: expected 0 or more; got {getattr(self, name)}.")
        for text in self.controls:
            parse_curve(text)


SAMPLING_PRESETS: dict[str, StylizedFlowSampling] = {"tiny": StylizedFlowSampling(temperature=0.94)}
"""A small flow that is trained for half an hour is wider than its data: a little below 1, FGD and tremor are lower."""
