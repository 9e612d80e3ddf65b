"""Changes of a voice by the eight emotions of BEAT.

Directions relative to neutral, and where they come from:

- Anger, happiness, sadness, fear and disgust: the summary table of Murray & Arnott 1993 ("Toward the simulation of
  emotion in synthetic speech"). Rate: anger slightly faster, happiness faster or slower, sadness slightly slower,
  fear much faster, disgust very much slower. Mean F0: anger and fear very much higher, happiness much higher, sadness
  slightly lower, disgust very much lower. F0 range: anger, happiness and fear much wider, sadness slightly narrower,
  disgust slightly wider. Intensity: anger and happiness higher, fear normal, sadness and disgust lower. Quality: anger
  breathy with chest tone, happiness breathy, sadness resonant, fear irregular voicing, disgust grumbled. Articulation:
  anger tense, sadness slurred, fear precise.
- Where sources differ, we follow one. Fear's range: much wider there, but small F0 variability in the meta-analysis of
  Juslin & Laukka 2003; ours is a little wider. Anger's voice: breathy there; ours is pressed, with strong high
  frequencies, as in Juslin & Laukka 2003 and in hot anger of Banse & Scherer 1996. Sadness: weak high frequencies in
  both; our breathiness is a choice (theirs is "resonant").
- Contempt: low F0 and low energy, from the acted portrayals of Banse & Scherer 1996; its rate, range and pauses are
  choices.
- Surprise: not in those tables for lack of studies; its high level and wide range are choices.
- Sizes, pauses, accent density and the articulation of happiness, surprise, contempt and disgust are choices
  throughout: large enough to be learned from minutes of speech, small enough that speakers and emotions stay separate
  factors.
"""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class VoiceEmotion:
    """Changes relative to the neutral voice of the same speaker."""

    name: str
    f0_shift_semitones: float
    """Added to the median F0, semitones."""
    f0_range_factor: float
    """Multiplies the F0 range."""
    rate_factor: float
    """Multiplies the syllable rate."""
    loudness_db: float
    """Added to the active speech level, dB."""
    tilt_db_per_octave: float
    """Added to the source's spectral slope, dB/octave; positive is brighter, tenser."""
    pause_factor: float
    """Multiplies pause lengths."""
    accent_density: float
    """Multiplies the rate of strong accents."""
    breathiness_db: float
    """Added to the aspiration noise, dB."""
    jitter_factor: float
    """Multiplies jitter and shimmer (fear's irregular voicing)."""
    articulation: float
    """Multiplies the distance of vowels from the neutral vowel: below 1 slurred, above 1 precise."""


VOICE_EMOTIONS: dict[str, VoiceEmotion] = {
    emotion.name: emotion
    for emotion in (
        VoiceEmotion("neutral", 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0),
        VoiceEmotion("happiness", 3.5, 1.45, 1.08, 3.0, 1.0, 0.85, 1.2, 1.0, 1.0, 1.05),
        VoiceEmotion("anger", 3.0, 1.35, 1.12, 6.0, 2.0, 0.70, 1.3, -2.0, 1.4, 1.1),
        VoiceEmotion("sadness", -1.5, 0.60, 0.80, -5.0, -2.0, 1.50, 0.75, 4.0, 1.2, 0.8),
        VoiceEmotion("contempt", -2.5, 0.85, 0.90, -2.0, 0.5, 1.15, 0.9, 1.0, 1.2, 0.95),
        VoiceEmotion("surprise", 5.0, 1.60, 1.05, 2.0, 0.8, 1.00, 1.15, 2.0, 1.0, 1.05),
        VoiceEmotion("fear", 4.5, 1.15, 1.20, -1.0, 0.5, 0.80, 1.0, 3.0, 2.2, 1.0),
        VoiceEmotion("disgust", -3.5, 1.15, 0.78, -2.5, -0.5, 1.25, 0.85, 2.0, 1.5, 0.95),
    )
}
"""The eight emotions by name, in the order of BEAT's labels."""


def scaled(emotion: VoiceEmotion, strength: float) -> VoiceEmotion:
    """The emotion with its deviations from neutral times ``strength`` (factors to its power)."""
    return replace(
        emotion,
        f0_shift_semitones=strength * emotion.f0_shift_semitones,
        f0_range_factor=emotion.f0_range_factor**strength,
        rate_factor=emotion.rate_factor**strength,
        loudness_db=strength * emotion.loudness_db,
        tilt_db_per_octave=strength * emotion.tilt_db_per_octave,
        pause_factor=emotion.pause_factor**strength,
        accent_density=emotion.accent_density**strength,
        breathiness_db=strength * emotion.breathiness_db,
        jitter_factor=emotion.jitter_factor**strength,
        articulation=emotion.articulation**strength,
    )
