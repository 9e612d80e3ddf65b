"""Word vectors in the text form of word2vec and fastText."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable

#: Longest line that is read: a word and a few thousand numbers.
_LONGEST = 2**20


def read_word_vectors(path: Path, words: Iterable[str], width: int) -> dict[str, Float[np.ndarray, " width"]]:
    """Vectors of words, by the word without case; the file is read line by line, and other words are skipped.

    A line is a word and its numbers, separated by spaces. A first line of two whole numbers, count and width, is
    optional. Of several spellings of a word, such as upper and lower case, the first one counts.

    Args:
        words: those that are wanted.
        width: numbers of a vector.

    Raises:
        InputError: no such file, no text, or a vector of another width or with something else than numbers.
    """
    path = check_readable(path, "a text file of word vectors")
    wanted = {word.strip().casefold() for word in words}
    found: dict[str, Float[np.ndarray, " width"]] = {}
    with path.open("rb") as file:
        for number, line in enumerate(iter(lambda: file.readline(_LONGEST), b""), start=1):
            place = f"{path}, line {number}"
            try:
                parts = line.decode("utf-8-sig" if number == 1 else "utf-8").split()
            except UnicodeDecodeError:
                raise InputError(
                    f"{place}: is not UTF-8 text; give the text form of the vectors, not the binary one."
                ) from None
            if not parts:
                continue
            if number == 1 and len(parts) == 2 and all(part.isdecimal() for part in parts):
                _check_width(int(parts[1]), width, place)
                continue
            # Some files have words with spaces in them; then the part before the numbers is none.
            if len(parts) <= width or (len(parts) > width + 1 and _is_number(parts[-width - 1])):
                _check_width(len(parts) - 1, width, place)
            text = " ".join(parts[:-width]).casefold()
            if text in wanted and text not in found:
                found[text] = _vector(parts[-width:], place)
    return found


def _check_width(found: int, width: int, place: str) -> None:
    if found != width:
        raise InputError(
            f"{place}: has a vector of {found} numbers; expected {width} in every line, as --word-width has it."
        )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _vector(parts: list[str], place: str) -> Float[np.ndarray, " width"]:
    try:
        vector = np.array(parts, np.float32)
    except ValueError:
        vector = np.array([np.nan], np.float32)
    if not np.all(np.isfinite(vector)):
        raise InputError(f"{place}: expected a word and {len(parts)} numbers; download or convert the file again.")
    return vector
