import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.io.bvh import read_bvh

GOOD = """HIERARCHY
ROOT Hips
{
  OFFSET 1.0 2.0 3.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 40 0
    CHANNELS 3 Xrotation Yrotation Zrotation
    End Site
    {
      OFFSET 0 25 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.033333
10 90 -5 30 20 10 5 15 25
11 91 -4 31 21 11 6 16 26
"""


def write(tmp_path, text):
    path = tmp_path / "a.bvh"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def expect_good(motion):
    assert motion.skeleton.names == ("Hips", "Spine")
    assert motion.skeleton.parents == (-1, 0)
    assert motion.fps == 30
    np.testing.assert_allclose(motion.skeleton.offsets, [[0.01, 0.02, 0.03], [0, 0.4, 0]], atol=1e-7)
    assert motion.skeleton.ends[0][0] == 1
    np.testing.assert_allclose(motion.skeleton.ends[0][1], [0, 0.25, 0])
    np.testing.assert_allclose(motion.root, [[0.10, 0.90, -0.05], [0.11, 0.91, -0.04]], atol=1e-7)
    hips = Rotation.from_euler("ZXY", [[30, 20, 10], [31, 21, 11]], degrees=True).as_matrix()
    spine = Rotation.from_euler("XYZ", [[5, 15, 25], [6, 16, 26]], degrees=True).as_matrix()
    np.testing.assert_allclose(motion.rotations, np.stack([hips, spine], axis=1), atol=1e-6)
    assert motion.rotations.dtype == motion.root.dtype == motion.skeleton.offsets.dtype == np.float32


@pytest.mark.parametrize(
    "change",
    [
        lambda t: t,
        lambda t: t.replace("\n", "\r\n"),
        lambda t: t.replace("\n", "\r"),
        lambda t: t.replace("  ", "\t"),
        lambda t: t.rstrip("\n"),
        lambda t: "\ufeff" + t,
        lambda t: t.replace("11 91 -4", "  1.1e+01\t9.1E1   -400.0e-2"),
        lambda t: t.replace("\n{", " {"),
        lambda t: t.replace("End Site", "End site").replace("rotation", "Rotation"),
        lambda t: t.replace("Frames: 2", "Frames:2").replace("Frame Time: ", "Frame Time:\t"),
        lambda t: t.replace("Frames: 2", "Frames 2").replace("Frame Time:", "Frame  time :"),
        lambda t: t.replace("MOTION\n", "\n  MOTION  \n\n").replace("10 90", "\n\n10 90") + "\n \n\n",
        lambda t: t.replace("0.033333", "3.3333e-02"),
        lambda t: " ".join(t[: t.index("MOTION")].split()) + "\n" + t[t.index("MOTION") :],
        lambda t: t.replace("0 25 0", "0 25 0 CHANNELS 0"),
    ],
)
def test_reads_every_style(tmp_path, change):
    expect_good(read_bvh(write(tmp_path, change(GOOD))))


@pytest.mark.parametrize("name", ["mixamorig:Hips", "Left Arm", "naïve-1.0", "MOTION1", "End", "JOINT"])
def test_odd_names(tmp_path, name):
    motion = read_bvh(write(tmp_path, GOOD.replace("JOINT Spine", f"JOINT {name}")))
    assert motion.skeleton.names == ("Hips", name)


def test_names_in_other_encodings(tmp_path):
    motion = read_bvh(write(tmp_path, GOOD.encode().replace(b"Spine", "背骨".encode("shift-jis"))))
    assert motion.skeleton.joints == 2


def test_scale(tmp_path):
    path = write(tmp_path, GOOD)
    np.testing.assert_allclose(read_bvh(path, scale=1.0).skeleton.offsets[1], [0, 40, 0])
    small = write(tmp_path, GOOD.replace("0 40 0", "0 0.4 0").replace("0 25 0", "0 9.5 0"))
    np.testing.assert_allclose(read_bvh(small).skeleton.offsets[1], [0, 0.4, 0])
    large = write(tmp_path, GOOD.replace("0 40 0", "0 0.4 0").replace("0 25 0", "0 9.7 0"))
    np.testing.assert_allclose(read_bvh(large).skeleton.offsets[1], [0, 0.004, 0])
    for scale in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="positive scale"):
            read_bvh(path, scale=scale)


