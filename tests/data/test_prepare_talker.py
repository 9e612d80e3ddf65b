"""``a2g prepare talker``: its flags, what they refuse, and the same corpus from any number of workers."""

import numpy as np
import pytest
from test_prepare_resume import contents

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.generated import TalkerOptions
from a2g_jax.data.prepare import prepare_talker
from a2g_jax.data.settings import find_features
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.talker import recordings


@pytest.fixture
def short(monkeypatch):
    """Recordings of three seconds."""
    monkeypatch.setattr(recordings, "RECORDING_SECONDS", 3.0)


def test_any_number_of_workers_makes_the_same_corpus(tmp_path, short):
    options = TalkerOptions(minutes=0.3, seed=7, jitter=1.0)
    made = [contents(prepare_talker(tmp_path / str(n), options, workers=n).path) for n in (1, 3)]
    assert made[0] == made[1]
    assert len(made[0]) == 5 + 6


def test_flags(tmp_path, short, capsys):
    command = ["prepare", "talker", "--minutes", "0.2", "--seed", "3", "--speakers", "ada, bruno", "--workers", "1"]
    plain, noisy, fingers = (str(tmp_path / name) for name in ("plain", "noisy", "fingers"))
    assert main([*command, "--emotions", "anger", "--out", plain]) == 0
    assert "4 recordings, 0.2 minutes, 22 joints at 30 fps" in capsys.readouterr().out
    corpus = Corpus.open(plain)
    assert {entry.speaker for entry in corpus.recordings} == {"ada", "bruno"}
    assert {entry.emotion for entry in corpus.recordings} == {"anger"}
    wanted = {"reader": "talker", "minutes": 0.2, "seed": 3, "fps": 30.0, "speakers": ["ada", "bruno"]}
    assert wanted.items() <= corpus.recipe.items()
    assert (corpus.recipe["emotions"], corpus.recipe["jitter"], corpus.recipe["fingers"]) == (["anger"], 0.0, False)
    assert main([*command, "--emotions", "anger", "--jitter", "2", "--out", noisy]) == 0
    jittered = Corpus.open(noisy)
    np.testing.assert_array_equal(jittered.audio, corpus.audio)
    assert jittered.recipe["jitter"] == 2.0
    jerk = [np.abs(np.diff(np.asarray(c.pose[:90]), n=3, axis=0)).mean() for c in (corpus, jittered)]
    assert jerk[1] > 3 * jerk[0]
    assert main([*command, "--emotions", "anger", "--fingers", "--out", fingers]) == 0
    with_fingers = Corpus.open(fingers)
    assert with_fingers.skeleton.joints == 52
    np.testing.assert_array_equal(with_fingers.pose[:, :22], corpus.pose)


def test_the_corpus_of_emotion_gesture_with_and_without_jitter(tmp_path, short):
    """The same speech, words, emotions and splits; only poses differ, so the clean corpus scores runs of the other."""
    command = ["prepare", "talker", "--view", "beat", "--features", "emotion-gesture", "--waveform"]
    command += ["--minutes", "0.3", "--seed", "5", "--workers", "1"]
    assert main([*command, "--out", str(tmp_path / "clean")]) == 0
    assert main([*command, "--jitter", "1", "--out", str(tmp_path / "noisy")]) == 0
    clean, noisy = (Corpus.open(tmp_path / name) for name in ("clean", "noisy"))
    assert (clean.fps, clean.pose.shape[1:], clean.space.kind) == (15.0, (47, 6), "6d")
    assert clean.space.same_as(noisy.space)
    assert clean.recordings == noisy.recordings
    assert clean.splits == noisy.splits
    for name in ("audio", "waveform", "words", "word_starts", "emotion"):
        np.testing.assert_array_equal(clean.array(name), noisy.array(name))
    assert clean.array("words")[clean.array("word_starts")].all()
    turned = rotations_from_rows(noisy.pose[:], "6d") @ np.swapaxes(rotations_from_rows(clean.pose[:], "6d"), -1, -2)
    degrees = np.degrees(np.arccos(np.clip((np.trace(turned, axis1=-2, axis2=-1) - 1) / 2, -1, 1)))
    assert 0.3 < np.median(degrees) < 3.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["talker", "--speakers", "ada,zoe"], "--speakers: there is no zoe; there are: ada, bruno,"),
        (["talker", "--emotions", "joy"], "--emotions: there is no joy; there are: neutral,"),
        (["talker", "--speakers", ","], "--speakers: empty list"),
        (["talker", "--speakers", "ada,ada"], "a name is repeated in ada,ada"),
        (["talker", "--jitter", "90"], "--jitter: expected degrees from 0 to 45; got 90"),
        (["talker", "--jitter", "much"], "expected a number above 0; got 'much'"),
        (["talker", "--workers", "0"], "from 1 to 1000; got '0'"),
        (["talker", "--on-demand"], "stores 60 minutes and generates the rest in training; 30 are not more"),
        (["talker", "--minutes", "0.1"], "are too few"),
        (["talker", "--joints", "all"], "--joints is for recordings"),
        (["folder", ".", "--speakers", "ada"], "--speakers is for 'a2g prepare talker'"),
        (["folder", ".", "--on-demand"], "--on-demand is for 'a2g prepare talker'"),
        (["talker", "--labelled"], "--labelled is for recordings"),
        (["folder", ".", "--confidence", "0.5", "--labels", "no.csv"], "no.csv: there is no such file; make it with"),
        (["folder", ".", "--fingers"], "--fingers is for 'a2g prepare talker'"),
    ],
)
def test_refusals(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    try:
        status = main(["prepare", *arguments, "--out", "c"])
    except SystemExit as stop:
        status = stop.code
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("a2g: ")]
    assert status == 2
    assert message in line
    assert list(tmp_path.iterdir()) == []


def test_rotations_as_exponential_maps(tmp_path, short):
    """The flow's settings; the same motion as in 6D."""
    options = TalkerOptions(minutes=0.2, seed=3, fps=20.0)
    maps = prepare_talker(tmp_path / "maps", options, find_features("stylized-flow"), workers=1)
    six = prepare_talker(tmp_path / "six", options, workers=1)
    assert (maps.space.kind, six.space.kind) == ("exponential", "6d")
    np.testing.assert_allclose(
        rotations_from_rows(maps.pose[:50], "exponential"), rotations_from_rows(six.pose[:50], "6d"), atol=1e-5
    )


def test_poses_that_a_view_does_not_show(tmp_path, capsys):
    command = ["prepare", "talker", "--out", str(tmp_path / "corpus"), "--minutes", "1"]
    assert main([*command, "--pose", "keypoints"]) == 2
    assert "the view 'body' shows 6d or exponential or euler" in capsys.readouterr().err
