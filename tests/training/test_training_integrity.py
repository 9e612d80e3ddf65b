"""A training whose log, folder, corpus or disk fails ends in one error, and resumes to the same end."""

import os
import shutil
import subprocess
import sys

import jax
import numpy as np
import pytest
from integrity_for_tests import names

from a2g_jax.errors import InputError, OutputError
from a2g_jax.inspection.inspect import inspect
from a2g_jax.training import loop
from a2g_jax.training.loop import train
from a2g_jax.training.run import load_run
from tests.disk_for_tests import small_files


@pytest.fixture(scope="module")
def trained(toy_corpus, toy_run_config, tmp_path_factory):
    """A run of ten steps with two checkpoints, to be copied, and its configuration."""
    folder = tmp_path_factory.mktemp("trained") / "run"
    config = toy_run_config(steps=10, checkpoint_every=5, validate_every=5, log_every=2, device_megabytes=0.0)
    train(config, toy_corpus, folder, resume=False, progress=False)
    return folder, config


def test_a_damaged_log_is_named(trained, toy_corpus, tmp_path):
    folder = shutil.copytree(trained[0], tmp_path / "run")
    assert names(folder) == ["checkpoints", "metrics.jsonl", "run.json", "weights.safetensors"]
    data = (folder / "metrics.jsonl").read_bytes()
    for changed in (data[:20] + b"9" + data[21:], data[: len(data) // 2], data[:-1], b""):
        (folder / "metrics.jsonl").write_bytes(changed)
        with pytest.raises(InputError, match=r"metrics\.jsonl: its first [0-9]+ bytes differ"):
            train(trained[1], toy_corpus, folder, resume=True, progress=False)
        assert "damaged" in {finding.code for finding in inspect(folder).findings}
    (folder / "metrics.jsonl").unlink()
    train(trained[1], toy_corpus, folder, resume=True, progress=False)
    (folder / "metrics.jsonl").write_bytes(data)


def test_a_second_training_in_the_same_folder_is_refused(trained, toy_corpus, tmp_path, monkeypatch):
    folder = shutil.copytree(trained[0], tmp_path / "run")
    code = "import sys, time\nfrom pathlib import Path\nfrom a2g_jax.io.locks import locked\n"
    code += "with locked(Path(sys.argv[1]), 'x'):\n    print('holding', flush=True)\n    time.sleep(100)"
    process = subprocess.Popen([sys.executable, "-c", code, str(folder / ".lock")], stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    before = names(folder)
    with pytest.raises(InputError, match=rf"run: is being trained by another process \(process {process.pid} on "):
        train(trained[1], toy_corpus, folder, resume=True, progress=False)
    assert names(folder) == before
    process.kill()
    process.communicate()
    train(trained[1], toy_corpus, folder, resume=True, progress=False)
    assert ".lock" not in names(folder)


def test_a_corpus_that_changes_under_a_training_is_one_error(toy_corpus, trained, tmp_path, monkeypatch):
    from a2g_jax.data.corpus import Corpus

    corpus = shutil.copytree(toy_corpus.path, tmp_path / "corpus")
    original = loop.MetricsLog.tick

    def tick(self, done):
        original(self, done)
        if done == 3:
            os.truncate(corpus / "pose.npy", 5000)

    monkeypatch.setattr(loop.MetricsLog, "tick", tick)
    with pytest.raises(InputError, match=r"corpus/pose\.npy: was changed while it was in use"):
        train(trained[1], Corpus.open(corpus), tmp_path / "run", resume=False, progress=False)


@pytest.mark.slow
@pytest.mark.parametrize("largest", [pytest.param(600, marks=pytest.mark.slow), 9000, None])
def test_a_full_disk_while_training(toy_corpus, trained, tmp_path, largest):
    """At the log, a checkpoint or the weights: one line, and after it the training resumes to the same end."""
    config = trained[1]
    whole, out = load_run(trained[0]), tmp_path / "run"
    weights = (trained[0] / "weights.safetensors").stat().st_size
    with pytest.raises(OutputError, match="cannot be written .*File too large"), small_files(largest or weights - 10):
        train(config, toy_corpus, out, resume=False, progress=False)
    assert not [path for path in out.rglob("*") if "a2g-" in path.name or "saving" in path.name]
    resumed = train(config, toy_corpus, out, resume=True, progress=False)
    assert all(jax.tree.leaves(jax.tree.map(lambda a, b: bool(np.array_equal(a, b)), whole.params, resumed.params)))
    assert (out / "metrics.jsonl").read_text() == (trained[0] / "metrics.jsonl").read_text()
    assert names(out) == names(trained[0])
