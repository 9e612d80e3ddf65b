"""Files with a checksum of their own bytes, hashes of large files, and arrays read from changing files."""

import hashlib
import json
import os
import time

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.io import hashes
from a2g_jax.io.hashes import cached_sha256
from a2g_jax.io.sealed import read_sealed, seal_file, write_sealed
from a2g_jax.io.stored_array import StoredArray

VALUE = {"name": "naïve", "steps": 12, "rate": 1e-05, "list": [1, 2.5, None, True], "sha": "ab" * 32}


def test_every_changed_byte_and_every_cut_is_found(tmp_path):
    path = tmp_path / "a.json"
    write_sealed(path, VALUE)
    data = path.read_bytes()
    assert read_sealed(path) == VALUE
    broken = [data[:cut] for cut in range(len(data))]
    # Every byte, and every bit of a byte at some place.
    broken += [data[:at] + bytes([data[at] ^ (1 << at % 8)]) + data[at + 1 :] for at in range(len(data))]
    broken += [data[:at] + b" " + data[at:] for at in range(0, len(data) + 1, 3)] + [data + b"\n"]
    for changed in broken:
        path.write_bytes(changed)
        with pytest.raises(InputError, match=r"a\.json"):
            read_sealed(path, ("sha",))


def test_what_is_accepted(tmp_path):
    path = tmp_path / "a.json"
    write_sealed(path, VALUE)
    # Version control may have changed the ends of lines.
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_sealed(path) == VALUE
    path.write_text(json.dumps({**VALUE, "steps": 13, "checksum": None}))
    assert read_sealed(path)["steps"] == 13
    seal_file(path)
    assert read_sealed(path, ("sha",))["steps"] == 13
    # Of a version without checksums.
    path.write_text(json.dumps(VALUE))
    assert read_sealed(path) == VALUE
    with pytest.raises(InputError, match="it has 'sha' and no checksum"):
        read_sealed(path, ("sha",))
    write_sealed(path, VALUE)
    path.write_text(json.dumps(json.loads(path.read_text())))
    with pytest.raises(InputError, match='"checksum": null'):
        read_sealed(path)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A folder for the cache, files that count as settled at once, and a count of the files that are read."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(hashes, "_SETTLED", -1.0)
    read = []

    def blocks(path):
        read.append(path)
        return hashlib.sha256(path.read_bytes()).hexdigest()

    monkeypatch.setattr(hashes, "sha256_blocks", blocks)
    return read


def test_files_are_read_again_only_when_they_may_have_changed(tmp_path, cache):
    path = tmp_path / "a.npy"
    path.write_bytes(b"abc")
    first = cached_sha256(path)
    assert (cached_sha256(path), len(cache)) == (first, 1)
    assert (cached_sha256(path, force=True), len(cache)) == (first, 2)
    times = path.stat()
    path.write_bytes(b"abd")
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))  # nothing but the time of the entry's change differs
    assert cached_sha256(path) != first
    os.replace(path, tmp_path / "b.npy")  # noqa: PTH105
    (tmp_path / "b.npy").rename(path)
    assert cached_sha256(path) != first
    assert len(cache) == 4


def test_folders_side_by_side_keep_their_own(tmp_path, cache):
    """As corpora and runs do, whose files have the same names."""
    paths = [tmp_path / folder / "a.npy" for folder in ("one", "two")]
    for path in paths:
        path.parent.mkdir()
        path.write_bytes(path.parent.name.encode())
    first = [cached_sha256(path) for path in paths]
    assert [cached_sha256(path) for path in paths] == first
    assert len(cache) == 2


