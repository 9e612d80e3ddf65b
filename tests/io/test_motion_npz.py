import io
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.npz import read_motion_npz, write_motion_npz
from a2g_jax.io.untrusted import read_npz
from tests.io.fuzz_for_tests import peak_memory


def make(seed=0, frames=3, fps=30.0, ends=((2, (0.0, 0.1, -0.3)),)):
    random = np.random.default_rng(seed)
    return Motion(
        rotations=Rotation.random(frames * 3, rng=random).as_matrix().reshape(frames, 3, 3, 3).astype(np.float32),
        root=random.normal(size=(frames, 3)).astype(np.float32),
        skeleton=Skeleton(
            offsets=random.normal(size=(3, 3)).astype(np.float32),
            names=("Hips", "Rücken", "Kopf"),
            parents=(-1, 0, 1),
            ends=ends,
        ),
        fps=fps,
    )


def same(a: Motion, b: Motion) -> None:
    np.testing.assert_array_equal(a.rotations, b.rotations)
    np.testing.assert_array_equal(a.root, b.root)
    np.testing.assert_array_equal(a.skeleton.offsets, b.skeleton.offsets)
    assert (a.skeleton.names, a.skeleton.parents) == (b.skeleton.names, b.skeleton.parents)
    assert a.skeleton.ends == b.skeleton.ends
    assert a.fps == b.fps


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    fps=st.floats(1, 240),
    ends=st.lists(st.tuples(st.integers(0, 2), st.tuples(*[st.floats(-10, 10)] * 3)), max_size=3).map(tuple),
)
def test_round_trip_is_exact(tmp_path_factory, seed, fps, ends):
    path = tmp_path_factory.mktemp("npz") / "a.npz"
    motion = make(seed, fps=fps, ends=ends)
    write_motion_npz(path, motion)
    same(read_motion_npz(path), motion)


def test_is_plain_numpy_for_others(tmp_path):
    motion = make()
    write_motion_npz(tmp_path / "a.npz", motion)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as data:
        assert data["rotations"].shape == (3, 3, 3, 3)
        assert data["rotations"].dtype == data["root"].dtype == data["positions"].dtype == np.float32
        assert data["joint_names"].tolist() == ["Hips", "Rücken", "Kopf"]
        assert data["parents"].tolist() == [-1, 0, 1]
        assert float(data["fps"]) == 30
        spine = motion.root + motion.rotations[:, 0] @ motion.skeleton.offsets[1]
        np.testing.assert_allclose(data["positions"][:, 1], spine, atol=1e-5)


def test_same_motion_same_bytes(tmp_path):
    for name in ("a.npz", "b.npz"):
        write_motion_npz(tmp_path / name, make())
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_ends_may_be_missing(tmp_path):
    save(tmp_path / "a.npz", {"end_joints": None, "end_offsets": None})
    assert read_motion_npz(tmp_path / "a.npz").skeleton.ends == ()


def save(path, changes):
    motion = make()
    arrays = {
        "rotations": motion.rotations,
        "root": motion.root,
        "fps": np.float64(30),
        "joint_names": np.array(motion.skeleton.names),
        "parents": np.array(motion.skeleton.parents),
        "offsets": motion.skeleton.offsets,
        "end_joints": np.array([2]),
        "end_offsets": np.zeros((1, 3)),
    } | changes
    np.savez(path, **{key: array for key, array in arrays.items() if array is not None})


def spoiled(value):
    root = make().root.copy()
    root[1, 2] = value
    return root


