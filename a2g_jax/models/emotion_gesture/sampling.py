"""Sampling settings of EmotionGesture; they can change without retraining."""

from dataclasses import dataclass, field

from a2g_jax.errors import InputError
from a2g_jax.models.control_curves import parse_line
from a2g_jax.models.emotion_timeline import parse_timeline

#: Settings of the emotion that name none: features of the audio; sampled features of the emotion that the audio has;
#: sampled features of the emotions in the condition, and those of the audio where there are none.
AUDIO, SAMPLE, LABEL = "audio", "sample", "label"


@dataclass(frozen=True)
class EmotionGestureSampling:
    """The emotion of the motion, and how it is sampled."""

    emotion: str = AUDIO
    """'audio': what the audio says; 'sample': the same emotion, with sampled features; 'label': sampled features of the
    emotion that an evaluation or a script gives; or emotions of the corpus, such as 'happiness',
    'happiness:0.7,neutral:0.3' or 'neutral@0,anger@12.5' over seconds."""
    temperature: float = 1.0
    """Scale of the noise that emotion features are sampled from; 1 is that of training."""
    controls: tuple[str, ...] = field(default=(), metadata={"flag": "control", "repeat": True})
    """Requested emotion, as other runs take it: 'emotion=anger', over seconds 'emotion=neutral@0,anger@12.5'; the same
    as the setting ``emotion`` with these values, and only one of both can be given."""
    seam_frames: int = 10
    """Frames after a seam between chunks over which the offset at it fades out; 0 leaves the seams as generated."""

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        if not 0 <= self.temperature < float("inf"):
            raise InputError(f"--temperature: expected 0 or more; got {self.temperature}.")
        if self.seam_frames < 0:
            raise InputError(f"--seam-frames: expected 0 or more; got {self.seam_frames}.")
        if self.names_emotions:
            parse_timeline(self.emotion)
        for text in self.controls:
            if parse_line(text).name == "emotion" and self.emotion != AUDIO:
                raise InputError(f"--control {text!r} and --emotion {self.emotion!r}: both choose it; leave one out.")

    @property
    def names_emotions(self) -> bool:
        """Whether the setting names emotions of the corpus."""
        return self.emotion not in (AUDIO, SAMPLE, LABEL)


SAMPLING_PRESETS: dict[str, EmotionGestureSampling] = {
    # As the authors' code, which leaves its chunks unconnected.
    "paper": EmotionGestureSampling(seam_frames=0),
    "authors": EmotionGestureSampling(seam_frames=0),
}
