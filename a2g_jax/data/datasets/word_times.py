"""Words of a TextGrid that belongs to a recording, checked against its audio."""

from pathlib import Path

from a2g_jax.errors import InputError
from a2g_jax.io.textgrid import read_words
from a2g_jax.io.words import Word

#: How far a word may end after the audio, seconds: recordings lose their last moments when they are cut.
_BEYOND = 0.5


def words_of_audio(path: Path | str, seconds: float) -> tuple[Word, ...]:
    """The words of a TextGrid.

    Args:
        path: the TextGrid.
        seconds: length of the audio.

    Raises:
        InputError: not a TextGrid, one without words, or one whose words end more than half a second after the audio.
    """
    words = read_words(path)
    if not words:
        raise InputError(f"{path}: has no words; align the transcript again, or remove the file if nothing is said.")
    last = max(words, key=lambda word: word.end)
    if last.end > seconds + _BEYOND:
        raise InputError(
            f"{path}: {last.text!r} ends at {last.end:.2f} s, but the audio lasts {seconds:.2f} s; take the"
            " TextGrid of this recording."
        )
    return words
