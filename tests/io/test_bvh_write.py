import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton
from a2g_jax.io.bvh import read_bvh, write_bvh

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


def place(motion: Motion) -> np.ndarray:
    """Forward kinematics in float64, joint by joint."""
    rotations = np.asarray(motion.rotations, np.float64)
    offsets = np.asarray(motion.skeleton.offsets, np.float64)
    world, positions = [rotations[:, 0]], [np.asarray(motion.root, np.float64)]
    for joint, parent in enumerate(motion.skeleton.parents[1:], start=1):
        positions.append(positions[parent] + world[parent] @ offsets[joint])
        world.append(world[parent] @ rotations[:, joint])
    return np.stack(positions, axis=1)


def random_motion(seed: int, joints: int, frames: int, chain: bool = False, fps: float = 30.0) -> Motion:
    random = np.random.default_rng(seed)
    parents = (-1, *(j - 1 if chain else int(random.integers(j)) for j in range(1, joints)))
    rotations = Rotation.random(frames * joints, rng=random).as_matrix()
    # A third of them in gimbal lock for some order: products of quarter turns.
    quarter = Rotation.from_euler("XYZ", 90 * random.integers(-2, 3, (frames * joints, 3)), degrees=True).as_matrix()
    rotations = np.where(random.random((frames * joints, 1, 1)) < 0.33, quarter, rotations)
    leaf_ends = tuple((j, (0.0, 0.25, -0.125)) for j in range(joints) if j not in parents)
    return Motion(
        rotations=rotations.reshape(frames, joints, 3, 3).astype(np.float32),
        root=random.normal(0, 2, (frames, 3)).astype(np.float32),
        skeleton=Skeleton(
            offsets=random.normal(0, 0.2, (joints, 3)).astype(np.float32),
            names=tuple(f"joint:{j}" for j in range(joints)),
            parents=parents,
            ends=leaf_ends,
        ),
        fps=fps,
    )


def again(motion: Motion, path, **options) -> Motion:
    """Written, read and put back into the order of the joints it had."""
    write_bvh(path, motion, **options)
    result = read_bvh(path, scale=1 / options.get("scale", 100.0))
    back = [result.skeleton.names.index(name) for name in motion.skeleton.names]
    skeleton = Skeleton(
        offsets=result.skeleton.offsets[back],
        names=motion.skeleton.names,
        parents=tuple(-1 if result.skeleton.parents[j] < 0 else back.index(result.skeleton.parents[j]) for j in back),
        ends=tuple(sorted((back.index(j), end) for j, end in result.skeleton.ends)),
    )
    return Motion(rotations=result.rotations[:, back], root=result.root, skeleton=skeleton, fps=result.fps)


@pytest.mark.smoke
@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    joints=st.integers(1, 15),
    frames=st.integers(1, 6),
    order=st.sampled_from(ORDERS),
    scale=st.sampled_from([100.0, 1.0, 1000.0, 39.37]),
    fps=st.sampled_from([15.0, 30.0, 60.0, 120.0, 30000 / 1001, 25.0, 17.3]),
)
def test_round_trip(tmp_path_factory, seed, joints, frames, order, scale, fps):
    path = tmp_path_factory.mktemp("bvh") / "a.bvh"
    motion = random_motion(seed, joints, frames, fps=fps)
    result = again(motion, path, order=order, scale=scale)
    assert result.skeleton.parents == motion.skeleton.parents
    assert result.fps == pytest.approx(fps, rel=1e-8)
    np.testing.assert_allclose(result.skeleton.offsets, motion.skeleton.offsets, atol=1e-7)
    np.testing.assert_allclose(result.rotations, motion.rotations, atol=1e-6)
    np.testing.assert_allclose(place(result), place(motion), atol=1e-5)
    assert [joint for joint, _ in result.skeleton.ends] == [joint for joint, _ in motion.skeleton.ends]
    for (_, end), (_, expected) in zip(result.skeleton.ends, motion.skeleton.ends, strict=True):
        np.testing.assert_allclose(end, expected, atol=1e-7)


@pytest.mark.parametrize("scale", [100.0, 1.0])
def test_deep_chain(tmp_path, scale):
    motion = random_motion(1, 120, 3, chain=True)
    result = again(motion, tmp_path / "a.bvh", scale=scale)
    np.testing.assert_allclose(place(result), place(motion), atol=1e-5)


def body(frames=2, **changes) -> Motion:
    rotations = np.tile(np.eye(3, dtype=np.float32), (frames, len(BODY_JOINTS), 1, 1))
    offsets = np.tile(np.array([0, 0.1, 0], np.float32), (len(BODY_JOINTS), 1))
    motion = {
        "rotations": rotations,
        "root": np.zeros((frames, 3), np.float32),
        "skeleton": Skeleton(offsets=offsets, names=BODY_JOINTS, parents=BODY_PARENTS),
        "fps": 30.0,
    }
    return Motion(**{**motion, **changes})


