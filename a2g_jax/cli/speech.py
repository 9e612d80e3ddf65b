"""Speech named on the command line, with warnings of what is wrong with it."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from a2g_jax.io.audio import Sound


def read_speech(path: str, channel: int | None) -> "Sound":
    """A speech recording; prints a line for each warning: no speech, channels that differ, clipping, levels.

    Args:
        channel: of files with several, from 1 on; None for the mean of all.

    Raises:
        InputError: audio that cannot be used.
    """
    from a2g_jax.inspection.audio_checks import speech_warnings
    from a2g_jax.io.audio import load_audio
    from a2g_jax.progress import say

    sound = load_audio(path, channel=channel)
    for finding in speech_warnings(sound):
        say(f"warning: {path}: {finding.message} {finding.fix}".rstrip())
    return sound


def warn_of_speech(path: str, channel: int | None = None) -> None:
    """Print the same warnings on speech that another function reads.

    Raises:
        InputError: audio that cannot be used.
    """
    read_speech(path, channel)
