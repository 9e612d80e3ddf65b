"""Files that replace earlier ones together, or not at all."""

import contextlib
import resource
from pathlib import Path

import pytest

from a2g_jax.errors import InputError, OutputError
from a2g_jax.io.files import atomic_path, check_folder_writable, disk_full
from a2g_jax.io.staging import staged
from tests.disk_for_tests import small_files


def names(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


@pytest.fixture
def earlier(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    for name in ("a.txt", "b.txt", "thesis.pdf"):
        (out / name).write_text("old")
    return out


def replaced(name):
    return name.endswith(".txt")


def test_files_move_together(earlier):
    with staged(earlier, replaced) as folder:
        (folder / "a.txt").write_text("new")
        (folder / "c.txt").write_text("new")
        assert folder.parent == earlier
        assert (earlier / "a.txt").read_text() == "old"
    assert names(earlier) == {"a.txt": "new", "c.txt": "new", "thesis.pdf": "old"}


@pytest.mark.parametrize("error", [ValueError, InputError, KeyboardInterrupt, MemoryError])
def test_after_an_error_all_is_as_before(earlier, error):
    def fail():
        with staged(earlier, replaced) as folder:
            (folder / "a.txt").write_text("new")
            raise error("no")

    with pytest.raises(error):
        fail()
    assert names(earlier) == dict.fromkeys(("a.txt", "b.txt", "thesis.pdf"), "old")


def test_a_new_folder_that_nothing_came_into_is_removed(tmp_path):
    def fail(out):
        with staged(out) as folder:
            (folder / "a.txt").write_text("new")
            raise KeyboardInterrupt

    for out in (tmp_path / "new", tmp_path):
        with pytest.raises(KeyboardInterrupt):
            fail(out)
    assert not (tmp_path / "new").exists()
    assert tmp_path.is_dir()


def test_what_is_refused_may_leave_what_was_before_it(earlier):
    def refuse(content):
        with staged(earlier, replaced, (InputError,)) as folder:
            if content:
                (folder / "c.txt").write_text(content)
            raise InputError("refused")

    for content in ("", "new"):
        with pytest.raises(InputError, match="refused"):
            refuse(content)
        expected = {"c.txt": "new"} if content else {"a.txt": "old", "b.txt": "old"}
        assert names(earlier) == expected | {"thesis.pdf": "old"}


def test_a_full_disk_leaves_the_earlier_files(earlier):
    def write(keep, atomic):
        with small_files(1000), staged(earlier, replaced, keep) as folder:
            (folder / "a.txt").write_text("new")
            with atomic_path(folder / "d.bin") if atomic else contextlib.nullcontext(folder / "d.bin") as path:
                path.write_bytes(bytes(2000))

    for keep in ((), (InputError,)):
        for atomic, name in ((True, r"out/d\.bin"), (False, "out")):
            with pytest.raises(OutputError, match=rf"{name}: cannot be written \(File too large\)") as caught:
                write(keep, atomic)
            assert disk_full(caught.value)
        assert names(earlier) == dict.fromkeys(("a.txt", "b.txt", "thesis.pdf"), "old")


def test_folders_that_cannot_be_written_to(tmp_path):
    (tmp_path / "file").write_text("")
    for path, message in (
        (tmp_path / "file", "is a file"),
        (tmp_path / "file" / "below" / "it", "file is a file"),
        (Path("/proc/nowhere/out"), r"/proc/nowhere/out: cannot be written"),
        (tmp_path / "a\0b", "not a usable path"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            check_folder_writable(path)
        assert "\n" not in str(caught.value)
    check_folder_writable(tmp_path / "new" / "er")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_the_limit_of_the_tests_is_lifted():
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with contextlib.suppress(ValueError), small_files(10):
        raise ValueError
    assert resource.getrlimit(resource.RLIMIT_FSIZE) == before
