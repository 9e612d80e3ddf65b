"""Nothing damaged in a checkpoint is used, and a save that fails keeps those there are."""

import contextlib
import errno
import os
import shutil
import threading
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from integrity_for_tests import changes, names

from a2g_jax.errors import InputError, OutputError
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.state import TrainState
from tests.disk_for_tests import small_files


def state(step: int, size: int = 3000) -> TrainState:
    params = {"net": {"w": jax.random.normal(jax.random.key(step), (size,))}}
    return TrainState(params, {"o": (jnp.zeros(3),)}, jnp.int32(step), jax.random.key(3), jnp.array(True))


@pytest.fixture
def checkpoints(tmp_path):
    found = Checkpoints(tmp_path / "checkpoints", 2)
    for step in (10, 20, 30):
        found.save(state(step))
    return found


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