def test_file_is_plain(tmp_path):
    path = tmp_path / "a.bvh"
    write_bvh(path, body(), order="ZXY")
    text = path.read_text()
    lines = text.splitlines()
    assert lines[4] == "\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    assert lines[3] == "\tOFFSET 0.000000 10.000000 0.000000"
    assert text.count("CHANNELS 3 Zrotation Xrotation Yrotation\n") == len(BODY_JOINTS) - 1
    assert text.count("{") == text.count("}") == len(BODY_JOINTS) + text.count("End Site")
    assert text.count("End Site") == len(BODY_JOINTS) - len(set(BODY_PARENTS) - {-1})
    assert "Frames: 2\nFrame Time: 0.0333333333\n" in text
    assert "-0.000000 " not in text
    assert "e-" not in text.partition("MOTION")[2]
    assert "\r" not in text


def test_leaf_ends_point_along_the_bone(tmp_path):
    path = tmp_path / "a.bvh"
    write_bvh(path, body())
    ends = read_bvh(path).skeleton.ends
    assert len(ends) == 5
    for _, end in ends:
        np.testing.assert_allclose(end, [0, 0.05, 0], atol=1e-7)


def test_names_lose_their_spaces_and_stay_unique(tmp_path):
    skeleton = Skeleton(
        offsets=np.ones((5, 3), np.float32),
        names=("Left Arm", "Left_Arm", "a{b}\n", " ", "ç:ü"),
        parents=(-1, 0, 0, 0, 0),
    )
    rotations = np.tile(np.eye(3, dtype=np.float32), (1, 5, 1, 1))
    write_bvh(tmp_path / "a.bvh", Motion(rotations, np.zeros((1, 3), np.float32), skeleton, 30.0))
    assert read_bvh(tmp_path / "a.bvh").skeleton.names == ("Left_Arm", "Left_Arm_2", "a_b_", "joint", "ç:ü")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frames": 0}, "no frames"),
        ({"root": np.array([[0, 0, 0], [0, np.nan, 0]], np.float32)}, "root of frame 1"),
        ({"rotations": np.full((2, 22, 3, 3), np.inf, np.float32)}, "rotations of frame 0"),
        ({"rotations": np.ones((2, 21, 3, 3), np.float32)}, "skeleton of 22 joints"),
        ({"fps": 0.0}, "frame rate"),
        ({"fps": float("nan")}, "frame rate"),
    ],
)
def test_bad_motions_are_not_written(tmp_path, changes, message):
    with pytest.raises(InputError, match=message):
        write_bvh(tmp_path / "a.bvh", body(**changes))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("options", [{"order": "XYX"}, {"order": "xyz"}, {"scale": 0.0}, {"scale": float("inf")}])
def test_bad_options(tmp_path, options):
    with pytest.raises(ValueError, match="Expected"):
        write_bvh(tmp_path / "a.bvh", body(), **options)


def test_too_deep_a_skeleton_is_not_written(tmp_path):
    with pytest.raises(InputError, match="512 levels"):
        write_bvh(tmp_path / "a.bvh", random_motion(0, 513, 1, chain=True))


@pytest.mark.parametrize("take", ["beat/2_scott_0_1_1.bvh", "zeggs/067_Speech_2_x_1_0.bvh"])
def test_real_takes_round_trip(shared, tmp_path, take):
    motion = read_bvh(shared / take)
    for order in ("ZXY", "XYZ"):
        write_bvh(tmp_path / "a.bvh", motion, order=order)
        result = read_bvh(tmp_path / "a.bvh")
        assert result.skeleton.names == motion.skeleton.names
        assert result.fps == motion.fps
        assert len(result.skeleton.ends) == len(motion.skeleton.ends)
        np.testing.assert_allclose(place(result), place(motion), atol=1e-5)


def test_independent_readers_place_the_joints_alike(tmp_path):
    oracle = pytest.importorskip("pymotion.io.bvh")
    ops = pytest.importorskip("pymotion.ops.skeleton")
    motion = random_motion(3, 12, 5)
    write_bvh(tmp_path / "a.bvh", motion, order="YZX")
    bvh = oracle.BVH()
    bvh.load(str(tmp_path / "a.bvh"))
    rotations, positions, parents, offsets, _, _ = bvh.get_data()
    found, _ = ops.fk(rotations, positions[:, 0], offsets, parents)
    names = list(bvh.data["names"])
    back = [names.index(name) for name in motion.skeleton.names]
    np.testing.assert_allclose(found[:, back] / 100, place(motion), atol=2e-5)


def test_pybvh_places_the_joints_alike(tmp_path):
    pybvh = pytest.importorskip("pybvh")
    motion = random_motion(4, 12, 5)
    write_bvh(tmp_path / "a.bvh", motion, order="ZXY")
    oracle = pybvh.read_bvh_file(str(tmp_path / "a.bvh"))
    back = [list(oracle.joint_names).index(name) for name in motion.skeleton.names]
    found = np.asarray(oracle.joint_positions())
    np.testing.assert_allclose(found[:, back] / 100, place(motion), atol=2e-5)
