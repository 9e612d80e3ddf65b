"""Nothing damaged in a run or a checkpoint is used; one training at a time; full disks; gradients of zero."""

import contextlib
import dataclasses
import errno
import json
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import a2g_jax
from a2g_jax.errors import InputError, OutputError
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.sealed import seal_file
from a2g_jax.training import loop, run_hashes
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.loop import train
from a2g_jax.training.run import load_run, save_run
from a2g_jax.training.run_file import SHIPPED
from a2g_jax.training.state import TrainState
from a2g_jax.training.vanished import zero_gradient
from tests.disk_for_tests import small_files

PACKAGE = Path(a2g_jax.__file__).parent


def changes(data: bytes, rng, count: int) -> list[bytes]:
    """The bytes with single bits changed, blocks of zeros, and cuts."""
    if not data:
        return [b"x"]
    places = [0, len(data) - 1, *rng.integers(0, len(data), count).tolist()]
    flipped = [data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :] for at in places]
    at = len(data) // 2
    zeroed = data[:at] + bytes(min(4096, len(data) - at)) + data[at + 4096 :]
    return [*flipped, zeroed, data[:-1], data[: len(data) // 3], b"", data + b"\n"]


@pytest.fixture
def run_folder(tmp_path):
    return shutil.copytree(PACKAGE / "demo_features", tmp_path / "run")


def test_changed_bits_and_cuts_of_a_run_are_named(run_folder):
    before, rng = load_run(run_folder), np.random.default_rng(0)
    for name in ("run.json", "weights.safetensors"):
        data = (run_folder / name).read_bytes()
        for changed in changes(data, rng, 6):
            (run_folder / name).write_bytes(changed)
            if changed == data:
                continue
            with pytest.raises(InputError, match=name) as caught:
                load_run(run_folder)
            assert "\n" not in str(caught.value)
        (run_folder / name).write_bytes(data)
    # Weights of another run of the same shapes.
    save_run(run_folder, dataclasses.replace(before, params=jax.tree.map(lambda x: 2 * x, before.params)))
    shutil.copy(PACKAGE / "demo_features" / "weights.safetensors", run_folder)
    with pytest.raises(InputError, match=r"weights\.safetensors: differs from its hash in run\.json"):
        load_run(run_folder)


@pytest.mark.parametrize("name", ["demo", "demo_flow", "demo_features"])
def test_the_shipped_runs_have_hashes(name):
    about = json.loads((PACKAGE / name / "run.json").read_text())
    assert len(about["weights_sha256"]) == len(about["checksum"]) == 64
    load_run(PACKAGE / name)


def test_runs_of_version_0_1_are_read(run_folder):
    about = json.loads((run_folder / "run.json").read_text())
    for name in ("weights_sha256", "log", "checksum"):
        del about[name]
    (run_folder / "run.json").write_text(json.dumps(about))
    assert load_run(run_folder).steps == about["steps"]


def test_an_edited_description_is_refused_until_the_edit_is_accepted(run_folder):
    path = run_folder / "run.json"
    about = json.loads(path.read_text())
    about["steps"] += 1
    path.write_text(json.dumps(about, indent=2))
    with pytest.raises(InputError, match=r'run\.json: differs from its checksum.*"checksum": null'):
        load_run(run_folder)
    path.write_text(json.dumps({**about, "checksum": None}))
    assert load_run(run_folder).steps == about["steps"]
    seal_file(path)
    assert load_run(run_folder).steps == about["steps"]


class KilledError(Exception):
    """In place of a kill."""


def test_at_every_moment_of_saving_the_run_can_be_loaded(run_folder, monkeypatch):
    """Old weights with their number of steps, or new ones with theirs."""
    old = load_run(run_folder)
    new = dataclasses.replace(old, steps=old.steps + 7, params=jax.tree.map(lambda x: x + 1, old.params))
    key = next(iter(old.params))
    original, seen = os.replace, set()
    for moment in range(6):
        calls = 0

        def replace(source, target, moment=moment):
            nonlocal calls
            calls += 1
            if calls > moment:
                raise KilledError
            return original(source, target)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", replace)
            with contextlib.suppress(KilledError):
                save_run(run_folder, new)
        found = load_run(run_folder)
        first = jax.tree.leaves(found.params[key])[0]
        which = "new" if np.array_equal(first, jax.tree.leaves(new.params[key])[0]) else "old"
        assert found.steps == {"old": old.steps, "new": new.steps}[which]
        seen.add((moment, which))
        save_run(run_folder, old)
    assert {which for _, which in seen} == {"old", "new"}


def test_a_run_can_be_loaded_while_it_is_saved(run_folder, monkeypatch):
    """The reader has old weights and then the new description."""
    old = load_run(run_folder)
    new = dataclasses.replace(old, steps=old.steps + 7, params=jax.tree.map(lambda x: x + 1, old.params))
    original, times = run_hashes._bytes, 0

    def bytes_of(weights):
        nonlocal times
        data, times = original(weights), times + 1
        if times == 1:
            save_run(run_folder, new)
        return data

    monkeypatch.setattr(run_hashes, "_bytes", bytes_of)
    assert load_run(run_folder).steps == new.steps


def state(step: int, size: int = 3000) -> TrainState:
    params = {"net": {"w": jax.random.normal(jax.random.key(step), (size,))}}
    return TrainState(params, {"o": (jnp.zeros(3),)}, jnp.int32(step), jax.random.key(3), jnp.array(True))


@pytest.fixture
def checkpoints(tmp_path):
    found = Checkpoints(tmp_path / "checkpoints", 2)
    for step in (10, 20, 30):
        found.save(state(step))
    return found


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_changed_missing_and_added_files_of_a_checkpoint_are_named(checkpoints):
    assert names(checkpoints.folder) == ["20", "20.json", "30", "30.json"]
    assert int(checkpoints.restore(state(0)).step) == 30
    rng, latest = np.random.default_rng(0), checkpoints.folder / "30"
    files = [path for path in (*latest.rglob("*"), checkpoints.folder / "30.json") if path.is_file()]
    assert len(files) > 5

    def refused(path):
        with pytest.raises(InputError, match=rf"checkpoints/30: cannot be resumed from \(.*{path.name}") as caught:
            checkpoints.restore(state(0))
        assert "\n" not in str(caught.value)

    for path in files:
        data = path.read_bytes()
        for changed in changes(data, rng, 2):
            if changed != data:
                path.write_bytes(changed)
                refused(path)
        path.unlink()
        refused(path)
        path.write_bytes(data)
        extra = path.with_name("extra") if path.parent != checkpoints.folder else latest / "extra"
        extra.write_bytes(b"")
        refused(extra)
        extra.unlink()
    assert int(checkpoints.restore(state(0)).step) == 30
    shutil.rmtree(latest)
    assert int(checkpoints.restore(state(0)).step) == 20


@pytest.mark.parametrize("size", [0, 500, 8000])
def test_a_full_disk_keeps_the_checkpoints_there_are(checkpoints, size):
    message = r"checkpoints/40: cannot be written \(File too large\); that of step 30"
    with pytest.raises(OutputError, match=message), small_files(size):
        checkpoints.save(state(40))
    assert names(checkpoints.folder) == ["20", "20.json", "30", "30.json"]
    assert int(checkpoints.restore(state(0)).step) == 30
    checkpoints.save(state(40))
    assert names(checkpoints.folder) == ["30", "30.json", "40", "40.json"]


def test_what_threads_write_after_a_failed_save_is_removed(checkpoints, monkeypatch):
    def write(path):
        for number in range(20):
            with contextlib.suppress(FileNotFoundError):  # removed meanwhile
                (path / "part" / str(number)).mkdir(parents=True)
            time.sleep(0.02)

    writers = []

    def fails(path, tree):
        writers.append(threading.Thread(target=write, args=(Path(path),)))
        writers[0].start()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("a2g_jax.training.checkpoint.ocp.save", fails)
    with pytest.raises(OutputError, match="checkpoints/40: cannot be written"):
        checkpoints.save(state(40))
    writers[0].join()
    assert names(checkpoints.folder) == ["20", "20.json", "30", "30.json"]


def test_a_disk_without_room_is_found_before_writing(checkpoints, monkeypatch):
    usage = shutil.disk_usage(checkpoints.folder)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage._replace(free=1000))
    with pytest.raises(OutputError, match=r"checkpoints/40: cannot be written \(No space left on device\)"):
        checkpoints.save(state(40))


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


def lines(*norms):
    return [{"step": 10 * (n + 1), "split": "train", **norm} for n, norm in enumerate(norms)]


def test_gradients_of_zero_are_found_in_logs():
    one = lambda *values: zero_gradient(lines(*({"gradient_norm": value} for value in values)))  # noqa: E731
    assert one() is None
    assert one(1.0, 0.5) is None
    assert one(1.0, 0.0, 0.5) is None
    assert one(1.0, 0.0, 0.0) == (20, "")
    two = lambda *pairs: zero_gradient(  # noqa: E731
        lines(*({"gradient_norm_g": g, "gradient_norm_d": d} for g, d in pairs))
    )
    assert two((1.0, 0.0), (1.0, 0.0)) is None
    assert two((1.0, 0.0), (1.0, 0.0), (1.0, 0.0)) == (10, "d")
    assert two((1.0, 1.0), (0.0, 0.0)) == (20, "")


def test_a_training_that_has_died_is_mentioned(tmp_path, capsys):
    zeros = loop.ZeroGradients(tmp_path / "run")
    for step, norm in ((5, 1.0), (10, 0.0), (15, 0.0)):
        zeros.note(step, {"loss": 1.0, "gradient_norm": norm})
    said = capsys.readouterr().err.splitlines()
    assert said == [
        f"{tmp_path / 'run'}: the gradient is exactly zero since step 10, so nothing is learned any more; start again"
        " with a lower --learning-rate or another --seed."
    ]


def test_inspect_mentions_a_training_that_has_died(run_folder):
    rows = lines({"loss": 1.0, "gradient_norm": 0.1}, {"loss": 1.0, "gradient_norm": 0.0})
    (run_folder / "metrics.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    (found,) = (finding for finding in inspect(run_folder).findings if finding.code == "zero-gradient")
    assert (found.severity, found.value) == ("warning", 20.0)


@pytest.mark.parametrize(
    "change",
    [
        {"pose": "other\n"},
        {"corpus": "text"},
        {"model": "a" * 100_000},
        {"version": [0] * 10_000},
        {"fps": "a"},
        {"model_config": {"unknown": 1}},
        {"train_config": [1]},
    ],
)
def test_values_of_other_types_in_run_json_are_one_line_with_its_name(run_folder, change):
    values = json.loads((run_folder / "run.json").read_text())
    (run_folder / "run.json").write_text(json.dumps({**values, **change, "checksum": None}))
    with pytest.raises(InputError) as error:
        load_run(run_folder)
    assert str(run_folder) in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 2500 + len(str(run_folder))


@pytest.mark.parametrize("name", SHIPPED)
def test_shapes_of_the_weights_of_the_package_are_right(name):
    """They are not compared whenever one opens them, which takes a second."""
    load_run(PACKAGE / SHIPPED[name], check_shapes=True)