BAD = {
    "no rotations": ({"rotations": None}, "has no array 'rotations'"),
    "quaternions": (
        {"rotations": np.zeros((3, 3, 4))},
        r"rotations: expected floating-point numbers of shape \(any, any",
    ),
    "integers": ({"rotations": np.zeros((3, 3, 3, 3), int)}, "rotations: expected floating-point"),
    "no frames": ({"rotations": np.zeros((0, 3, 3, 3)), "root": np.zeros((0, 3))}, "at least one frame"),
    "root frames": ({"root": np.zeros((2, 3))}, r"root: expected floating-point numbers of shape \(3, 3\)"),
    "root NaN": ({"root": spoiled(np.nan)}, r"root: expected finite numbers; got NaN or infinity at \[1, 2\]"),
    "root overflow": ({"root": spoiled(1.0).astype(float) * 1e300}, "root: expected finite numbers"),
    "offsets": ({"offsets": np.zeros((2, 3))}, "offsets: expected"),
    "names": ({"joint_names": np.array(["a", "b"])}, "joint_names: expected text"),
    "names twice": ({"joint_names": np.array(["a", "b", "a"])}, "unique joint names"),
    "names as bytes": ({"joint_names": np.array([b"a", b"b", b"c"])}, "joint_names: expected text"),
    "names as objects": ({"joint_names": np.array(["a", "b", "c"], object)}, "joint_names: is damaged .*objects"),
    "parents": ({"parents": np.array([-1, 2, 1])}, "joint_names, parents: Expected the parent of joint 1"),
    "fps zero": ({"fps": np.float64(0)}, "fps: expected a positive number"),
    "fps NaN": ({"fps": np.float64("nan")}, "fps: expected a positive number"),
    "fps list": ({"fps": np.array([30.0, 30.0])}, "fps: expected a number"),
    "end joint": ({"end_joints": np.array([3])}, "end_joints: expected numbers from 0 to 2"),
    "end shapes": ({"end_joints": np.array([1, 2])}, "end_offsets: expected"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_arrays(tmp_path, name):
    changes, message = BAD[name]
    save(tmp_path / "a.npz", changes)
    with pytest.raises(InputError, match=message) as caught:
        read_motion_npz(tmp_path / "a.npz")
    assert str(caught.value).startswith(str(tmp_path / "a.npz"))
    assert "\n" not in str(caught.value)


def test_what_is_no_archive(tmp_path):
    path = tmp_path / "a.npz"
    for data, message in [(b"", "is empty"), (b"text", "not an .npz archive"), (b"PK\x03\x04" + bytes(50), "archive")]:
        path.write_bytes(data)
        with pytest.raises(InputError, match=message):
            read_motion_npz(path)
    np.save(tmp_path / "b.npy", np.zeros(3))
    for other in ("b.npy", "none.npz", "."):
        with pytest.raises(InputError):
            read_motion_npz(tmp_path / other)


def test_headers_that_claim_too_much_cost_no_memory(tmp_path):
    path = tmp_path / "a.npz"
    for shape in ((10**9, 10**3, 3, 3), (10**30, 3, 3, 3), (-1, 3, 3, 3), (200, 30, 3, 3)):
        header = io.BytesIO()
        np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": shape})
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("rotations.npy", header.getvalue() + bytes(100))
        with pytest.raises(InputError, match="rotations: "):
            read_motion_npz(path)


def zeros(archive, key, shape, kind="<f4"):
    """Write an array of zeros of any size without having it in memory."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": kind, "fortran_order": False, "shape": shape})
    with archive.open(f"{key}.npy", "w", force_zip64=True) as file:
        file.write(header.getvalue())
        left, block = int(np.prod(shape)) * np.dtype(kind).itemsize, bytes(2**20)
        while left > 0:
            left -= file.write(block[:left])


def test_small_files_that_unpack_to_gigabytes_cost_no_memory(tmp_path):
    """Right headers and sizes, and a total that is only found by adding them, or one array of another shape."""
    path, frames, joints = tmp_path / "a.npz", 400_000, 22
    for wrong, message in ((0, "its [0-9]+ bytes unpack to [0-9]+; expected"), (1, r"root: expected .*\(400000, 3\)")):
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            zeros(archive, "rotations", (frames, joints, 3, 3))
            zeros(archive, "root", (frames + wrong, 3))
            zeros(archive, "offsets", (joints, 3))
            zeros(archive, "joint_names", (joints,), "<U8")
            zeros(archive, "parents", (joints,), "<i4")
            zeros(archive, "fps", (), "<f8")
        assert path.stat().st_size < 4e6

        def read(message=message):
            with pytest.raises(InputError, match=message):
                read_motion_npz(path)

        assert peak_memory(read) < 2e6
        with pytest.raises(InputError, match="bytes of memory"):
            read_npz(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        zeros(archive, "rotations", (frames // 10, joints, 3, 3))
        zeros(archive, "root", (frames // 10, 3))
        for key, array in {
            "offsets": np.zeros((joints, 3), np.float32),
            "joint_names": np.array([f"joint{n}" for n in range(joints)]),
            "parents": np.arange(joints) - 1,
            "fps": np.float64(30.0),
        }.items():
            with archive.open(f"{key}.npy", "w") as file:
                np.lib.format.write_array(file, array)
    assert read_motion_npz(path).frames == frames // 10  # a long take that stands still is no attack


def test_bad_motions_are_not_written(tmp_path):
    motion = make()
    motion.root[0, 0] = np.nan
    with pytest.raises(InputError, match="NaN or infinity in root"):
        write_motion_npz(tmp_path / "a.npz", motion)
    with pytest.raises(InputError, match=r"suffix must be \.npz"):
        write_motion_npz(tmp_path / "a.bvh", make())
    assert list(tmp_path.iterdir()) == []


def test_real_take(shared, tmp_path):
    motion = read_bvh(shared / "beat/2_scott_0_1_1.bvh").clip(0, 100)
    write_motion_npz(tmp_path / "a.npz", motion)
    same(read_motion_npz(tmp_path / "a.npz"), motion)
