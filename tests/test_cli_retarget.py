"""The command ``a2g retarget``."""

import argparse
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent / "geometry"))
from rigs_for_tests import PARTS, Poses, Spec, angle, carrier, world

from a2g_jax.cli.retarget import add_arguments, run
from a2g_jax.errors import InputError
from a2g_jax.geometry.mirror import mirror
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.io.bvh import read_bvh, write_bvh

POSES = Poses.random(12, 3)
FIRST, SECOND = Spec(dialect="mixamo", fingers=True), Spec("unreal", up="Z", lowered=45.0, twists="chain", spines=5)


def command(*arguments):
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    run(parser.parse_args([str(argument) for argument in arguments]), [])


@pytest.fixture
def files(tmp_path):
    """Two rigs in the same poses: in centimetres and ZXY; Z-up, in metres and YZX."""
    write_bvh(tmp_path / "a.bvh", FIRST.build(POSES)[0])
    write_bvh(tmp_path / "b.bvh", SECOND.build(POSES)[0], order="YZX", scale=1.0)
    return tmp_path


def header(path):
    return path.read_text().split("MOTION")[0]


def test_there_and_back_in_each_files_own_layout(files, capsys):
    command(files / "a.bvh", "--to", files / "b.bvh", "--out", files / "ab.bvh")
    out = capsys.readouterr().out
    line = next(line for line in out.splitlines() if " L_Elbow " in line)
    assert line.split()[:2] == ["mixamorig:LeftForeArm", "lowerarm_l_twist_01"] or "lowerarm_l" in line
    assert "13 frames" in out
    assert header(files / "ab.bvh") == header(files / "b.bvh")
    shown, truth = read_bvh(files / "ab.bvh"), read_bvh(files / "b.bvh")
    _, joints = SECOND.build(POSES)
    for part in PARTS:
        joint = truth.skeleton.index(SECOND.build(POSES)[0].skeleton.names[carrier(SECOND, joints, part)])
        assert angle(world(shown)[1:, joint], world(truth)[1:, joint]) < 0.1, part
    command(files / "ab.bvh", "--to", files / "a.bvh", "--out", files / "aba.bvh")
    first, back = read_bvh(files / "a.bvh"), read_bvh(files / "aba.bvh")
    assert header(files / "aba.bvh") == header(files / "a.bvh")
    fingers = [j for j, name in enumerate(first.skeleton.names) if any(c.isdigit() for c in name) and "Hand" in name]
    others = [j for j in range(first.skeleton.joints) if j not in fingers]
    assert angle(world(first)[:, others], world(back)[:, others]) < 0.1
    np.testing.assert_allclose(back.root, first.root, atol=1e-3)


def test_layouts_that_our_own_writer_never_makes(files):
    """Positions in another order and for every joint, a joint without channels, hinges, mixed orders."""
    text = (files / "b.bvh").read_text()
    head, motion = text.split("MOTION\n")
    blocks = head.split("CHANNELS ")
    blocks[1] = blocks[1].replace(
        "6 Xposition Yposition Zposition Yrotation Zrotation Xrotation",
        "6 Zposition Xrotation Zrotation Xposition Yrotation Yposition",
    )
    hinge = next(at for at, block in enumerate(blocks) if "JOINT ball_r" in block) + 1
    blocks[2] = blocks[2].replace(
        "3 Yrotation Zrotation Xrotation", "6 Yposition Xposition Zposition Xrotation Yrotation Zrotation"
    )
    blocks[hinge] = blocks[hinge].replace("3 Yrotation Zrotation Xrotation", "1 Zrotation")
    columns = sum(int(block.split()[0]) for block in blocks[1:])
    count = int(motion.split()[1])
    rows = "\n".join(" ".join(["0"] * columns) for _ in range(count))
    second = np.array(next(line for line in head.split("OFFSET")[2:3])[:60].split()[:3], float)
    # Position channels hold the bone itself.
    row = ["0"] * columns
    row[6:9] = [f"{second[1]}", f"{second[0]}", f"{second[2]}"]
    rows = "\n".join([" ".join(row)] * count)
    (files / "odd.bvh").write_text("CHANNELS ".join(blocks) + f"MOTION\nFrames: {count}\nFrame Time: 0.04\n{rows}\n")
    command(files / "a.bvh", "--to", files / "odd.bvh", "--out", files / "out.bvh")
    assert header(files / "out.bvh") == header(files / "odd.bvh") != head
    assert columns == len(motion.split("\n")[2].split()) + 3 - 2
    command(files / "a.bvh", "--to", files / "b.bvh", "--out", files / "plain.bvh")
    odd, plain = read_bvh(files / "out.bvh"), read_bvh(files / "plain.bvh")
    np.testing.assert_allclose(odd.skeleton.offsets, plain.skeleton.offsets, atol=1e-5)
    same = [j for j, name in enumerate(plain.skeleton.names) if name != "ball_r"]
    assert angle(world(odd)[:, same], world(plain)[:, same]) < 0.01
    np.testing.assert_allclose(odd.root, plain.root, atol=1e-5)


