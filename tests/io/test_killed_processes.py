"""What ended processes leave: temporary files and locks; and what belongs to living ones."""

import json
import os
import signal
import subprocess
import sys
import textwrap

import pytest

from a2g_jax.errors import InputError
from a2g_jax.io import temporary
from a2g_jax.io.files import atomic_path
from a2g_jax.io.locks import locked
from a2g_jax.io.processes import Process, host_digits, started, this_process
from a2g_jax.io.temporary import owner, sweep, temporary_path


@pytest.fixture
def ended():
    """A process of this host that is no more."""
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    found = Process(host_digits(), process.pid, started(process.pid))
    process.communicate(b"\n")
    return found


def name_of(process, stem="sample_00", suffix=".npz"):
    return f".{stem}.a2g-{process.host}-{process.pid}-{process.start}-{'ab' * 6}{suffix}"


def test_temporary_names_say_whose_they_are(tmp_path):
    path = temporary_path(tmp_path / "sample_00.npz")
    assert (path.parent, path.suffix, path.name[0]) == (tmp_path, ".npz", ".")
    assert owner(path.name) == this_process()
    assert this_process().alive
    for name in ("sample_00.npz", ".sample_00.0123456789ab.npz", ".a2g-x", ".lock"):
        assert owner(name) is None


def test_files_of_ended_processes_are_removed_and_no_others(tmp_path, ended, monkeypatch):
    monkeypatch.setattr(temporary, "_swept", set())
    living = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        reused = Process(host_digits(), living.pid, "00000000")  # of an earlier process with that number
        keep = {
            name_of(Process(host_digits(), living.pid, started(living.pid))),
            name_of(Process("00000000", ended.pid, ended.start)),  # of another host
            name_of(this_process()),
            "sample_00.npz",
            ".hidden",
        }
        for name in (*keep, name_of(ended), name_of(ended, "x", ""), name_of(reused)):
            (tmp_path / name).write_text("")
        (tmp_path / name_of(ended, "files", "")).unlink(missing_ok=True)
        (tmp_path / name_of(ended, "files", "")).mkdir()
        (tmp_path / name_of(ended, "files", "") / "a").write_text("")
        with atomic_path(tmp_path / "new.txt") as path:
            path.write_text("")
        assert {path.name for path in tmp_path.iterdir()} == {*keep, "new.txt"}
    finally:
        living.communicate(b"\n")


_WRITER = """
import sys, time
from a2g_jax.io.files import atomic_path
with atomic_path(sys.argv[1]) as path:
    path.write_text("half")
    print("writing", flush=True)
    time.sleep(60)
"""


def test_a_killed_writer_leaves_nothing_once_the_next_one_has_written(tmp_path, monkeypatch):
    target = tmp_path / "a.txt"
    target.write_text("old")
    process = subprocess.Popen([sys.executable, "-c", _WRITER, str(target)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    monkeypatch.setattr(temporary, "_swept", set())
    sweep(tmp_path)
    assert len(list(tmp_path.iterdir())) == 2  # it lives
    process.send_signal(signal.SIGKILL)
    process.communicate()
    monkeypatch.setattr(temporary, "_swept", set())
    with atomic_path(tmp_path / "b.txt") as path:
        path.write_text("new")
    assert {path.name for path in tmp_path.iterdir()} == {"a.txt", "b.txt"}
    assert target.read_text() == "old"


_HOLDER = """
import sys, time
from pathlib import Path
from a2g_jax.io.locks import locked
with locked(Path(sys.argv[1]), "x"):
    print("holding", flush=True)
    time.sleep(60)
"""


def test_a_lock_names_its_holder_and_ends_with_it(tmp_path):
    path = tmp_path / ".lock"
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(_HOLDER), str(path)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    message = rf"run: is being trained by another process \(process {process.pid} on {os.uname().nodename}, since 20"
    with pytest.raises(InputError, match=message), locked(path, "run: is being trained"):
        pass
    process.send_signal(signal.SIGSTOP)
    with pytest.raises(InputError, match=message), locked(path, "run: is being trained"):
        pass
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert path.exists()
    with locked(path, "run: is being trained"):
        assert json.loads(path.read_text())["pid"] == os.getpid()
    assert not path.exists()


def test_without_locks_of_the_file_system_the_content_decides(tmp_path, ended, monkeypatch):
    def unsupported(*_arguments):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr("fcntl.flock", unsupported)
    path = tmp_path / ".lock"
    holder = {"pid": os.getppid(), "host": "here", "since": "now", "key": host_digits(), "start": started(os.getppid())}
    path.write_text(json.dumps(holder))
    with pytest.raises(InputError, match=f"process {os.getppid()} on here"), locked(path, "x: is busy"):
        pass
    for taken in (ended._asdict(), {"pid": os.getppid(), "start": "00000000"}):
        path.write_text(json.dumps({**holder, "pid": taken["pid"], "start": taken["start"]}))
        with locked(path, "x: is busy"):
            assert json.loads(path.read_text())["pid"] == os.getpid()
    for text in ("", "no JSON", "[1]"):  # a full disk
        path.write_text(text)
        with locked(path, "x: is busy"):
            pass
