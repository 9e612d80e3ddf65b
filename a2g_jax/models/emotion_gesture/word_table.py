"""Pretrained word vectors in the hashed table of the text encoder."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.io.word_vectors import read_word_vectors
from a2g_jax.io.words import word_id


def fill_table(
    table: Float[np.ndarray, "buckets width"], path: str, words: Sequence[str]
) -> Float[np.ndarray, "buckets width"]:
    """The table with the vectors of a corpus's words, divided by the root mean square length of those found.

    Words without a vector keep the row that the table has; words that share a row get the mean of their vectors.

    Raises:
        InputError: a file that cannot be read, or vectors of another length than the table's.
    """
    found = read_word_vectors(Path(path), words, table.shape[1])
    sums, counts = np.zeros_like(table), np.zeros(len(table), np.int64)
    for text, vector in found.items():
        row = word_id(text) % len(table)
        sums[row] += vector
        counts[row] += 1
    used = counts > 0
    if not used.any():
        return table
    means = sums[used] / counts[used, None]
    # The scale of the random rows: vectors of length 1, about.
    length = np.sqrt(np.mean(np.sum(means**2, axis=1)))
    filled = table.copy()
    filled[used] = means / max(float(length), 1e-12)
    return filled
