import struct
import subprocess
import sys

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.io import hdf5_process
from a2g_jax.io.hdf5 import read_hdf5
from a2g_jax.io.untrusted import Limits
from tests.io.fuzz_for_tests import peak_memory
from tests.io.untrusted_checks import check_message, same

h5py = pytest.importorskip("h5py")

ARRAYS = {
    "pose/data": np.arange(12.0).reshape(3, 4),
    "pose/confidence": np.float32([[1, 0.5]]),
    "audio/log_mel_512": np.float16([[1.5]]),
    "big": np.arange(3, dtype=">i4"),
    "flags": np.array([True, False]),
    "number": np.array(5),
    "empty": np.zeros((0, 3)),
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.h5"


def refused(path, name, match, limits=None):
    with pytest.raises(InputError, match=match) as error:
        read_hdf5(path, [name], limits)
    check_message(error.value, path)


def test_what_h5py_writes_is_read_back(path):
    with h5py.File(path, "w") as file:
        for name, array in ARRAYS.items():
            file[name] = array
    found = read_hdf5(path, list(ARRAYS))
    assert list(found) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert same(found[name], array.astype(array.dtype.newbyteorder("=")))
        assert found[name].flags.writeable
    assert read_hdf5(path, []) == {}
    assert same(read_hdf5(path, ["/pose/data"])["/pose/data"], ARRAYS["pose/data"])


@pytest.mark.parametrize(
    "packing", [{"compression": "gzip", "shuffle": True, "fletcher32": True}, {"compression": "lzf"}]
)
def test_packed_arrays(path, packing):
    array = np.random.default_rng(0).standard_normal((300, 104))
    with h5py.File(path, "w") as file:
        file.create_dataset("a", data=array, chunks=(64, 20), **packing)
    assert same(read_hdf5(path, ["a"])["a"], array)


def test_text(path):
    with h5py.File(path, "w") as file:
        file["fixed"] = np.array([b"ab", b"c"])
        file.create_dataset("utf", data="é".encode(), dtype=h5py.string_dtype("utf-8", 4))
        file["wrong"] = np.array([b"\xff"])
        file["long"] = ["hello", "wörld"]
    found = read_hdf5(path, ["fixed", "utf"])
    assert same(found["fixed"], np.array(["ab", "c"]))
    assert found["utf"].tolist() == "é"
    refused(path, "wrong", "'wrong' is damaged")
    refused(path, "long", "'long' is text of variable length, which is refused")


def test_missing_names_and_files(path):
    with pytest.raises(InputError, match="no such file"):
        read_hdf5(path, ["a"])
    path.write_bytes(b"hello")
    refused(path, "a", "is not an HDF5 file")
    with h5py.File(path, "w") as file:
        file["pose/data"] = [1]
    refused(path, "pose/normal", "has no data set 'pose/normal'; 'pose' has 'data'")
    refused(path, "nope/x", "has no data set 'nope/x'; the file has 'pose'")
    refused(path, "pose/data/x", "has no data set")
    refused(path, "pose", "'pose' is a group")
    refused(path, "", "is a group")
    refused(path, "pose/../pose/data", "has no data set")


def test_other_files_are_never_reached(path, tmp_path):
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["a"] = [1, 2]
    (tmp_path / "raw").write_bytes(b"secret!!")
    layout = h5py.VirtualLayout((2,), "i8")
    layout[:] = h5py.VirtualSource(str(other), "a", (2,))
    with h5py.File(path, "w") as file:
        file["link"] = h5py.ExternalLink(str(other), "a")
        file["folder"] = h5py.ExternalLink(str(other), "/")
        file["soft"] = h5py.SoftLink("/folder/a")
        file.create_virtual_dataset("virtual", layout)
        file.create_dataset("raw", (8,), "S1", external=[(str(tmp_path / "raw"), 0, 8)])
    for name in ("link", "folder/a"):
        refused(path, name, "is a link to '.*which is refused")
    refused(path, "soft", "is a link to '/folder/a', which is refused")
    for name in ("virtual", "raw"):
        refused(path, name, f"'{name}' is stored in other files, which is refused")


def test_other_types_are_refused(path):
    with h5py.File(path, "w") as file:
        file["ragged"] = np.array([np.arange(2), np.arange(3)], object).astype(h5py.vlen_dtype("i4"))
        file["record"] = np.zeros(2, "i4,f4")
        file["reference"] = np.array([file["record"].ref], h5py.ref_dtype)
        file["opaque"] = np.zeros(2, "V3")
        file["complex"] = np.zeros(2, "c8")
        file["long"] = np.zeros(2, "g")
        file["nothing"] = h5py.Empty("f4")
        file["type"] = np.dtype("f4")
    for name in ("ragged", "record", "reference", "opaque", "complex", "long", "nothing"):
        refused(path, name, f"'{name}' is of type .*; expected an array of plain numbers or text")
    refused(path, "type", "is a group")


def test_other_filters_are_refused_before_they_are_looked_for(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("a", data=np.zeros(100), chunks=(10,), compression="gzip")
        file.create_dataset("scaled", data=np.arange(100), chunks=(10,), scaleoffset=0)
    refused(path, "scaled", r"packed by filter 6 \(.*\), which is refused")
    data = path.read_bytes()
    # The first message of filters: version 1, one filter, deflate.
    at = data.index(b"\x01\x01\0\0\0\0\0\0\x01\0\x08\0")
    path.write_bytes(data[: at + 8] + struct.pack("<H", 32015) + data[at + 10 :])
    refused(path, "a", "packed by filter 32015")


def test_sizes_are_checked_before_anything_is_read(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("empty", (2**36,), "f4", chunks=(2**20,), compression="gzip")
        file.create_dataset("unwritten", (2**10,), "f4")
        file.create_dataset("bomb", data=np.zeros(2**20, np.uint8), chunks=(2**18,), compression="gzip")
        file.create_dataset("chunk", data=np.zeros(4, np.uint8), chunks=(2**20,), maxshape=(None,), compression="gzip")
        file.create_dataset("chunks", data=np.zeros(2**10, np.uint8), chunks=(1,))
        file["a"] = np.zeros(2**15, np.uint8)
        file["text"] = np.full(2**15, b"abc")
    limits = Limits(size=2**18)
    for name in ("empty", "bomb", "chunk", "chunks", "text"):
        refused(path, name, f"'{name}' would take more than 262144 bytes", limits)
        assert peak_memory(read_hdf5, path, [name], limits) < 2**20
    refused(path, "empty", "would take more than")
    refused(path, "unwritten", "was never written")
    assert len(read_hdf5(path, ["a"], limits)["a"]) == 2**15
    with pytest.raises(InputError, match="would take more than"):
        read_hdf5(path, ["a"] * 5, limits)


def test_damage_is_an_input_error(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("pose/data", data=np.arange(1000.0), chunks=(100,), compression="gzip", fletcher32=True)
    whole = path.read_bytes()
    for cut in (10, 100, 1000, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:cut])
        refused(path, "pose/data", "damaged")
    at = whole.index(b"\x78\x5e") if b"\x78\x5e" in whole else len(whole) - 300
    path.write_bytes(whole[: at + 8] + b"\xff" * 8 + whole[at + 16 :])
    refused(path, "pose/data", "'pose/data' is damaged")


def test_without_h5py_the_error_says_what_to_install(path):
    path.write_bytes(b"x")
    code = (
        "import sys; sys.modules['h5py'] = None\n"
        "from a2g_jax.io.hdf5 import read_hdf5\n"
        "from a2g_jax.errors import InputError\n"
        "try:\n    read_hdf5(sys.argv[1], ['a'])\n"
        "except InputError as error:\n    print(error)\n"
    )
    result = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert 'pip install "a2g_jax[hdf5]"' in result.stdout


def test_a_crash_of_the_library_is_one_error_and_the_next_file_is_read(path, monkeypatch):
    with h5py.File(path, "w") as file:
        file["a"] = np.arange(3)
    expected = read_hdf5(path, ["a"])["a"]
    # Once it is dead, another call would start the next one, which never ends by itself.
    process = hdf5_process._process()
    process.kill()
    process.wait()
    np.testing.assert_array_equal(read_hdf5(path, ["a"])["a"], expected)
    monkeypatch.setattr(hdf5_process, "_START", "import sys, os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    hdf5_process._end()
    refused(path, "a", "is damaged .the HDF5 library crashed on it, or did not end.; copy or download it again")
    monkeypatch.setattr(hdf5_process, "_START", "import time; time.sleep(60)")
    monkeypatch.setattr(hdf5_process, "_SECONDS", 0.2)
    refused(path, "a", "the HDF5 library crashed on it, or did not end")
    monkeypatch.undo()
    np.testing.assert_array_equal(read_hdf5(path, ["a"])["a"], expected)


@pytest.mark.parametrize("place", ["loads", "frombuffer"])
def test_an_interrupt_leaves_no_rest_of_an_answer(path, monkeypatch, place):
    with h5py.File(path, "w") as file:
        file["a"], file["b"] = np.arange(3), np.arange(100)

    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr({"loads": hdf5_process.json, "frombuffer": hdf5_process.np}[place], place, interrupt)
        with pytest.raises(KeyboardInterrupt):
            read_hdf5(path, ["a", "b"])
    np.testing.assert_array_equal(read_hdf5(path, ["b"])["b"], np.arange(100))


def test_relative_paths_after_a_change_of_the_folder(path, monkeypatch):
    with h5py.File(path, "w") as file:
        file["a"] = np.arange(3)
    read_hdf5(path, ["a"])
    monkeypatch.chdir(path.parent)
    assert read_hdf5("a.h5", ["a"])["a"].tolist() == [0, 1, 2]
    with pytest.raises(InputError, match="^a.h5: has no data set 'b'"):
        read_hdf5("a.h5", ["b"])


def test_all_headers_are_read_before_any_array(path):
    """A small file cannot take more than 100 times its size and 256 MB, and the total counts."""
    with h5py.File(path, "w") as file:
        for name in ("a", "b"):
            made = file.create_dataset(name, (2**24,), "f4", chunks=(2**20,), compression="gzip")
            made[:10] = 1.0
    assert read_hdf5(path, ["a"])["a"].nbytes == 2**26
    with pytest.raises(InputError, match="'b' would take more than"):
        read_hdf5(path, ["a", "b"])