def test_hinges_are_told(files, capsys):
    text = (files / "b.bvh").read_text()
    head, motion = text.split("MOTION\n")
    at = head.index("JOINT hand_r")
    head = head[:at] + head[at:].replace("3 Yrotation Zrotation Xrotation", "1 Zrotation", 1)
    lines = motion.rstrip("\n").split("\n")
    lines = lines[:2] + [" ".join(line.split()[:-2]) for line in lines[2:]]
    (files / "hinge.bvh").write_text(head + "MOTION\n" + "\n".join(lines) + "\n")
    command(files / "a.bvh", "--to", files / "hinge.bvh", "--out", files / "out.bvh")
    assert "hand_r has too few rotation channels" in capsys.readouterr().out


@pytest.mark.parametrize(("to", "joints"), [("body", 22), ("upper-body", 47)])
def test_to_the_joints_models_train_on(to, joints, files, capsys):
    command(files / "a.bvh", "--to", to, "--out", files / "new" / "out.bvh", "--fps", "60")
    moved = read_bvh(files / "new" / "out.bvh")
    assert (moved.skeleton.joints, moved.fps, moved.frames) == (joints, 60.0, 26)
    assert f"{joints} joints at 60 fps" in capsys.readouterr().out


def test_mirror(files):
    command(files / "a.bvh", "--to", files / "a.bvh", "--out", files / "m.bvh", "--mirror")
    motion, shown = read_bvh(files / "a.bvh"), read_bvh(files / "m.bvh")
    assert angle(world(mirror(motion)), world(shown)) < 0.1
    left, right = (find_rig(motion).roles[f"{side}_Wrist"] for side in "LR")
    assert angle(world(motion)[:, left], world(shown)[:, left]) > 10
    assert right != left


def test_errors_are_one_line_and_leave_nothing(files):
    (files / "chain.bvh").write_text(
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n"
        "End Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n"
    )
    out = files / "none" / "out.bvh"
    plain = ["--to", "body", "--out", out]
    for arguments, message in (
        ([files / "no.bvh", *plain], "no.bvh: there is no such file"),
        ([files / "chain.bvh", *plain], "chain.bvh: no human body: no L_Shoulder"),
        ([files / "a.bvh", "--to", files / "chain.bvh", "--out", out], "chain.bvh: no human body: no L_Shoulder"),
        ([files / "a.bvh", "--to", "legs", "--out", out], "legs: there is no such file"),
        ([files / "b.bvh", "--to", "upper-body", "--out", out], "lacks joints of BEAT's 47"),
        ([files / "a.bvh", "--to", "body", "--out", files / "x.npz"], "ends in .bvh"),
    ):
        with pytest.raises(InputError, match=message) as error:
            command(*arguments)
        assert "\n" not in str(error.value)
    assert not out.parent.exists()


@pytest.mark.parametrize("fps", ["0", "1001", "nan", "fast"])
def test_a_frame_rate_out_of_range(files, fps, capsys):
    with pytest.raises(SystemExit, match="2"):
        command(files / "a.bvh", "--to", "body", "--out", files / "none" / "out.bvh", "--fps", fps)
    assert f"--fps: expected a number from 1 to 1000; got '{fps}'" in capsys.readouterr().err
    assert not (files / "none").exists()
