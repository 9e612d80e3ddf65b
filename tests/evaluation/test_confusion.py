"""Confusion matrices of classifiers: against loops, as files, and what is refused."""

import dataclasses
import json

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.cli import main
from a2g_jax.data.batches import tiled_starts
from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.evaluation.confusion import chance_levels, classify_split, scores
from a2g_jax.evaluation.emotion_tables import EmotionTally, accuracy_by_chance
from a2g_jax.models import find_model
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import Run, RunConfig, save_run

FEATURES = Features(fps=15.0)
EMOTIONS = ("anger", "fear", "neutral")


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """Nine generated recordings of six seconds; in the test split there is one."""
    rows = (
        prepare_recording(dataclasses.replace(talk(6.0, n, emotion=EMOTIONS[n % 3], fps=15.0), name=f"{n}"), FEATURES)
        for n in range(9)
    )
    path = tmp_path_factory.mktemp("emotions") / "corpus"
    return write_corpus(path, rows, features=FEATURES, recipe={"reader": "talker"})


def untrained(corpus, **changes):
    """A run of a small classifier with its initial weights."""
    small = {"channels": (8,), "hidden": 8, "width": 8, "layers": 1, "heads": 2, "clip_frames": 30, **changes}
    config = RunConfig.of(
        "emotion_classifier",
        "tiny",
        dataclasses.replace(find_model("emotion_classifier").presets["tiny"], **small),
        TRAIN_PRESETS["tiny"],
        corpus,
    )
    return Run(config, jax.tree.map(np.asarray, config.build().init(jax.random.key(0))), {}, 0)


