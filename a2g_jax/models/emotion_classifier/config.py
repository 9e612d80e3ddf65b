"""Settings of the emotion classifiers."""

from dataclasses import dataclass

from a2g_jax.errors import InputError


@dataclass(frozen=True)
class EmotionClassifierConfig:
    """An encoder over time, mean and spread over the clip, and a perceptron (EmotionGesture, Sec. IV-A4).

    The paper's classifier of gestures has encoder layers and a perceptron; it gives no sizes.
    """

    input: str = "motion"
    """Input of the classifier: 'motion' or 'audio'."""
    encoder: str = "convolutions"
    """'attention': transformer encoder layers over the clip; 'convolutions': residual blocks over time."""
    channels: tuple[int, ...] = (128, 128, 128, 128)
    """Residual blocks of convolutions."""
    hidden: int = 128
    """Width of the perceptron's hidden layer."""
    width: int = 256
    """Width of encoder layers with attention."""
    layers: int = 3
    """Encoder layers with attention."""
    heads: int = 8
    """Heads of attention."""
    kernel_size: int = 3
    dropout: float = 0.2
    clip_frames: int = 60
    """Frames in a clip: EmotionGesture's 60 are four seconds at 15 frames a second."""

    def __post_init__(self) -> None:
        if self.input not in ("motion", "audio"):
            raise InputError(f"--input: expected 'motion' or 'audio'; got {self.input!r}.")
        if self.encoder not in ("attention", "convolutions"):
            raise InputError(f"--encoder: expected 'attention' or 'convolutions'; got {self.encoder!r}.")
        if min(self.layers, self.heads) < 1 or self.width < 2 or self.width % 2 or self.width % self.heads:
            raise InputError(
                f"--width: expected an even multiple of --heads; got {self.width} with {self.heads} heads and"
                f" {self.layers} layers, of which one or more are needed."
            )
        if not self.channels or min(self.channels) < 1:
            raise InputError(f"--channels: expected numbers above 0 such as 64,64; got {self.channels}.")
        if self.hidden < 1:
            raise InputError(f"--hidden: expected 1 or more; got {self.hidden}.")
        if self.kernel_size < 1 or self.kernel_size % 2 == 0:
            raise InputError(f"--kernel-size: expected an odd number; got {self.kernel_size}.")
        if not 0 <= self.dropout < 1:
            raise InputError(f"--dropout: expected 0 or more and below 1; got {self.dropout}.")
        if self.clip_frames < 2:
            raise InputError(f"--clip-frames: expected 2 or more; got {self.clip_frames}.")


PRESETS: dict[str, EmotionClassifierConfig] = {
    "paper": EmotionClassifierConfig(encoder="attention"),
    "tiny": EmotionClassifierConfig(channels=(64, 64, 64), hidden=64),
}
