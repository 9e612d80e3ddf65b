"""Word vectors in text form: both forms, only the words needed, and damaged files."""

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.io.word_vectors import read_word_vectors
from a2g_jax.io.words import word_id
from a2g_jax.models.emotion_gesture.word_table import fill_table


@pytest.fixture
def write(tmp_path):
    """A function that writes a file of vectors."""

    def to(text, encoding="utf-8"):
        path = tmp_path / "vectors.txt"
        path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
        return path

    return to


@pytest.mark.parametrize("header", ["", "3 2\n"])
def test_both_forms(write, header):
    path = write(f"{header}hello 0.5 -1\nWorld 2 3e-1\nunused 9 9\n")
    found = read_word_vectors(path, ["Hello", "world ", "missing"], 2)
    assert set(found) == {"hello", "world"}
    np.testing.assert_allclose(found["hello"], [0.5, -1.0])
    np.testing.assert_allclose(found["world"], [2.0, 0.3])


def test_the_first_spelling_counts_and_words_may_be_numbers_or_have_spaces(write):
    path = write("Bill 1 1\nbill 2 2\n1984 3 3\nat home 4 4\n\nété 5 5\n")
    found = read_word_vectors(path, ["bill", "1984", "at home", "ÉTÉ"], 2)
    assert {word: vector[0] for word, vector in found.items()} == {"bill": 1, "1984": 3, "at home": 4, "été": 5}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a 1 2\nb 1 2 3\n", "line 2: has a vector of 3 numbers; expected 2 in every line, as --word-width has it"),
        ("a 1 2\nb 1\n", "line 2: has a vector of 1 numbers; expected 2"),
        ("2 3\na 1 2 3\n", "line 1: has a vector of 3 numbers; expected 2"),
        ("a 1 x\n", "line 1: expected a word and 2 numbers"),
        ("a 1 nan\n", "line 1: expected a word and 2 numbers"),
        (b"a 1 2\n\xff\xfe 1 2\n", "line 2: is not UTF-8 text"),
        ("", "is empty"),
    ],
)
def test_damaged_files(write, text, message):
    path = write(text)
    with pytest.raises(InputError, match=message) as error:
        read_word_vectors(path, ["a", "b"], 2)
    assert "\n" not in str(error.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        read_word_vectors(tmp_path / "no.txt", ["a"], 2)


def test_the_table_has_the_vectors_of_the_corpus_in_the_rows_of_their_hashes(write):
    path = write("hello 3 4\nworld 0 5\nother 7 7\n")
    table = np.full((64, 2), 9.0, np.float32)
    filled = fill_table(table, str(path), ("hello", "missing", "world"))
    # Lengths of both are 5; rows of the table have about length 1.
    np.testing.assert_allclose(filled[word_id("hello") % 64], [0.6, 0.8], rtol=1e-6)
    np.testing.assert_allclose(filled[word_id("world") % 64], [0.0, 1.0], rtol=1e-6)
    assert np.sum(np.any(filled != 9.0, axis=1)) == 2
    assert np.all(table == 9.0), "the argument is as it was"
    np.testing.assert_array_equal(fill_table(table, str(path), ("missing",)), table)
