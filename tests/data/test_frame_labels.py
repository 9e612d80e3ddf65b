"""Words as one row a frame."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.data.frame_labels import word_rows
from a2g_jax.io.words import word_id


def word(text, start, end):
    return {"text": text, "start": start, "end": end}


def test_a_word_is_on_its_start_frame():
    """Starts lie within frames, so the word is not yet spoken at the frame's time."""
    words, starts = word_rows([word("a", 0.1, 0.3), word("b", 0.35, 0.36), word("c", 0.4, 0.5)], 15.0, 9)
    np.testing.assert_array_equal(np.nonzero(starts)[0], [1, 5, 6])
    expected = [0, *[word_id("a")] * 4, word_id("b"), word_id("c"), word_id("c"), 0]
    np.testing.assert_array_equal(words, expected)


def test_of_several_words_that_start_within_a_frame_the_last_counts():
    words, starts = word_rows([word("b", 0.11, 0.12), word("a", 0.07, 0.1), word("c", 0.3, 0.4)], 15.0, 8)
    assert starts.sum() == 2
    assert words[1] == word_id("b")


@pytest.mark.parametrize("frame", range(0, 900, 7))
def test_starts_at_frame_times_are_not_rounded_down(frame):
    _, starts = word_rows([word("a", round(frame / 15.0, 9), frame / 15.0 + 0.5)], 15.0, 901)
    np.testing.assert_array_equal(np.nonzero(starts)[0], [frame])


def test_no_words_and_words_outside():
    words, starts = word_rows([], 15.0, 4)
    assert not words.any()
    assert not starts.any()
    words, starts = word_rows([word("a", 0.5, 1.0), word("b", 0.26, 0.3)], 15.0, 4)
    np.testing.assert_array_equal(starts, [False, False, False, True])


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0, 5), st.floats(0, 1), st.sampled_from("abcdef")), max_size=12),
    st.sampled_from([15.0, 20.0, 30.0]),
)
def test_every_start_has_a_word_and_every_word_within_the_frames_a_start(spans, fps):
    frames = 60
    given_words = [word(text, start, start + length) for start, length, text in spans]
    words, starts = word_rows(given_words, fps, frames)
    assert (words[starts] != 0).all()
    expected = {int(np.floor(each["start"] * fps + 1e-6)) for each in given_words}
    assert set(np.nonzero(starts)[0]) == {frame for frame in expected if frame < frames}
    assert set(words) <= {0, *(word_id(each["text"]) for each in given_words)}
