"""What the eight emotions of BEAT do to a voice.

The directions follow the reviews of vocal emotion: Murray & Arnott 1993 (table of voice effects of anger, happiness,
sadness, fear and disgust relative to neutral: rate, F0 mean, F0 range, intensity, voice quality, articulation),
Banse & Scherer 1996 (fourteen acted emotions: F0 and energy high in hot anger, panic fear and elation, low in sadness
and contempt) and Juslin & Laukka 2003 (a meta-analysis: fast and loud, with strong high frequencies, for anger and
happiness; fast for fear; slow, soft, low and narrow for sadness). Surprise is not among their well-studied categories:
its high level and very wide range are our choice. The sizes are ours throughout: large enough to be learned from
minutes of speech, small enough that speakers and emotions stay separate factors.
"""

from dataclasses import dataclass


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
