"""Sampling settings of Audio2Gestures; they can change without retraining."""

from dataclasses import dataclass, field

from a2g_jax.errors import InputError
from a2g_jax.models.audio2gestures.edit_presets import expanded
from a2g_jax.models.control_curves import parse_gain, parse_line


@dataclass(frozen=True)
class Audio2GesturesSampling:
    """How codes are drawn and edited; the defaults are the papers'."""

    noise_scale: float = 1.0
    """Scale of the random specific code, or of the noise that becomes it: lower is calmer, 1 is that of training."""
    redraw_frames: int = 0
    """Frames after which the statistics of the mapping net's noise are redrawn, with blending in between.

    0 keeps one draw for the whole audio, as the authors do; then a latent choice such as the gesturing hand tends
    to stay the same throughout a long speech. With stored codes, frames after which another training clip is drawn,
    in whole clips and without blending beyond one step of the code; 0 for one stored clip after another.
    """
    sample_codes: bool = True
    """Whether codes are drawn from their posteriors, as the authors do; otherwise their means are used (smoother)."""
    keep_shared: int | None = None
    """Lowest DCT bands of the shared code that are kept, before other edits; all if not set."""
    keep_specific: int | None = None
    """Lowest DCT bands of the specific code that are kept, before other edits; all if not set."""
    rest_smoothing: int = 0
    """Binomial filters over values that hardly change, fewer the faster they do, for calmer pauses and quicker strokes;
    0 smooths all frames alike, as in training."""
    rest_speed: float = 2.4
    """Speed of a value at which half of that smoothing is left, in standard deviations of training motion a second."""
    edits: tuple[str, ...] = field(default=(), metadata={"flag": "edit", "repeat": True})
    """Edits of the codes' DCT bands, such as 'specific scale 0:10 1.5', or a name: calmer, livelier, smaller, larger,
    smoother, 'slower sway', 'one posture', 'without speech'; may be repeated."""
    controls: tuple[str, ...] = field(default=(), metadata={"flag": "control", "repeat": True})
    """Requested properties of the motion, as quantiles of the training clips from 0 to 1: energy, height, radius, rate
    and handedness (0 left, 1 right), such as 'energy=0.9', or over seconds 'energy=0.2@0,0.9@10'; and an emotion of
    the corpus, such as 'emotion=happiness'. What is not named is free. For runs with stored codes; may be repeated."""
    control_gains: tuple[str, ...] = field(
        default=(), metadata={"flag": "control-gain", "repeat": True, "measured": True}
    )
    """Factor on the distance of a requested property from the median of the training clips, such as 'energy=1.5': the
    inverse of how far motion follows a request. All that are needed, since they replace the run's; may be repeated."""

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        if self.redraw_frames < 0:
            raise InputError(f"--redraw-frames: expected 0 or more; got {self.redraw_frames}.")
        if self.rest_smoothing < 0:
            raise InputError(f"--rest-smoothing: expected 0 or more; got {self.rest_smoothing}.")
        if not 0 < self.rest_speed < float("inf"):
            raise InputError(f"--rest-speed: expected a number above 0; got {self.rest_speed}.")
        if not 0 <= self.noise_scale < float("inf"):
            raise InputError(f"--noise-scale: expected 0 or more; got {self.noise_scale}.")
        for name in ("keep_shared", "keep_specific"):
            value = getattr(self, name)
            if value is not None and value < 0:
                raise InputError(f"--{name.replace('_', '-')}: expected 0 or more; got {value}.")
        for text in self.controls:
            parse_line(text)
        for text in self.control_gains:
            parse_gain(text)

    @property
    def all_edits(self) -> tuple[str, ...]:
        """All edits as lines of :mod:`a2g_jax.models.audio2gestures.edits`, those of ``keep_*`` first."""
        kept = (("shared", self.keep_shared), ("specific", self.keep_specific))
        return (*(f"{name} keep {count}" for name, count in kept if count is not None), *expanded(self.edits))


#: Sampling settings by preset; the papers' for presets that are missing.
SAMPLING_PRESETS: dict[str, Audio2GesturesSampling] = {
    "tiny": Audio2GesturesSampling(redraw_frames=512, sample_codes=False, rest_smoothing=4),
}
"""Without gains of controls, which are measured for each run: ``python -m experiments.controls RUN --store``."""
