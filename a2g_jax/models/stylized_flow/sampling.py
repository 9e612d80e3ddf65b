"""Sampling settings of the flow; they can change without retraining."""

from dataclasses import dataclass, field

from a2g_jax.errors import InputError
from a2g_jax.models.control_curves import parse_curve


@dataclass(frozen=True)
class StylizedFlowSampling:
    """How latents are drawn, and the requested style controls."""

    temperature: float = 1.0
    """Scale of the latents; 1 is the scale of training."""
    controls: tuple[str, ...] = field(default=(), metadata={"flag": "control", "repeat": True})
    """Requested style controls in percentiles of the training clips, such as 'height=90', or over seconds
    'height=10@0 90@5'; 50 for those that are not named. For runs with --style-controls; may be repeated."""

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        if not 0 <= self.temperature < float("inf"):
            raise InputError(f"--temperature: expected 0 or more; got {self.temperature}.")
        for text in self.controls:
            parse_curve(text)