def test_one_command_writes_the_matrices_of_several_classifiers(corpus, tmp_path, capsys):
    for source, encoder in (("audio", "convolutions"), ("motion", "attention")):
        save_run(tmp_path / source, untrained(corpus, input=source, encoder=encoder))
    runs = [str(tmp_path / "audio"), str(tmp_path / "motion")]
    command = ["evaluate", *runs, "--corpus", str(corpus.path), "--split", "train"]
    assert main([*command, "--out", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    result = json.loads((tmp_path / "out" / "confusion.json").read_text(), parse_constant=pytest.fail)
    assert (tmp_path / "out" / "confusion.png").stat().st_size > 5000
    assert list(result["classifiers"]) == runs
    clips = len(tiled_starts(corpus, "train", 30, 15))
    assert clips == 7 * 5
    for name, one in result["classifiers"].items():
        counts = np.array(one["confusion"])
        assert (counts.sum(), one["clips"], one["recordings"], one["left_out"]) == (clips, clips, 7, 0)
        assert one["accuracy"]["mean"] == pytest.approx(np.trace(counts) / clips)
        assert one["accuracy"]["low"] <= one["accuracy"]["mean"] <= one["accuracy"]["high"]
        assert one["emotions"] == list(EMOTIONS)
        assert f"| {name} | {one['input']} | 35 | 7 |" in printed
    for flag in (["--audit"], ["--emotion-classifier", runs[1]]):
        assert main([*command, *flag, "--out", str(tmp_path / "no")]) == 2
        assert "is for runs that generate motion; leave it out" in capsys.readouterr().err
    assert main(["evaluate", runs[0], "demo", "--corpus", str(corpus.path), "--out", str(tmp_path / "no")]) == 2
    assert "demo: is a run of audio2gestures, which is no classifier" in capsys.readouterr().err


def test_the_answer_of_a_clip_does_not_depend_on_the_others(corpus):
    """Batches are filled up with copies; a loop over single clips gives the same matrix."""
    run = untrained(corpus)
    found = classify_split({"run": run}, corpus, split="train")["classifiers"]["run"]
    logits = jax.jit(run.config.build().classifier.logits)
    counts = np.zeros((3, 3), int)
    for segment in corpus.segments("train"):
        for start in range(segment.start, segment.stop - 29, 15):
            batch = _batch(corpus, start)
            counts[
                EMOTIONS.index(corpus.recordings[segment.recording].emotion), int(logits(run.params, batch).argmax())
            ] += 1
    np.testing.assert_array_equal(found["confusion"], counts)


def _batch(corpus, start):
    from a2g_jax.data.batch import Batch

    pose = np.asarray(corpus.pose[start : start + 30])[None]
    return Batch(np.zeros((1, 30, corpus.mel.width), np.float32), pose)


def test_corpora_that_do_not_fit(corpus, tmp_path):
    run = untrained(corpus, input="audio")
    with pytest.raises(InputError, match="has no clip of 300 frames in an emotion of run"):
        classify_split({"run": untrained(corpus, clip_frames=300)}, corpus)
    other = dataclasses.replace(corpus, fps=30.0)
    with pytest.raises(InputError, match="run: takes 64 audio values at 15 fps, with other settings than the 64 at 30"):
        classify_split({"run": run}, other)
    with pytest.raises(InputError, match="run: takes 6d .* at 15 fps, but .* holds 6d .* at 30 fps"):
        classify_split({"run": untrained(corpus)}, other)
    rows = (prepare_recording(dataclasses.replace(talk(4.0, 1, fps=15.0), emotion=""), FEATURES) for _ in range(1))
    silent = write_corpus(tmp_path / "corpus", rows, features=FEATURES, recipe={"reader": "folder"})
    with pytest.raises(InputError, match="1 of 1 recordings have no emotion, such as talker_1_ada_neutral; leave them"):
        untrained(silent)


labels_and_answers = st.lists(
    st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(0, 5)), min_size=1, max_size=60
)


@settings(max_examples=60, deadline=None)
@given(labels_and_answers)
def test_scores_against_loops(clips):
    labels, answers, recordings = (np.array(column) for column in zip(*clips, strict=True))
    found = scores(np.eye(4)[answers], labels, recordings, 4)
    assert found["accuracy"]["mean"] == pytest.approx(sum(a == b for a, b, _ in clips) / len(clips))
    recalls = []
    for k in range(4):
        own = [b for a, b, _ in clips if a == k]
        assert found["recall"][k] == (pytest.approx(own.count(k) / len(own)) if own else None)
        recalls += [own.count(k) / len(own)] if own else []
        taken = [a for a, b, _ in clips if b == k]
        assert found["precision"][k] == (pytest.approx(taken.count(k) / len(taken)) if taken else None)
    assert found["balanced"] == pytest.approx(np.mean(recalls))
    chance = found["chance"]
    assert chance["uniform"] <= chance["commonest"] == pytest.approx(np.bincount(labels).max() / len(labels))
    pairs = [a == b for a in labels for b in answers]
    assert chance["shuffled"] == pytest.approx(np.mean(pairs))
    json.dumps(found, allow_nan=False)


def test_chance_levels():
    levels = chance_levels(np.array([[6, 0, 0], [2, 0, 0], [0, 0, 0]]))
    assert levels == {"uniform": 0.5, "commonest": 0.75, "shuffled": 0.75}
    assert accuracy_by_chance(["a", "a", "b", "a"]) == {"uniform": 0.5, "commonest": 0.75}


def test_a_tally_counts_emotions_above_neutral():
    tally = EmotionTally(EMOTIONS)
    assert tally.to_json() is None
    tally.add(np.array([[0.5, 0.3, 0.2], [0.2, 0.5, 0.3], [0.3, 0.1, 0.6]]), "anger")
    tally.add(np.array([[0.2, 0.3, 0.5]]), "neutral")
    tally.add(np.array([[0.2, 0.3, 0.5]]), "joy")
    tally.add(np.zeros((0, 3)), "fear")
    assert tally.to_json() == {
        "confusion": [[1, 1, 1], [0, 0, 0], [0, 0, 1]],
        "above_neutral": {"anger": pytest.approx(1 / 3)},
    }
