"""Gesture styles of the six invented speakers, and their changes by emotion."""

from dataclasses import dataclass, replace

from a2g_jax.errors import InputError

REST_POSES = ("sides", "belly", "clasped")
POSTURES = ("even", "left", "right")
"""Where the weight rests: on both legs, on the left or on the right one."""
HANDS = ("left", "right", "both")
FAMILIES = ("beat", "offer", "sweep", "point", "list", "frame")
PLACES = ("center", "low", "high", "wide")
"""Places in the gesture space in front of the speaker (after McNeill 1992)."""


@dataclass(frozen=True)
class GestureStyle:
    """A manner of gesturing; probabilities are of the hidden draws, everything else is fixed for the speaker."""

    threshold: float
    """Smallest accent (0 to 1) that gets a stroke: the gesture rate."""
    spacing: float
    """Smallest time between two stroke syllables, seconds."""
    height: float
    """Gestures' height above the neutral gesture space, metres."""
    spread: float
    """Hands' distance from the midline beyond the neutral one, metres."""
    radius: float
    """Path of a stroke on a fully accented syllable, about, metres."""
    speed: float
    """Tempo of all hand movement; 1 is neutral."""
    two_handed: float
    """Probability that a gesture unit uses both hands."""
    right_handed: float
    """Probability that a one-handed unit uses the right hand."""
    symmetry: float
    """Size of the second hand's path as a share of the first's, in two-handed units."""
    hold: float
    """Probability that a unit holds its strokes."""
    nod: float
    """Head nod on a fully accented syllable, degrees."""
    gaze: float
    """Spread (standard deviation) of gaze yaw, degrees."""
    lean: float
    """Forward lean of the torso, degrees."""
    elbow_out: float
    """How far elbows point outward: 0 = straight down, 1 = 45 degrees."""
    sway: float
    """Size of sway and weight shifts; 1 is neutral."""
    rest_poses: tuple[float, float, float]
    """Probabilities of :data:`REST_POSES`."""
    families: tuple[float, float, float, float, float, float]
    """Weights of :data:`FAMILIES`."""
    places: tuple[float, float, float, float]
    """Probabilities of :data:`PLACES`."""
    head_pitch: float = 0.0
    """Head bowed forward, degrees."""
    tension: float = 0.0
    """0 relaxed to 1 tense: lifted shoulders, stiff wrists, little relaxation between strokes."""


@dataclass(frozen=True)
class EmotionStyle:
    """Changes of a :class:`GestureStyle` by an emotion."""

    extent: float = 1.0
    """Factor on stroke paths."""
    speed: float = 1.0
    """Factor on tempo."""
    threshold: float = 0.0
    """Added to the accent threshold."""
    height: float = 0.0
    """Added to height, metres."""
    spread: float = 0.0
    """Added to spread, metres."""
    tension: float = 0.0
    """Added to tension."""
    head_pitch: float = 0.0
    """Added to head pitch, degrees."""
    lean: float = 0.0
    """Added to torso lean, degrees."""
    nod: float = 1.0
    """Factor on nods."""
    gaze: float = 1.0
    """Factor on gaze spread."""
    sway: float = 1.0
    """Factor on sway."""
    hold: float = 0.0
    """Added to hold probability."""


SPEAKER_STYLES: dict[str, GestureStyle] = {
    # Lively and light: two-handed, high, quick beats and frames.
    "ada": GestureStyle(
        threshold=0.42, spacing=0.42, height=0.05, spread=0.02, radius=0.46, speed=1.12, two_handed=0.70,
        right_handed=0.75, symmetry=0.92, hold=0.25, nod=5.0, gaze=9.0, lean=1.0, elbow_out=0.55, sway=1.0,
        rest_poses=(0.2, 0.6, 0.2), families=(3.0, 3.0, 1.0, 1.0, 1.0, 3.0), places=(0.45, 0.10, 0.35, 0.10),
    ),
    # Heavy and calm: low, slow, one right hand, long holds.
    "bruno": GestureStyle(
        threshold=0.54, spacing=0.60, height=-0.03, spread=0.03, radius=0.48, speed=0.85, two_handed=0.35,
        right_handed=0.92, symmetry=0.75, hold=0.60, nod=3.0, gaze=5.0, lean=-1.0, elbow_out=0.70, sway=0.7,
        rest_poses=(0.7, 0.1, 0.2), families=(4.0, 3.0, 1.0, 2.0, 2.0, 1.0), places=(0.40, 0.45, 0.05, 0.10),
    ),
    # Expansive: wide sweeps and offers, large and fast, left hand as often as right.
    "chiara": GestureStyle(
        threshold=0.33, spacing=0.45, height=0.02, spread=0.07, radius=0.52, speed=1.10, two_handed=0.60,
        right_handed=0.55, symmetry=0.85, hold=0.20, nod=4.5, gaze=14.0, lean=3.0, elbow_out=0.65, sway=1.5,
        rest_poses=(0.4, 0.4, 0.2), families=(1.0, 4.0, 4.0, 1.0, 1.0, 2.0), places=(0.25, 0.10, 0.20, 0.45),
    ),
    # The lecturer: precise points and lists close to the body, strong nods.
    "david": GestureStyle(
        threshold=0.5, spacing=0.50, height=0.03, spread=-0.02, radius=0.44, speed=1.0, two_handed=0.40,
        right_handed=0.85, symmetry=0.80, hold=0.50, nod=6.0, gaze=7.0, lean=2.0, elbow_out=0.50, sway=0.8,
        rest_poses=(0.2, 0.2, 0.6), families=(2.0, 1.0, 0.5, 4.0, 4.0, 1.0), places=(0.65, 0.10, 0.20, 0.05),
    ),
    # Reserved: few small gestures low before the belly, clasped hands.
    "elif": GestureStyle(
        threshold=0.6, spacing=0.70, height=-0.02, spread=-0.03, radius=0.37, speed=0.92, two_handed=0.55,
        right_handed=0.70, symmetry=0.90, hold=0.35, nod=4.0, gaze=6.0, lean=0.0, elbow_out=0.45, sway=0.6,
        rest_poses=(0.1, 0.45, 0.45), families=(4.0, 4.0, 0.5, 0.5, 1.0, 2.0), places=(0.55, 0.40, 0.02, 0.03),
    ),
    # Left-handed and restless: many quick beats, little holding, much head movement.
    "felix": GestureStyle(
        threshold=0.25, spacing=0.38, height=0.0, spread=0.0, radius=0.39, speed=1.2, two_handed=0.45,
        right_handed=0.15, symmetry=0.70, hold=0.08, nod=5.0, gaze=11.0, lean=4.0, elbow_out=0.55, sway=1.3,
        rest_poses=(0.5, 0.3, 0.2), families=(6.0, 2.0, 2.0, 2.0, 1.0, 1.0), places=(0.50, 0.20, 0.20, 0.10),
    ),
}  # fmt: skip
"""The six speakers of the corpus, by name."""

