"""Remarks on the header, the channels and the level of an audio file."""

from a2g_jax.io.channels import Channels, channel_notes
from a2g_jax.io.reading import Note

#: Share of clipped samples from which distortion is audible; below it a few plosives hit the limit.
CLIPPED_SHARE = 1e-4
#: Peaks from here on are beyond full scale. Decoders of compressed audio pass it by a few decibels.
_BEYOND, _BEYOND_DECODED = 1.001, 2.0
_SAMPLES = ("FLOAT", "DOUBLE")
_EXACT_FORMATS = ("WAV", "WAVEX", "RF64", "W64", "AIFF", "AU", "CAF")


def sound_notes(header: str, channels: Channels | None, peak: float, format: str, subtype: str) -> list[Note]:
    """Remarks on an audio file that can be used.

    Args:
        header: how the header was repaired; empty for a sound one.
        channels: of files with several.
        peak: largest sample.
        format: container, by libsndfile's name.
        subtype: encoding, by libsndfile's name.
    """
    notes = [Note("header", header, "Check that its end is there.")] if header else []
    if channels is not None:
        notes += channel_notes(channels, CLIPPED_SHARE)
    exact = format in _EXACT_FORMATS and subtype in _SAMPLES
    if peak > (_BEYOND if exact else _BEYOND_DECODED):
        message = f"samples reach {peak:.4g}, beyond full scale (1): programs that play or convert it clip them."
        notes.append(Note("full-scale", message, f"Multiply them by {1 / peak:.2g}.", value=peak))
    return notes