def test_few_and_mixed_channels(tmp_path):
    text = """HIERARCHY
ROOT a
{
 OFFSET 1 2 3
 CHANNELS 2 Yposition Xrotation
 JOINT b
 {
  OFFSET 0 1 0
  JOINT c
  {
   OFFSET 9 9 9
   CHANNELS 5 Zrotation Xposition Yrotation Yposition Zposition
   End Site
   {
    OFFSET 1 0 0
   }
   End Site
   {
    OFFSET 2 0 0
   }
  }
 }
}
MOTION
Frames: 2
Frame Time: 0.01
7 90 40 0.1 50 0.2 0.3
8 45 41 0.3 51 0.2 0.3
"""
    motion = read_bvh(write(tmp_path, text), scale=1.0)
    np.testing.assert_allclose(motion.root, [[1, 7, 3], [1, 8, 3]])
    # A bone that moves is a bone of its mean length.
    np.testing.assert_allclose(motion.skeleton.offsets, [[1, 2, 3], [0, 1, 0], [0.2, 0.2, 0.3]], atol=1e-7)
    expected = Rotation.from_euler("X", [[90], [45]], degrees=True).as_matrix()
    np.testing.assert_allclose(motion.rotations[:, 0], expected, atol=1e-6)
    np.testing.assert_allclose(motion.rotations[:, 1], np.tile(np.eye(3), (2, 1, 1)))
    expected = Rotation.from_euler("ZY", [[40, 50], [41, 51]], degrees=True).as_matrix()
    np.testing.assert_allclose(motion.rotations[:, 2], expected, atol=1e-6)
    assert motion.skeleton.ends == ((2, (1.0, 0.0, 0.0)), (2, (2.0, 0.0, 0.0)))
    assert motion.fps == 100


def swap(old, new):
    assert old in GOOD
    return GOOD.replace(old, new, 1)


TOO_MANY = "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\n" + "".join(f"JOINT j{i} {{ OFFSET 0 0 0 }}\n" for i in range(5000))
TOO_DEEP = "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\n" + "".join(f"JOINT j{i}\n{{\nOFFSET 0 0 0\n" for i in range(3000))