def test_a_damaged_cache_or_none_costs_time_alone(tmp_path, cache, monkeypatch):
    path = tmp_path / "a.npy"
    path.write_bytes(b"abc")
    first = cached_sha256(path)
    (store,) = (tmp_path / "cache" / "a2g_jax" / "hashes").iterdir()
    for text in (store.read_text().replace(first[:8], "0" * 8), "{", "[]", ""):
        store.write_text(text)
        assert cached_sha256(path) == first
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nowhere")
    assert cached_sha256(path) == first
    with pytest.raises(InputError, match="cannot be read"):
        cached_sha256(tmp_path / "none.npy")


def test_files_that_changed_just_now_are_not_remembered(tmp_path, cache, monkeypatch):
    monkeypatch.setattr(hashes, "_SETTLED", 2.0)
    path = tmp_path / "a.npy"
    path.write_bytes(b"abc")
    cached_sha256(path)
    cached_sha256(path)
    assert len(cache) == 2
    assert time.time() - path.stat().st_mtime < 2.0 or len(cache) == 2


def test_pieces_of_stored_arrays(tmp_path):
    path, whole = tmp_path / "a.npy", np.arange(60, dtype=np.float32).reshape(10, 3, 2)
    np.save(path, whole)
    array = StoredArray(path)
    assert (array.shape, array.dtype, len(array), array.ndim, array.nbytes) == ((10, 3, 2), np.float32, 10, 3, 240)
    rng = np.random.default_rng(0)
    for index in (
        *(slice(2, 7), slice(None), slice(7, 2), slice(-3, None), slice(1, 9, 3), slice(None, None, -1)),
        *(3, -1, [1, 5, 5], np.array([[0, 2], [9, 1]]), np.arange(10) % 2 == 0, np.array([], int)),
        *((slice(1, 4), 2), (3, 1), (slice(None), slice(0, 2), 1), np.int64(4), rng.integers(0, 10, 5)),
    ):
        np.testing.assert_array_equal(array[index], whole[index])
    np.testing.assert_array_equal(np.asarray(array), whole)
    assert np.asarray(array, np.float64).dtype == np.float64
    with pytest.raises(IndexError):
        array[10]
    array[:2][:] = 7  # pieces are copies
    np.testing.assert_array_equal(array[:2], whole[:2])


@pytest.mark.parametrize(
    "change",
    [
        lambda path: os.truncate(path, 200),
        lambda path: os.truncate(path, 0),
        lambda path: path.write_bytes(path.read_bytes() + b"more"),
        lambda path: path.write_bytes(path.read_bytes()[:-1] + b"\x01"),
    ],
)
def test_a_file_that_changes_under_its_reader_is_one_error(tmp_path, change):
    path = tmp_path / "a.npy"
    np.save(path, np.zeros((100, 3), np.float32))
    array = StoredArray(path)
    array[0:10]
    os.utime(path, ns=(0, 0))
    array = StoredArray(path)
    change(path)
    for read in (lambda: array[0], lambda: array[90:], lambda: np.asarray(array)):
        with pytest.raises(InputError, match=r"a\.npy: was changed while it was in use") as caught:
            read()
        assert "\n" not in str(caught.value)


def test_a_file_that_is_replaced_under_its_reader_is_read_on(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, np.ones((100, 3), np.float32))
    array = StoredArray(path)
    np.save(tmp_path / "b.npy", np.zeros((5, 3), np.float32))
    (tmp_path / "b.npy").replace(path)
    assert array[50:60].sum() == 30


def test_stored_arrays_that_cannot_be_used(tmp_path):
    path = tmp_path / "a.npy"
    for value in (np.array(["a"]), np.array([{}], object), np.float32(1.0), np.asfortranarray(np.zeros((2, 3)))):
        np.save(path, value, allow_pickle=True)
        with pytest.raises(InputError, match="cannot be read"):
            StoredArray(path)
    np.save(path, np.zeros((4, 3)))
    data = path.read_bytes()
    for broken in (b"", data[:50], data[:-1], data + b"0", b"x" + data[1:]):
        path.write_bytes(broken)
        with pytest.raises(InputError, match=r"a\.npy"):
            StoredArray(path)
