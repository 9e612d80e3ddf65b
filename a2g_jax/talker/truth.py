"""Ground truth of a generated motion: the hidden choices behind it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Stroke:
    """One gesture stroke; times in seconds."""

    apex: float
    """When the stroke arrives, just after its peak of wrist speed; at or shortly before a syllable's peak."""
    syllable: int
    """Index of the accented syllable it belongs to. Determined by the audio."""
    size: float
    """Path length scale from the accent, 0 to 1. Determined by the audio."""
    hand: str
    """'left', 'right' or 'both'. Hidden: drawn per gesture unit."""
    family: str
    """'beat', 'offer', 'sweep', 'point', 'list' or 'frame'. Hidden: the unit's, or occasionally another one."""
    hold: float
    """Post-stroke hold in seconds, where the next movement leaves room for it. Hidden."""
    unit: int
    """Index of the gesture unit (from leaving rest to returning to it)."""


@dataclass(frozen=True)
class GestureUnit:
    """One gesture unit: the strokes between leaving rest and returning to it, and their hidden choices."""

    strokes: tuple[int, ...]
    """Indices into :attr:`GestureTruth.strokes`. Determined by the audio."""
    hand: str
    """'left', 'right' or 'both'. Hidden."""
    family: str
    """Family of its first stroke and of most others (see :attr:`Stroke.family`). Hidden."""
    place: str
    """'center', 'low', 'high' or 'wide' in the gesture space. Hidden."""
    holds: bool
    """Whether its strokes are held. Hidden."""


@dataclass(frozen=True)
class PhaseSpan:
    """One of Kendon's phases of one hand; times in seconds."""

    start: float
    end: float
    phase: str
    """'rest', 'preparation', 'stroke', 'hold' or 'retraction'."""
    hand: str
    """'left' or 'right'."""


@dataclass(frozen=True)
class GestureTruth:
    """All hidden choices of one motion, and their log-probability."""

    strokes: tuple[Stroke, ...]
    phases: tuple[PhaseSpan, ...]
    rest_pose: str
    """'sides', 'belly' or 'clasped'. Hidden: drawn per recording."""
    log_probability: float
    """Log-probability (nats) of the discrete hidden choices (rest pose, posture, units) given plan and speaker."""
    posture: str = "even"
    """Where the weight rests: 'even', 'left' or 'right'. Hidden: drawn per recording."""
    units: tuple[GestureUnit, ...] = ()
