"""Voices of the generated corpus; :mod:`a2g_jax.talker.styles` has the gesture styles of the same six speakers."""

import math
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class VoiceStyle:
    """The neutral voice of one speaker."""

    name: str
    median_f0_hz: float
    """Median fundamental frequency of voiced speech, Hz."""
    f0_range_semitones: float
    """Rise of a full accent plus phrase component, semitones; about the 5 % to 95 % range of the contour."""
    syllable_rate: float
    """Syllables per second of phonation (pauses left out)."""
    tract_length: float
    """Vocal tract length relative to 17.5 cm: divides all formant frequencies."""
    breathiness_db: float
    """Level of aspiration noise under the voiced sound, dB relative to it (modal voices: about -23)."""
    jitter: float
    """Standard deviation of the period, relative to the period (healthy voices: 0.003 to 0.012)."""
    shimmer_db: float
    """Standard deviation of the pulse level, dB (healthy voices: 0.2 to 0.6)."""
    tilt_db_per_octave: float
    """Slope of the voice source's spectrum above 500 Hz (flow derivative, lip radiation included), dB/octave."""
    pause_factor: float
    """Multiplies pause lengths; 1 is typical."""
    phrase_seconds: float
    """Typical (median) length of a phrase, seconds."""
    loudness_db: float
    """Level relative to the corpus level of -23 dBFS, dB."""


SPEAKERS: dict[str, VoiceStyle] = {
    style.name: style
    for style in (
        VoiceStyle("ada", 205.0, 9.0, 4.8, 0.87, -21.0, 0.006, 0.35, -7.0, 1.00, 2.1, 0.0),
        VoiceStyle("bruno", 104.0, 7.0, 4.2, 1.04, -25.0, 0.009, 0.45, -6.5, 1.25, 1.9, 1.0),
        VoiceStyle("chiara", 236.0, 11.0, 5.5, 0.84, -23.0, 0.005, 0.30, -6.0, 0.80, 2.4, 1.5),
        VoiceStyle("david", 124.0, 8.5, 4.9, 1.00, -23.0, 0.007, 0.40, -6.8, 1.00, 2.2, 0.0),
        VoiceStyle("elif", 182.0, 7.5, 4.4, 0.90, -17.5, 0.008, 0.45, -8.2, 1.20, 1.8, -1.5),
        VoiceStyle("felix", 143.0, 10.0, 5.3, 0.96, -20.0, 0.006, 0.35, -6.5, 0.85, 2.3, 0.5),
    )
}
"""The six speakers by name: ada, chiara and elif have female-like voices, bruno, david and felix male-like ones."""


def session_voice(style: VoiceStyle, rng: np.random.Generator) -> VoiceStyle:
    """The speaker's voice in one session: it varies from day to day with health, distance to the microphone and mood.

    Sizes are a choice: F0 varies by 0.7 semitones (standard deviation), its range by 10 %, level by 1.5 dB, tilt by
    0.5 dB/octave, breathiness by 1.5 dB, and the tract, which lips and larynx lengthen, by 1.2 %. Tempo is in the plan.
    """
    pitch, reach, level, tilt, breath, tract = rng.standard_normal(6).clip(-2.0, 2.0).tolist()
    return replace(
        style,
        median_f0_hz=style.median_f0_hz * 2.0 ** (0.7 * pitch / 12.0),
        f0_range_semitones=style.f0_range_semitones * math.exp(0.1 * reach),
        loudness_db=style.loudness_db + 1.5 * level,
        tilt_db_per_octave=style.tilt_db_per_octave + 0.5 * tilt,
        breathiness_db=style.breathiness_db + 1.5 * breath,
        tract_length=style.tract_length * math.exp(0.012 * tract),
    )
