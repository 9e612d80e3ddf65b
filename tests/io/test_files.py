import json
import os
from pathlib import Path

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.io.files import atomic_path, check_readable, read_json, sha256_file, write_json


def test_atomic_path_replaces_the_file_and_leaves_nothing_else(tmp_path):
    target = tmp_path / "new" / "motion.bvh"
    with atomic_path(target) as temporary:
        assert temporary.parent == target.parent
        assert temporary.suffix == ".bvh"
        temporary.write_text("one")
        assert not target.exists()
    with atomic_path(target) as temporary:
        temporary.write_text("two")
        assert target.read_text() == "one"
    assert target.read_text() == "two"
    assert list(target.parent.iterdir()) == [target]


def test_atomic_path_keeps_the_old_file_when_writing_fails(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("old")

    def interrupted():
        with atomic_path(target) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_atomic_path_makes_files_readable_as_usual(tmp_path):
    plain, target = tmp_path / "plain", tmp_path / "target"
    plain.write_text("")
    with atomic_path(target) as temporary:
        temporary.write_text("")
    assert target.stat().st_mode == plain.stat().st_mode


def test_atomic_path_writes_through_links(tmp_path):
    (tmp_path / "real").mkdir()
    target = tmp_path / "real" / "a.txt"
    target.write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to(target)
    with atomic_path(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert target.read_text() == "new"


@pytest.mark.parametrize(
    ("path", "message"), [(".", "is a folder"), ("/dev/null", "not an ordinary file"), ("file/x", "cannot be written")]
)
def test_atomic_path_refuses(tmp_path, path, message):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=message), atomic_path(tmp_path / path) as temporary:
        temporary.write_text("never")
    assert not Path("/dev/null").is_file()


def test_atomic_path_leaves_foreign_errors_alone(tmp_path):
    with pytest.raises(FileNotFoundError), atomic_path(tmp_path / "a"):
        (tmp_path / "other" / "b").open()


def test_check_readable(tmp_path):
    (tmp_path / "empty.wav").touch()
    os.mkfifo(tmp_path / "pipe")
    for name, message in [
        ("none.wav", "no such file"),
        ("", "is a folder; name an audio file in it"),
        ("empty.wav", r"is empty \(0 bytes\); expected an audio file"),
        ("pipe", "not an ordinary file"),
        ("a\0b", "not a usable path"),
        ("a" * 300, "cannot be read"),
    ]:
        with pytest.raises(InputError, match=message) as caught:
            check_readable(tmp_path / name, "an audio file")
        assert "\n" not in str(caught.value)


def test_sha256_file(tmp_path):
    path = tmp_path / "abc"
    path.write_bytes(b"abc")
    assert sha256_file(path) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    with pytest.raises(InputError, match="cannot be read"):
        sha256_file(tmp_path / "none")


def test_json_round_trip(tmp_path):
    path = tmp_path / "a.json"
    write_json(path, {"loss": np.float32(0.5), "ids": np.arange(3), "path": Path("x"), "name": "naïve", "none": None})
    assert read_json(path) == {"loss": 0.5, "ids": [0, 1, 2], "path": "x", "name": "naïve", "none": None}
    assert path.read_bytes().endswith(b"}\n")


@pytest.mark.parametrize("value", [float("nan"), np.inf, {"a": object()}])
def test_write_json_refuses_what_json_cannot_hold(tmp_path, value):
    with pytest.raises((ValueError, TypeError)):
        write_json(tmp_path / "a.json", value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b'{"a": 1,\n "b" 2}', "line 2, column 6: is not JSON"),
        (b"\xff\xfe", "is not UTF-8"),
        (b"[NaN]", "contains NaN"),
        (b"[" * 100_000, "nested too deeply"),
        (b"9" * 10_000, "cannot be read as JSON"),
    ],
)
def test_read_json_refuses(tmp_path, data, message):
    path = tmp_path / "a.json"
    path.write_bytes(data)
    with pytest.raises(InputError, match=message) as caught:
        read_json(path)
    assert str(path) in str(caught.value)


def test_read_json_takes_a_byte_order_mark(tmp_path):
    (tmp_path / "a.json").write_bytes(b"\xef\xbb\xbf" + json.dumps([1]).encode())
    assert read_json(tmp_path / "a.json") == [1]
