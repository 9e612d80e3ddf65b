"""Emotions over a speech: the lines that an animator writes, and their weights at each frame."""

import subprocess
import sys

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.models.emotion_timeline import FADE, check_emotions, emotion_rows, parse_timeline

EMOTIONS = ("anger", "happiness", "neutral")


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("happiness", [(0.0, {"happiness": 1.0})]),
        ("happiness:0.7,neutral:0.3", [(0.0, {"happiness": 0.7, "neutral": 0.3})]),
        ("happiness,neutral", [(0.0, {"happiness": 0.5, "neutral": 0.5})]),
        ("happiness:3, neutral:1", [(0.0, {"happiness": 0.75, "neutral": 0.25})]),
        ("neutral@0,anger@12.5", [(0.0, {"neutral": 1.0}), (12.5, {"anger": 1.0})]),
        ("neutral@0,anger:1,fear:3@2", [(0.0, {"neutral": 1.0}), (2.0, {"anger": 0.25, "fear": 0.75})]),
        ("anger@3", [(3.0, {"anger": 1.0})]),
    ],
)
def test_lines(text, points):
    found = parse_timeline(text)
    assert [point.second for point in found] == [second for second, _ in points]
    for point, (_, shares) in zip(found, points, strict=True):
        assert dict(point.shares) == pytest.approx(shares)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected an emotion, a blend such as"),
        ("anger,,fear", "expected an emotion"),
        ("@3", "expected an emotion"),
        ("anger:x", "'x' is not a share above 0"),
        ("anger:0", "0 is not a share above 0"),
        ("anger:-1,fear:2", "-1 is not a share above 0"),
        ("anger:nan", "'nan' is not a share above 0"),
        ("anger@", "'' is not a second"),
        ("anger@inf", "'inf' is not a second"),
        ("anger@-1", "expected seconds from 0 on, in ascending order"),
        ("neutral@5,anger@5", "expected seconds from 0 on, in ascending order"),
        ("anger,anger", "anger is named twice for one time"),
        ("neutral@0,anger", "anger has no second; write anger@SECOND"),
    ],
)
def test_bad_lines(text, message):
    with pytest.raises(InputError) as error:
        parse_timeline(text)
    assert message in str(error.value)
    assert str(error.value).startswith(f"--emotion {text!r}: ")
    assert "\n" not in str(error.value)


def test_unknown_emotions_and_points_after_the_end_are_refused():
    line = "neutral@0,angry@2"
    with pytest.raises(InputError, match="the run has no emotion 'angry'; it has: anger, happiness, neutral"):
        check_emotions(parse_timeline(line), EMOTIONS, line)
    line = "neutral@0,anger@2"
    emotion_rows(parse_timeline(line), EMOTIONS, 31, 15.0, line)
    with pytest.raises(InputError, match=r"second 2 is past the end of the speech, which lasts 2.00 s"):
        emotion_rows(parse_timeline(line), EMOTIONS, 30, 15.0, line)


def test_weights_sum_to_one_and_change_at_the_second_that_is_named():
    line = "neutral@0,anger:1,happiness:1@2,neutral@4"
    rows = emotion_rows(parse_timeline(line), EMOTIONS, 100, 20.0, line)
    np.testing.assert_allclose(rows.sum(axis=1), 1.0, atol=1e-6)
    assert rows.dtype == np.float32
    np.testing.assert_allclose(rows[:41], np.tile([[0, 0, 1]], (41, 1)), atol=1e-6)
    settled = 40 + round(FADE * 20)
    np.testing.assert_allclose(rows[settled:81], np.tile([[0.5, 0.5, 0]], (81 - settled, 1)), atol=1e-6)
    assert np.all(np.diff(rows[40 : settled + 1, 2]) < 0)
    np.testing.assert_allclose(rows[-1], [0, 0, 1], atol=1e-6)


def test_it_needs_no_jax():
    code = (
        "import sys, a2g_jax.models.emotion_timeline, a2g_jax.models.emotion_gesture; assert 'jax' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