BROKEN = {
    "no hierarchy": (GOOD[len("HIERARCHY\n") :], 1, "expected HIERARCHY"),
    "other text": ("hello\nworld\n", 1, "Is this a BVH file"),
    "no root": (swap("ROOT", "JOINT"), 2, "expected ROOT"),
    "no motion": (GOOD[: GOOD.index("MOTION")], 16, "without a MOTION section"),
    "cut in the hierarchy": (GOOD[: GOOD.index("End Site")], 10, "joint 'Spine' (line 6) is open"),
    "open brace": (swap("  }\n}\nMOTION", "  }\nMOTION"), 15, "joint 'Hips' (line 2) is open"),
    "one brace too many": (swap("}\nMOTION", "}\n}\nMOTION"), 16, "without its '{'"),
    "no brace": (swap("JOINT Spine\n  {", "JOINT Spine"), 7, "expected '{' after the joint's name 'Spine'"),
    "no name": (swap("JOINT Spine", "JOINT"), 7, "expected the joint's name"),
    "unknown channel": (swap("Zrotation", "Wrotation"), 5, "got 'Wrotation'"),
    "too few channel names": (swap("CHANNELS 3", "CHANNELS 4"), 10, "got 'End'"),
    "too many channel names": (swap("CHANNELS 3", "CHANNELS 2"), 9, "got 'Zrotation'"),
    "channel count": (swap("CHANNELS 3", "CHANNELS three"), 9, "number of channels"),
    "seven channels": (swap("CHANNELS 3", "CHANNELS 7"), 9, "number of channels"),
    "same channel": (swap("Xrotation Yrotation Zrotation", "Xrotation Xrotation Zrotation"), 9, "twice"),
    "second channels": (swap("    End", "    CHANNELS 0\n    End"), 10, "second CHANNELS"),
    "same name": (swap("JOINT Spine", "JOINT Hips"), 6, "in line 2 already"),
    "two roots": (swap("MOTION", "ROOT Hips2\n{\nOFFSET 0 0 0\n}\nMOTION"), 16, "second ROOT"),
    "root in root": (swap("JOINT", "ROOT"), 6, "second ROOT"),
    "no offset": (swap("    OFFSET 0 40 0\n", ""), 13, "'Spine' has no OFFSET"),
    "second offset": (swap("OFFSET 0 40 0", "OFFSET 0 40 0\nOFFSET 0 0 0"), 9, "second OFFSET"),
    "short offset": (swap("OFFSET 0 40 0", "OFFSET 0 40"), 9, "three numbers"),
    "word in offset": (swap("OFFSET 0 40 0", "OFFSET 0 x 0"), 8, "got 'x'"),
    "nan in offset": (swap("OFFSET 0 40 0", "OFFSET 0 nan 0"), 8, "got 'nan'"),
    "huge offset": (swap("OFFSET 0 40 0", "OFFSET 0 1e300 0"), 8, "out of range"),
    "end without offset": (swap("      OFFSET 0 25 0\n", ""), 12, "End Site of joint 'Spine'"),
    "end with joint": (swap("      OFFSET 0 25 0\n", "JOINT x\n"), 12, "End Site of joint 'Spine'"),
    "end open": (swap("0 25 0\n    }", "0 25 0\n OFFSET"), 13, "expected '}'"),
    "junk": (swap("    End", "    Endless\n    End"), 10, "got 'Endless'"),
    "no channels": (swap("CHANNELS 6", "JOINT q { OFFSET 0 0 0 }\n#").replace("#", ""), 6, "got 'Xposition'"),
    "too many joints": (TOO_MANY, 4100, "more than 4096 joints"),
    "too deep": (TOO_DEEP, 1538, "deeper than 512"),
    "no frames line": (swap("Frames: 2\n", ""), 17, "expected 'Frames: <count>'"),
    "nothing after motion": (GOOD[: GOOD.index("Frames")], 17, "the end of the file"),
    "frames in words": (swap("Frames: 2", "Frames: two"), 17, "positive number of frames"),
    "no frames": (swap("Frames: 2", "Frames: 0"), 17, "positive number of frames"),
    "negative frames": (swap("Frames: 2", "Frames: -2"), 17, "positive number of frames"),
    "no frame time": (swap("Frame Time: 0.033333\n", ""), 18, "expected 'Frame Time: <seconds>'"),
    "zero frame time": (swap("0.033333", "0.0"), 18, "frame time in seconds"),
    "negative frame time": (swap("0.033333", "-0.033333"), 18, "frame time in seconds"),
    "nan frame time": (swap("0.033333", "nan"), 18, "frame time in seconds"),
    "frame time in milliseconds": (swap("0.033333", "33.3333"), 18, "frame time in seconds"),
    "frame time in words": (swap("0.033333", "fast"), 18, "frame time in seconds"),
    "too few values": (swap("11 91", "91"), 20, "expected 9 values, one a channel; got 8"),
    "too many values": (swap("10 90", "10 90 80"), 19, "expected 9 values, one a channel; got 10"),
    "all lines short": (swap("10 ", "").replace("11 91", "91"), 19, "expected 9 values"),
    "word among values": (swap("91", "ninety"), 20, "expected a number as value 2; got 'ninety'"),
    "comma": (swap("91", "91,5"), 20, "a decimal comma: write a point"),
    "glued": (swap("90 -5", "90-5"), 19, "got '90-5'"),
    "nan": (swap("91", "nan"), 20, "got 'nan'"),
    "infinity": (swap("91", "-inf"), 20, "got '-inf'"),
    "overflow": (swap("91", "1e999"), 20, "value 2 is out of range"),
    "underscore": (swap("91", "9_1"), 20, "got '9_1'"),
    "fewer frames": (swap("Frames: 2", "Frames: 3"), 20, "says 3 frames and the file has 2; is the file cut short"),
    "more frames": (swap("Frames: 2", "Frames: 1"), 20, "says 1 frames and the file has 2; correct the header"),
    "huge claim": (swap("Frames: 2", "Frames: 999999999999"), 20, "the file has 2"),
    "absurd claim": (swap("Frames: 2", "Frames: " + "9" * 5000), 17, "positive number of frames"),
    "no values": (GOOD[: GOOD.index("10 90")], 19, "the end of the file"),
    "cut in the last frame": (GOOD[:-10], 20, "expected 9 values"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_name_the_line(tmp_path, name):
    text, line, message = BROKEN[name]
    path = write(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_bvh(path)
    assert str(caught.value).startswith(f"{path}, line {line}: "), caught.value
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400 + len(str(path))


def test_no_channels_at_all(tmp_path):
    text = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 1\nFrame Time: 0.1\n\n"
    with pytest.raises(InputError, match="line 2: no joint has a channel"):
        read_bvh(write(tmp_path, text))


def test_what_is_no_text_file(tmp_path):
    for data, message in [(b"", "is empty"), (b"\x89PNG\r\n\0\0", "is binary"), (b"HIERARCHY\n\0", "is binary")]:
        with pytest.raises(InputError, match=message):
            read_bvh(write(tmp_path, data))
    with pytest.raises(InputError, match="is a folder"):
        read_bvh(tmp_path)
    with pytest.raises(InputError, match="no such file"):
        read_bvh(tmp_path / "none.bvh")


def test_long_lines_of_spaces_take_linear_time(tmp_path):
    space = " " * 1_000_000
    start = time.perf_counter()
    for text in (
        swap("Frames: 2", f"Frames{space}2{space}x"),
        swap("Frame Time: ", f"Frame{space}Time{space}x{space}"),
        swap("MOTION", f"MOTION{space}x"),
    ):
        with pytest.raises(InputError):
            read_bvh(write(tmp_path, text))
    assert time.perf_counter() - start < 5


@pytest.mark.parametrize(
    ("take", "frames", "fps", "joints", "height"),
    [
        ("beat/2_scott_0_1_1.bvh", 956, 15, 75, (1.4, 2.0)),
        ("zeggs/067_Speech_2_x_1_0.bvh", 2065, 30, 75, (1.4, 2.0)),
    ],
)
def test_real_takes(shared, take, frames, fps, joints, height):
    motion = read_bvh(shared / take)
    assert (motion.frames, motion.fps, motion.skeleton.joints) == (frames, fps, joints)
    positions = motion.positions()
    tall = np.ptp(positions[0, :, 1])
    assert height[0] < tall < height[1]
    determinants = np.linalg.det(motion.rotations)
    np.testing.assert_allclose(determinants, 1, atol=1e-5)


@pytest.mark.parametrize("take", ["beat/2_scott_0_1_1.bvh", "zeggs/067_Speech_2_x_1_0.bvh"])
def test_real_takes_against_pymotion(shared, take):
    oracle = pytest.importorskip("pymotion.io.bvh")
    skeleton_ops = pytest.importorskip("pymotion.ops.skeleton")
    bvh = oracle.BVH()
    bvh.load(str(shared / take))
    rotations, positions, parents, offsets, _, _ = bvh.get_data()
    expected, _ = skeleton_ops.fk(rotations, positions[:, 0], offsets, parents)
    motion = read_bvh(shared / take, scale=1.0)
    assert list(motion.skeleton.names) == list(bvh.data["names"])
    # The oracle counts End Sites in some versions: compare the joints that both know.
    np.testing.assert_allclose(motion.positions(), expected[:, : motion.skeleton.joints], atol=2e-3)


@pytest.mark.parametrize("take", ["beat/2_scott_0_1_1.bvh", "zeggs/067_Speech_2_x_1_0.bvh"])
def test_real_takes_against_pybvh(shared, take):
    pybvh = pytest.importorskip("pybvh")
    oracle = pybvh.read_bvh_file(str(shared / take))
    motion = read_bvh(shared / take, scale=1.0)
    assert oracle.frame_count == motion.frames
    assert tuple(oracle.joint_names) == motion.skeleton.names
    # Units are centimetres here.
    np.testing.assert_allclose(motion.positions(), oracle.joint_positions(), atol=2e-3)
