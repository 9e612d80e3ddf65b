import io
import struct
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted import Limits, read_npy, read_npz
from tests.io.fuzz_for_tests import damaged, peak_memory
from tests.io.untrusted_checks import Calls, assert_plain, check_message, same

ARRAYS = {
    "poses": np.arange(24.0).reshape(2, 3, 4),
    "fortran": np.asfortranarray(np.ones((3, 2), np.float32)),
    "big": np.arange(4, dtype=">i2"),
    "flags": np.array([True, False]),
    "gender": np.array("neutral"),
    "names": np.array(["a", "bü"]),
    "bytes": np.array([b"ab"]),
    "fps": np.array(30),
    "empty": np.zeros((0, 5)),
    "half": np.float16([1.5]),
    "complex": np.array([1j]),
}

#: What is read of an archive at once.
PIECE = 2**20


def npy(array, version=None, pickled=False) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array(file, np.asanyarray(array), version, allow_pickle=pickled)
    return file.getvalue()


def with_header(text: str, content: bytes = b"", version: int = 1) -> bytes:
    size = struct.pack("<H" if version == 1 else "<I", len(text))
    return b"\x93NUMPY" + bytes([version, 0]) + size + text.encode("latin-1") + content


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_what_numpy_saves_is_read_back(name, version, tmp_path):
    path = tmp_path / "a.npy"
    path.write_bytes(npy(ARRAYS[name], version))
    found = read_npy(path)
    assert same(found, ARRAYS[name])
    assert found.flags.writeable


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_archives(save, tmp_path):
    path = tmp_path / "a.npz"
    save(path, **ARRAYS)
    found = read_npz(path)
    assert list(found) == list(ARRAYS)
    assert all(same(found[name], ARRAYS[name]) for name in ARRAYS)
    assert list(read_npz(path, ["fps", "names"])) == ["fps", "names"]
    with pytest.raises(InputError, match=r"has no array 'nope'; it has 'poses', .* and more"):
        read_npz(path, ["fps", "nope"])
    with pytest.raises(InputError, match="would take more than 900 bytes"):
        read_npz(path, limits=Limits(size=900))


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_arrays_larger_than_a_piece(save, tmp_path):
    path = tmp_path / "a.npz"
    array = np.random.default_rng(0).standard_normal(400_000)
    save(path, a=array)
    assert same(read_npz(path)["a"], array)


def test_old_headers(tmp_path):
    path = tmp_path / "a.npy"
    for text in (
        "{'descr': '<i2', 'fortran_order': False, 'shape': (2L,), }  \n",
        "{'shape': (2,), 'fortran_order': False, 'descr': '<i2'}",
    ):
        path.write_bytes(with_header(text, b"\1\0\2\0"))
        assert same(read_npy(path), np.array([1, 2], "<i2"))


def test_python_objects_only_where_allowed_and_plain(tmp_path):
    path = tmp_path / "a.npy"
    array = np.array([[1, "a"], [None, [2.5, {"b": (3,)}]]], object)
    path.write_bytes(npy(array, pickled=True))
    with pytest.raises(InputError, match="Python objects, which are not allowed"):
        read_npy(path)
    assert same(read_npy(path, objects=True), array)
    canary = tmp_path / "canary"
    path.write_bytes(npy(np.array([Calls(eval, f"open({str(canary)!r}, 'w')")], object), pickled=True))
    for objects in (False, True):
        with pytest.raises(InputError, match="builtins.eval|Python objects"):
            read_npy(path, objects=objects)
    np.savez(tmp_path / "a.npz", a=np.array([Calls(eval, f"open({str(canary)!r}, 'w')")], object))
    with pytest.raises(InputError, match="'a.npy', byte .*'builtins.eval', which is refused"):
        read_npz(tmp_path / "a.npz", objects=True)
    assert not canary.exists()
    np.load(path, allow_pickle=True)
    assert canary.exists()  # NumPy's own reader runs it


HEADERS = {
    "an array of records": "{'descr': [('a', '<i4')], 'fortran_order': False, 'shape': (2,), }",
    "an array of type '<M8[D]'": "{'descr': '<M8[D]', 'fortran_order': False, 'shape': (2,), }",
    "an array of type '<g16'": "{'descr': '<g16', 'fortran_order': False, 'shape': (2,), }",
    "an array of type 'U999999999'": "{'descr': 'U999999999', 'fortran_order': False, 'shape': (0,), }",
    "beyond the limit": "{'descr': '<i4', 'fortran_order': False, 'shape': (99999999999,), }",
    "beyond the limit.": "{'descr': '<i4', 'fortran_order': False, 'shape': (0, 99999999999,), }",
    "takes 8000000000 bytes and has 0": "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000,), }",
    "up to 32 whole numbers": f"{{'descr': '<i4', 'fortran_order': False, 'shape': ({'1,' * 33}), }}",
    "not as numpy.save writes it": "{'descr': '<i4', 'fortran_order': __import__('os'), 'shape': (2,), }",
    "not as numpy.save": "{'descr': '<i4', 'descr': '<i4', 'shape': (2,), }",
    "its header is": "{'descr': '<i4', 'fortran_order': False, 'shape': (-2,), }",
    "its header": "[" * 5000,
}


