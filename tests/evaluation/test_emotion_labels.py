"""``a2g label``: emotions of windows by a classifier of audio."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.data.batch import Batch
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.emotion_table import read_table
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError, Interrupted
from a2g_jax.evaluation import emotion_labels
from a2g_jax.evaluation.emotion_labels import label_data_set, load_audio_classifier
from a2g_jax.features.mel import log_mel
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.models import find_model
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import Run, RunConfig, save_run

FEATURES = Features(fps=15.0)


@pytest.fixture(scope="module")
def classifier(tmp_path_factory):
    """An untrained classifier of audio in a run folder; its answers depend on the audio all the same."""
    folder = tmp_path_factory.mktemp("classifier")
    takes = (talk(5.0, n, emotion=("anger", "sadness")[n % 2], fps=15.0) for n in range(2))
    rows = (prepare_recording(take, FEATURES) for take in takes)
    corpus = write_corpus(folder / "corpus", rows, features=FEATURES, recipe={"reader": "talker"})
    small = {"input": "audio", "channels": (8,), "hidden": 8, "clip_frames": 20}
    config = RunConfig.of(
        "emotion_classifier",
        "tiny",
        dataclasses.replace(find_model("emotion_classifier").presets["tiny"], **small),
        TRAIN_PRESETS["tiny"],
        corpus,
    )
    params = jax.tree.map(lambda leaf: 3.0 * np.asarray(leaf), config.build().init(jax.random.key(0)))
    save_run(folder / "run", Run(config, params, {}, 0))
    return folder / "run"


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Four recordings in a folder, one of them shorter than a window."""
    folder = tmp_path_factory.mktemp("recordings")
    for n, seconds in enumerate((4.0, 3.0, 5.0, 1.2)):
        take = talk(max(seconds, 2.0), 10 + n, fps=15.0)
        motion = take.motion.clip(0, round(seconds * 15))
        write_audio(folder / f"take{n}.wav", take.audio[: round(seconds * 16000)], 16000)
        write_bvh(folder / f"take{n}.bvh", motion)
    return folder


def test_labels_become_a_corpus(classifier, recordings, tmp_path, capsys):
    table = tmp_path / "emotions.csv"
    command = ["label", "folder", str(recordings), "--classifier", str(classifier), "--workers", "1"]
    assert main([*command, "--out", str(table)]) == 0
    labels = read_table(table)
    # Windows of 20 frames, 10 apart: 60 frames have 5 of them, 45 have 3, 75 have 6, 18 none.
    assert [label.name for label in labels] == ["take0"] * 5 + ["take1"] * 3 + ["take2"] * 6
    assert (labels[1].start, labels[1].end) == (pytest.approx(10 / 15, abs=1e-3), 2.0)
    assert f"{table}: 14 windows: " in capsys.readouterr().out
    assert main([*command, "--out", str(table)]) == 2
    assert "exists already; choose another name or remove it" in capsys.readouterr().err
    out = tmp_path / "corpus"
    prepare = ["prepare", "folder", str(recordings), "--fps", "15", "--labels", str(table), "--workers", "1"]
    assert main([*prepare, "--confidence", "0.5", "--out", str(out)]) == 0
    corpus = Corpus.open(out)
    assert set(corpus.emotions) <= {"anger", "sadness"}
    assert "" not in corpus.emotions
    assert corpus.recipe["labels"]["unlabelled"] == 1


def test_a_window_is_classified_as_in_a_corpus(classifier, recordings):
    """The probabilities are those of the classifier's own model on the recording's features."""
    loaded = load_audio_classifier(classifier)
    take = talk(4.0, 10, fps=15.0)
    rows = log_mel(take.audio, FEATURES.mel, 15.0, 60)
    labels = emotion_labels.window_labels(loaded, "take0", rows, 10)
    config = loaded.run.config
    for label in labels:
        first = round(label.start * 15)
        audio = jnp.asarray(config.statistics["audio"].normalise(rows[first : first + 20])[None])
        batch = Batch(audio, jnp.zeros((1, 20, 22, 6)))
        logits = config.build().classifier.logits(jax.tree.map(jnp.asarray, loaded.run.params), batch)
        expected = np.asarray(jax.nn.softmax(logits))[0]
        assert label.emotion == loaded.emotions[int(expected.argmax())]
        assert label.confidence == pytest.approx(float(expected.max()), abs=1e-5)


def test_an_interrupted_table_is_resumed_and_the_same(classifier, recordings, tmp_path, monkeypatch):
    loaded, lines = load_audio_classifier(classifier), []
    whole = label_data_set("folder", recordings, loaded, tmp_path / "whole.csv", workers=1)
    original, done = emotion_labels.window_labels, []

    def interrupted(*arguments):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(arguments[1])
        return original(*arguments)

    monkeypatch.setattr(emotion_labels, "window_labels", interrupted)
    with pytest.raises(Interrupted, match="stopped after 2 of 4 recordings; run the same command to resume"):
        label_data_set("folder", recordings, loaded, tmp_path / "cut.csv", workers=1)
    unfinished = tmp_path / ".cut.csv.unfinished"
    with unfinished.open("a") as file:
        file.write('{"name": "take2", "labels": [["ta')
    monkeypatch.setattr(emotion_labels, "window_labels", original)
    again = label_data_set("folder", recordings, loaded, tmp_path / "cut.csv", workers=1, report=lines.append)
    assert "resuming after 2 of 4 recordings" in lines[0]
    assert again == whole
    assert (tmp_path / "cut.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cut.csv", "whole.csv"]


def test_refusals(classifier, recordings, tmp_path):
    loaded = load_audio_classifier(classifier)
    with pytest.raises(InputError, match="nowhere: there is no such folder; make it, or choose another name"):
        label_data_set("folder", recordings, loaded, tmp_path / "nowhere" / "t.csv", workers=1)
    config = loaded.run.config
    motion = dataclasses.replace(config, model_config=dataclasses.replace(config.model_config, input="motion"))
    params = jax.tree.map(np.asarray, motion.build().init(jax.random.key(0)))
    save_run(tmp_path / "motion", Run(motion, params, {}, 0))
    with pytest.raises(InputError, match="motion: is no classifier of emotions in audio; train one with"):
        load_audio_classifier(tmp_path / "motion")
