"""Tables of emotions by window, and the pieces of recordings that they give."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.data.datasets import LabelRule, Take
from a2g_jax.data.emotion_table import COLUMNS, WindowLabel, labelled_takes, read_table, table_lines
from a2g_jax.errors import InputError

TABLE = Path("emotions.csv")


def windows(name, *labels, seconds=4.0, stride=2.0):
    return [
        WindowLabel(name, stride * n, stride * n + seconds, emotion, confidence)
        for n, (emotion, confidence) in enumerate(labels)
    ]


def test_windows_that_agree_are_one_piece():
    labels = windows(
        "a", ("fear", 0.95), ("fear", 0.99), ("fear", 0.5), ("fear", 0.9), ("anger", 0.99), ("anger", 0.92)
    )
    labels += windows("b", ("disgust", 1.0), ("neutral", 0.91))
    takes = [Take("a", ("a.npz",), "train"), Take("b", ("b.npz",), "test"), Take("c", ("c.npz",))]
    rule = LabelRule(0.9, ("fear", "anger", "neutral"))
    found = labelled_takes(takes, labels, rule, TABLE)
    assert [(take.name, take.split, take.group) for take in found.takes] == [
        ("a@0", "train", "a"),
        ("a@10", "train", "a"),
        ("b@2", "test", "b"),
    ]
    pieces = [take.piece for take in found.takes]
    # Windows at 0 and 2 s are a piece. The one at 6 s touches it; the next, at 8 s, contradicts that one.
    assert (pieces[0].start, pieces[0].end, pieces[0].emotion) == (0.0, 10.0, "fear")
    assert (pieces[1].start, pieces[1].end, pieces[1].emotion) == (10.0, 14.0, "anger")
    assert (pieces[2].start, pieces[2].end, pieces[2].emotion) == (2.0, 6.0, "neutral")
    assert (found.windows, found.kept, found.doubtful, found.contested, found.unlabelled) == (8, 5, 1, 1, 1)
    assert found.other == {"disgust": 1}
    assert "1 below the confidence, 1 of other emotions (disgust), 1 that overlap" in found.describe()


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.lists(st.tuples(st.sampled_from(["fear", "anger", "disgust"]), st.floats(0, 1)), max_size=9), min_size=1
    ),
    st.floats(0, 1),
)
def test_pieces_hold_sure_windows_of_one_emotion_and_never_overlap(recordings, confidence):
    labels = [label for n, each in enumerate(recordings) for label in windows(f"take{n}", *each)]
    takes = [Take(f"take{n}", (f"{n}.npz",)) for n in range(len(recordings))]
    rule = LabelRule(confidence, ("fear", "anger"))
    try:
        found = labelled_takes(takes, labels, rule, TABLE)
    except InputError:
        assert not any(label.confidence >= confidence and label.emotion in rule.emotions for label in labels)
        return
    assert found.windows == len(labels)
    assert found.kept + found.doubtful + found.contested + sum(found.other.values()) == found.windows
    assert len({take.name for take in found.takes}) == len(found.takes)
    for name in {take.group for take in found.takes}:
        pieces = [take.piece for take in found.takes if take.group == name]
        assert all(before.end <= after.start for before, after in zip(pieces, pieces[1:], strict=False))
    for take in found.takes:
        piece = take.piece
        inside = [label for label in labels if label.name == take.group and label.emotion == piece.emotion]
        inside = [label for label in inside if piece.start <= label.start and label.end <= piece.end]
        assert any(label.confidence >= confidence for label in inside)
        assert (piece.start, piece.end) == (min(i.start for i in inside if i.confidence >= confidence),
                                            max(i.end for i in inside if i.confidence >= confidence))  # fmt: skip


def test_a_table_is_read_as_it_was_written(tmp_path):
    labels = windows('talk, "one"', ("fear", 0.95), ("anger", 0.5)) + windows("b", ("neutral", 1.0))
    path = tmp_path / "emotions.csv"
    path.write_text(",".join(COLUMNS) + "\n" + table_lines(labels), encoding="utf-8")
    assert read_table(path) == labels


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,start,end,emotion\na,0,4,fear\n", "line 1: has no column 'confidence'"),
        ("name,start,end,emotion,confidence\n", "has no windows; make it with 'a2g label'"),
        ("name,start,end,emotion,confidence\na,0,4,fear,2\n", "line 2: expected a confidence from 0 to 1; got 2"),
        ("name,start,end,emotion,confidence\na,4,4,fear,1\n", "line 2: expected rising times from 0 on; got 4 to 4 s"),
        ("name,start,end,emotion,confidence\na,0,x,fear,1\n", "line 2: expected a number; got 'x'"),
        ("name,start,end,emotion,confidence\na,0,4,,1\n", "line 2: expected a recording and its emotion"),
        ("name,start,end,emotion,confidence\na,0,nan,fear,1\n", "line 2: expected a number; got 'nan'"),
    ],
)
def test_wrong_tables(tmp_path, text, message):
    path = tmp_path / "emotions.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        read_table(path)
    assert str(path) in str(caught.value)


def test_tables_that_do_not_fit():
    takes = [Take("a", ("a.npz",))]
    with pytest.raises(InputError, match=r"emotions\.csv: has none of these recordings, such as a; label this folder"):
        labelled_takes(takes, windows("b", ("fear", 1.0)), LabelRule(), TABLE)
    with pytest.raises(InputError, match=r"no window has a confidence of 0\.9 or more in any emotion; lower"):
        labelled_takes(takes, windows("a", ("fear", 0.8)), LabelRule(), TABLE)