@pytest.mark.parametrize("name", HEADERS)
def test_headers_that_are_refused(name, tmp_path):
    path = tmp_path / "a.npy"
    path.write_bytes(with_header(HEADERS[name]))
    with pytest.raises(InputError) as error:
        read_npy(path)
    assert name in str(error.value)
    assert peak_memory(read_npy, path) < 100_000


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"x", "is not a NumPy array"),
        (b"\x93NUMPY\x09\x00\x10\x00" + b" " * 20, "format 9.0"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\x7f" + b" " * 20, "a header of 2147483647 bytes"),
        (with_header("{'descr': '|b1', 'fortran_order': False, 'shape': (2,), }", b"\x01\x02"), "boolean"),
        (with_header("{'descr': '<U1', 'fortran_order': False, 'shape': (), }", b"\xff\xff\xff\xff"), "not Unicode"),
        (
            with_header("{'descr': '|u1', 'fortran_order': False, 'shape': (1,), }", b"\x01\x02"),
            "takes 1 bytes and has 2",
        ),
    ],
)
def test_damage_is_named(data, match, tmp_path):
    path = tmp_path / "a.npy"
    path.write_bytes(data)
    with pytest.raises(InputError, match=match):
        read_npy(path)


def write_zip(path, members, method=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, data in members.items():
            archive.writestr(name, data)


def claim(path, size):
    """Let the archive's list of members announce another unpacked size for the first one."""
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.index(b"PK\1\2") + 24, size)
    path.write_bytes(data)


def test_bombs_stop_at_the_limit(tmp_path):
    path = tmp_path / "a.npz"
    write_zip(path, {"a.npy": npy(np.zeros(2**21, np.uint8))})
    assert path.stat().st_size < 4000
    limits = Limits(size=2**18)
    with pytest.raises(InputError, match="would take more than 262144 bytes"):
        read_npz(path, limits=limits)
    assert peak_memory(lambda: read_npz(path, limits=limits)) < limits.size + PIECE
    for size in (1000, 0):  # claimed to be small
        claim(path, size)
        with pytest.raises(InputError, match="is damaged|not a NumPy array"):
            read_npz(path, limits=limits)
    claim(path, 2**30)  # claimed to be large
    with pytest.raises(InputError, match="would take more"):
        read_npz(path)
    assert peak_memory(read_npz, path) < 8 * 2**20


def test_many_members_count_together(tmp_path):
    path = tmp_path / "a.npz"
    write_zip(path, {f"a{n}.npy": npy(np.zeros(2**17, np.uint8)) for n in range(20)})
    with pytest.raises(InputError, match="would take more than"):
        read_npz(path, limits=Limits(size=2**20))
    assert peak_memory(lambda: read_npz(path, limits=Limits(size=2**20))) < 2**21 + PIECE
    write_zip(path, {f"{n}{'a' * 500}": b"" for n in range(3000)}, zipfile.ZIP_STORED)
    with pytest.raises(InputError, match="is not an .npz archive"):
        read_npz(path, limits=Limits(size=2**20))


def test_other_archives(tmp_path):
    path = tmp_path / "a.npz"
    path.write_bytes(b"PK\x03\x04" + b"x" * 100)
    with pytest.raises(InputError, match="is not an .npz archive"):
        read_npz(path)
    write_zip(path, {"a.npy": npy(np.zeros(4))}, zipfile.ZIP_LZMA)
    with pytest.raises(InputError, match="packed in a way that NumPy never uses"):
        read_npz(path)
    write_zip(path, {"a.txt": b"hello"})
    with pytest.raises(InputError, match="'a.txt', byte 0: is not a NumPy array"):
        read_npz(path)


def test_real_files(shared):
    for path in sorted(shared.glob("*/*.npz")):
        with np.load(path, allow_pickle=True) as archive:
            found = read_npz(path, objects=True)
            assert found.keys() == set(archive.files)
            for name, array in found.items():
                assert array.dtype == archive[name].dtype
                np.testing.assert_array_equal(array, archive[name])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("npz")


def archived(save, **arrays):
    file = io.BytesIO()
    save(file, **arrays)
    return file.getvalue()


WHOLES = [
    archived(np.savez, a=np.arange(5), b=np.array(["x"])),
    archived(np.savez_compressed, a=np.zeros(500), o=np.array([1, "a"], object)),
]


@settings(max_examples=40, deadline=None)
@given(data=damaged(WHOLES), objects=st.booleans())
def test_damaged_archives(data, objects, folder):
    check(read_npz, folder / "a.npz", data, objects)


@settings(max_examples=40, deadline=None)
@given(data=damaged([*map(npy, ARRAYS.values()), npy(np.array([1, "a"], object), pickled=True)]), objects=st.booleans())
def test_damaged_arrays(data, objects, folder):
    check(read_npy, folder / "a.npy", data, objects)


def check(read, path, data, objects):
    path.write_bytes(data)
    limits = Limits(size=2**18)
    try:
        found = read(path, objects=objects, limits=limits)
    except InputError as error:
        check_message(error, path)
    else:
        assert_plain(found)
    assert peak_memory(lambda: read(path, objects=objects, limits=limits)) < 4 * limits.size + PIECE