EMOTION_STYLES: dict[str, EmotionStyle] = {
    "neutral": EmotionStyle(),
    "happiness": EmotionStyle(
        extent=1.20, speed=1.10, threshold=-0.05, height=0.03, spread=0.03, head_pitch=-4.0, nod=1.2, gaze=1.1, sway=1.4
    ),
    "anger": EmotionStyle(
        extent=1.30, speed=1.25, threshold=-0.06, tension=0.6, head_pitch=3.0, lean=5.0, nod=1.5, gaze=0.5, hold=0.1
    ),
    "sadness": EmotionStyle(
        extent=0.62, speed=0.72, threshold=0.12, height=-0.045, spread=-0.02, head_pitch=12.0, lean=4.0, nod=0.6,
        gaze=0.7, sway=0.7, hold=-0.1,
    ),
    "contempt": EmotionStyle(
        extent=0.85, speed=0.88, threshold=0.08, head_pitch=-7.0, lean=-3.0, nod=0.7, gaze=1.2, sway=0.8
    ),
    "surprise": EmotionStyle(
        extent=1.15, speed=1.18, height=0.06, spread=0.05, tension=0.25, head_pitch=-5.0, lean=-3.0, nod=0.9, hold=0.25
    ),
    "fear": EmotionStyle(
        extent=0.70, speed=1.15, threshold=0.05, height=0.03, spread=-0.04, tension=0.8, head_pitch=4.0, lean=-2.0,
        nod=0.7, gaze=1.6, sway=0.6,
    ),
    "disgust": EmotionStyle(
        extent=0.85, speed=0.95, threshold=0.05, spread=-0.03, tension=0.4, head_pitch=-3.0, lean=-4.0, nod=0.8,
        gaze=1.3, sway=0.8,
    ),
}  # fmt: skip
"""Changes by name of the emotion.

The directions (sadness: small, slow, head bowed; anger and happiness: large and fast; anger: leaning forward; disgust
and fear: drawing back, arms close) follow the body movement literature: Wallbott 1998, "Bodily expression of emotion",
and the survey of Kleinsmith & Bianchi-Berthouze 2013. The numbers are this corpus's own.
"""


def gesture_style(speaker: str, emotion: str) -> GestureStyle:
    """The style of ``speaker`` in ``emotion``.

    Raises:
        InputError: unknown name; the message lists those that exist.
    """
    if speaker not in SPEAKER_STYLES:
        raise InputError(f"speaker {speaker!r}: not known; choose one of {', '.join(SPEAKER_STYLES)}")
    if emotion not in EMOTION_STYLES:
        raise InputError(f"emotion {emotion!r}: not known; choose one of {', '.join(EMOTION_STYLES)}")
    style, change = SPEAKER_STYLES[speaker], EMOTION_STYLES[emotion]
    return replace(
        style,
        threshold=min(max(style.threshold + change.threshold, 0.05), 0.9),
        spacing=max(style.spacing / change.speed**0.5, 0.35),
        height=style.height + change.height,
        spread=style.spread + change.spread,
        radius=min(style.radius * change.extent, 0.58),
        speed=min(style.speed * change.speed, 1.42),
        hold=min(max(style.hold + change.hold, 0.05), 0.95),
        nod=style.nod * change.nod,
        gaze=style.gaze * change.gaze,
        lean=style.lean + change.lean,
        sway=min(style.sway * change.sway, 1.7),
        head_pitch=style.head_pitch + change.head_pitch,
        tension=style.tension + change.tension,
    )
