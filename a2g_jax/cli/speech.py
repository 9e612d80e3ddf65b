"""Speech and its transcript named on the command line, with warnings of what is wrong with them."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from a2g_jax.io.audio import Sound
    from a2g_jax.io.words import Word
    from a2g_jax.training.run import Run


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


def range_warning(run: "Run", name: str, audio: Any, path: str) -> str:
    """A line about a speech that lies outside what a run was trained on; empty if it does not.

    Args:
        name: of the run.
        audio: (N,), mono, at the run's sample rate.
        path: of the speech.
    """
    from a2g_jax.generation.unusual_speech import unusual_speech

    found = unusual_speech(run, audio)
    if not found:
        return ""
    what = "; ".join(map(str, found))
    return f"note: {path}: differs from the speech that {name} was trained on: {what}. Its motion may fit less well."


def warn_of_range(run: "Run", name: str, audio: Any, path: str) -> None:
    """Print :func:`range_warning`, if there is one."""
    from a2g_jax.progress import say

    if line := range_warning(run, name, audio, path):
        say(line)


def read_words(path: str | None, tier: str | None, seconds: float) -> "tuple[Word, ...]":
    """The words of a transcript for the page; prints a line for each remark on it. None without a file.

    Args:
        seconds: of the speech.

    Raises:
        InputError: not a transcript, or one whose words all start after the end of the speech.
    """
    if path is None:
        return ()

    from a2g_jax.errors import InputError
    from a2g_jax.io.transcripts import transcript_notes
    from a2g_jax.progress import say

    words, notes = transcript_notes(path, tier)
    for note in notes:
        say(f"warning: {path}: {note.message} {note.fix}".rstrip())
    spoken = tuple(word for word in words if word.start < seconds)
    if words and not spoken:
        raise InputError(
            f"{path}: all words start after the end of the speech, which lasts {seconds:.2f} s; are the times in"
            " seconds, and is it the transcript of this recording?"
        )
    return spoken


def warn_of_speech(path: str, channel: int | None = None) -> None:
    """Print the same warnings on speech that another function reads.

    Raises:
        InputError: audio that cannot be used.
    """
    read_speech(path, channel)
