"""Corpora of which most is generated in training: the same rows, the same training, and clear when it fails."""

import itertools
import json
import os
import shutil
import signal
import threading

import jax
import numpy as np
import pytest

from a2g_jax.data.batch import FIELDS, clip_shape
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_manifest import fingerprint_of
from a2g_jax.data.generated import TalkerOptions
from a2g_jax.data.on_demand import OnDemand, PartStream, split_roles
from a2g_jax.data.prepare import prepare_talker
from a2g_jax.data.settings import Features
from a2g_jax.data.workers import WorkerDiedError
from a2g_jax.errors import InputError, Interrupted
from a2g_jax.io.files import sha256_file
from a2g_jax.io.sealed import write_sealed
from a2g_jax.talker import recordings
from a2g_jax.training import loop
from a2g_jax.training.loop import train
from a2g_jax.training.run import RunConfig

#: Ten recordings of five seconds: six are stored, and two parts of two are generated.
OPTIONS = TalkerOptions(minutes=10 * 5 / 60, seed=4, jitter=0.5)
SMALL = OnDemand(stored_minutes=0.5, part_minutes=10 / 60)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """The same recordings, stored and on demand."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recordings, "RECORDING_SECONDS", 5.0)
        path = tmp_path_factory.mktemp("on_demand")
        features = Features(waveform=True)
        prepare_talker(path / "stored", OPTIONS, features, workers=1)
        prepare_talker(path / "corpus", OPTIONS, features, workers=1, on_demand=SMALL)
    return path


@pytest.fixture(scope="module")
def corpus(folders):
    return Corpus.open(folders / "corpus")


@pytest.fixture(scope="module")
def config(corpus, toy_run_config):
    def make(**changes):
        toy = toy_run_config(**{"steps": 24, "part_steps": 5, **changes})
        return RunConfig.of("audio2gestures", "tiny", toy.model_config, toy.train_config, corpus)

    return make


def test_parts_hold_the_rows_that_would_be_stored(folders, corpus):
    stored = Corpus.open(folders / "stored")
    assert corpus.parts == 3
    assert len(corpus.recordings) == 6
    np.testing.assert_array_equal(corpus.pose, stored.pose[: corpus.frames])
    names = clip_shape(tuple(FIELDS), 16, corpus.fps, corpus.mel.sample_rate).arrays
    with PartStream(corpus, part_steps=1, total_steps=3, workers=1, arrays=names) as parts:
        first = parts.get(0)
        assert set(first.arrays) == set(names)
        assert [segment.recording for segment in first.segments] == [s.recording for s in corpus.segments("train")]
        for number in (1, 2):
            part = parts.get(number)
            rows = slice(corpus.frames + 300 * (number - 1), corpus.frames + 300 * number)
            for name in ("audio", "pose", "words", "word_starts"):
                np.testing.assert_array_equal(part.arrays[name], stored.array(name)[rows], err_msg=name)
            for name, ours, theirs in (
                ("emotion", corpus.emotions, stored.emotions),
                ("speaker", corpus.speakers, stored.speakers),
            ):
                indices = stored.array(name)[rows]
                assert [ours[index] for index in part.arrays[name]] == [theirs[index] for index in indices]
            starts = stored.array("waveform_start")[rows]
            np.testing.assert_array_equal(part.arrays["waveform_start"], starts - starts[0])
            np.testing.assert_array_equal(part.arrays["waveform"], stored.waveform[starts[0] :][: 10 * 16000])
            assert [tuple(segment) for segment in part.segments] == [(0, 0, 150), (1, 150, 300)]
            assert len(parts._coming) <= 1  # the next part at most


def test_every_recording_has_one_place():
    roles = [{"name": str(n), "seconds": 60.0} for n in range(200)]
    held = split_roles(TalkerOptions(minutes=200.0), roles, OnDemand())
    sizes = [len(part) for part in held["parts"]]
    assert [*held["stored"], *itertools.chain(*held["parts"])] == roles
    assert len(held["stored"]) == 60
    assert sizes == [28] * 5
    with pytest.raises(InputError, match="stores 60 minutes .* 60 are not more: leave it out"):
        split_roles(TalkerOptions(minutes=60.0), roles[:60], OnDemand())


def test_training_takes_the_parts_in_turns(corpus):
    stream = PartStream(corpus, part_steps=5, total_steps=100)
    assert [stream.number(step) for step in (0, 4, 5, 9, 10, 14, 15, 20)] == [0, 0, 1, 1, 2, 2, 0, 1]


@pytest.fixture(scope="module")
def whole(corpus, config, tmp_path_factory):
    """A training without a stop, and its folder."""
    path = tmp_path_factory.mktemp("on_demand_run") / "whole"
    return train(config(), corpus, path, resume=False, progress=False), path


@pytest.mark.slow
def test_resuming_equals_not_having_stopped(tmp_path, corpus, config, whole, monkeypatch):
    whole, path = whole
    original = loop.MetricsLog.tick

    def tick(self, done):
        original(self, done)
        if done == 12:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(loop.MetricsLog, "tick", tick)
    with pytest.raises(Interrupted):
        train(config(), corpus, tmp_path / "half", resume=False, progress=False)
    monkeypatch.undo()
    resumed = train(config(), corpus, tmp_path / "half", resume=True, progress=False)
    jax.tree.map(np.testing.assert_array_equal, whole.params, resumed.params)
    jax.tree.map(np.testing.assert_array_equal, whole.summary, resumed.summary)
    assert (tmp_path / "half" / "metrics.jsonl").read_text() == (path / "metrics.jsonl").read_text()


@pytest.mark.slow
def test_the_parts_matter(tmp_path, corpus, config, whole):
    """Training on the stored part alone ends elsewhere."""
    whole, path = whole
    alone = train(config(part_steps=1000), corpus, tmp_path / "alone", resume=False, progress=False)
    assert not np.array_equal(jax.tree.leaves(alone.params)[0], jax.tree.leaves(whole.params)[0])
    with pytest.raises(InputError, match="part_steps: 5, now 7"):
        train(config(steps=30, part_steps=7), corpus, path, resume=True, progress=False)


@pytest.mark.slow  # a recording of its own for each length of part is compiled
def test_an_ordinary_corpus_does_not_care_for_part_steps(tmp_path, toy_corpus, toy_run_config):
    first = train(toy_run_config(steps=6, part_steps=2), toy_corpus, tmp_path / "run", resume=False, progress=False)
    again = train(toy_run_config(steps=6), toy_corpus, tmp_path / "again", resume=False, progress=False)
    jax.tree.map(np.testing.assert_array_equal, first.params, again.params)
    train(toy_run_config(steps=6, part_steps=3), toy_corpus, tmp_path / "run", resume=True, progress=False)


def test_a_worker_that_dies_is_named(corpus):
    with pytest.raises(WorkerDiedError, match="a worker process died.*--resume"):  # noqa: SIM117, PT012
        with PartStream(corpus, part_steps=1, total_steps=3, workers=1) as parts:
            parts.get(0)
            for process in parts._pool._processes.values():
                process.kill()
            parts.get(1)


def test_stopping_while_a_part_is_waited_for(corpus):
    stop = threading.Event()
    stop.set()
    with PartStream(corpus, part_steps=1, total_steps=3, workers=1) as parts:
        assert parts.get(1, stop) is None
        assert parts.get(1).arrays["pose"].shape == (300, 22, 6)


def seal_parts(folder):
    """Make the manifest agree with changed recipes."""
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["arrays"]["parts.json"] = sha256_file(folder / "parts.json")
    manifest["fingerprint"] = fingerprint_of(manifest["arrays"])
    write_sealed(folder / "manifest.json", manifest)


def test_another_generator_is_refused(tmp_path, corpus):
    copy = shutil.copytree(corpus.path, tmp_path / "copy")
    held = json.loads((copy / "parts.json").read_text())
    held["stored"][0]["seed"] += 1
    (copy / "parts.json").write_text(json.dumps(held))
    with pytest.raises(InputError, match=r"parts\.json: differs from its hash"):
        Corpus.open(copy)
    seal_parts(copy)
    with (
        pytest.raises(InputError, match="generates other recordings; prepare it anew"),
        PartStream(Corpus.open(copy), 1, 3),
    ):
        pass
    (copy / "parts.json").write_text('{"parts": []}')
    seal_parts(copy)
    with pytest.raises(InputError, match=r"parts\.json: is damaged"):
        Corpus.open(copy)
    (copy / "parts.json").unlink()
    with pytest.raises(InputError, match=r"parts\.json: there is no such file"):
        Corpus.open(copy)
