"""Features that a corpus has of each recording, and the papers' settings of them."""

from dataclasses import asdict, dataclass, field
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.geometry.pose_space import WIDTHS

JOINTS = ("body", "upper-body", "all")


@dataclass(frozen=True)
class Features:
    """Features of audio and pose, at the same times."""

    fps: float = 30.0
    mel: MelConfig = field(default_factory=MelConfig)
    pose: str = "6d"
    """A representation of :mod:`a2g_jax.geometry.pose_space`."""
    joints: str = "body"
    """``"body"``: the 22 body joints; ``"upper-body"``: 47 joints with fingers; ``"all"``: the rig as it is."""
    waveform: bool = False
    """Whether the corpus also has the audio as 16-bit samples, for models with other audio features."""

    def __post_init__(self) -> None:
        """Raise ``InputError`` for an unknown name."""
        if self.pose not in WIDTHS:
            raise InputError(f"--pose: there is no {self.pose!r}; there are: {', '.join(WIDTHS)}.")
        if self.joints not in JOINTS:
            raise InputError(f"--joints: there is no {self.joints!r}; there are: {', '.join(JOINTS)}.")

    def to_json(self) -> dict[str, Any]:
        """JSON values."""
        return asdict(self)


#: Dynamic range of the papers' spectrograms, librosa's default. Ours is smaller: the lowest bands are often noise.
_PUBLISHED_RANGE = 80.0

#: By paper and data.
PRESETS: dict[str, Features] = {
    # Audio2Gestures, Sec. 5.3.1: 64 bands at the motion's 30 frames a second, body joints in 6D.
    "audio2gestures": Features(mel=MelConfig(range_db=_PUBLISHED_RANGE)),
    # Its experiments in 2D, after Speech2Gesture: 64 bands at 60 Hz, four spectra to a frame; keypoints at 15.
    "audio2gestures-2d": Features(
        fps=15.0,
        mel=MelConfig(window=400, low_hz=125.0, high_hz=7500.0, stack=4, range_db=_PUBLISHED_RANGE),
        pose="keypoints",
        joints="all",
    ),
    # The flow on Trinity, after StyleGestures: 27 bands at 20 frames a second, exponential maps.
    "stylized-flow": Features(fps=20.0, mel=MelConfig(bands=27, range_db=_PUBLISHED_RANGE), pose="exponential"),
    # Our small flow: every degree of freedom of a joint is a number of its own, at 30 frames a second.
    "tiny-flow": Features(mel=MelConfig(bands=27, range_db=_PUBLISHED_RANGE), pose="euler"),
    # The flow on TED: 29 bands and directions of bones at 15 frames a second.
    "stylized-flow-ted": Features(
        fps=15.0, mel=MelConfig(bands=29, range_db=_PUBLISHED_RANGE), pose="directions", joints="all"
    ),
    # EmotionGesture: 47 joints in 6D at 15 frames a second; 128 bands, two spectra to a frame. Its hop of 512 samples
    # gives 124 spectra for 60 frames; these 120 stay in step with the motion.
    "emotion-gesture": Features(
        fps=15.0, mel=MelConfig(bands=128, window=1024, stack=2, range_db=_PUBLISHED_RANGE), joints="upper-body"
    ),
    # The same on TED: 43 joints, here as directions of 42 bones, since points do not determine rotations.
    "emotion-gesture-ted": Features(
        fps=15.0,
        mel=MelConfig(bands=128, window=1024, stack=2, range_db=_PUBLISHED_RANGE),
        pose="directions",
        joints="all",
    ),
}


def find_features(name: str) -> Features:
    """The features of a paper.

    Raises:
        InputError: unknown name.
    """
    if name not in PRESETS:
        raise InputError(f"--features: there is no {name!r}; there are: {', '.join(PRESETS)}.")
    return PRESETS[name]
