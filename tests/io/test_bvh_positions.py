"""Position channels below the root: bones, bones that move, and the path of a body below a root that stands still."""

import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bvh_for_tests import bvh_text, depth_first

from a2g_jax.errors import InputWarning
from a2g_jax.geometry.retarget import body_skeleton, find_rig, retarget
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.bvh import read_bvh, read_with_layout, write_like
from a2g_jax.talker.recordings import talk


@cache
def walk():
    """A talker who drifts four metres forward."""
    motion = depth_first(talk(4.0, 5, name="walk").motion)
    root = np.asarray(motion.root) + np.linspace(0, 4, motion.frames)[:, None] * np.float32([0, 0, 1])
    return replace(motion, root=root.astype(np.float32))


def read(tmp_path, text, name="a.bvh"):
    path = tmp_path / name
    path.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error", InputWarning)
        return path, read_bvh(path)


def every_bone(motion):
    return {name: motion.skeleton.offsets[joint] for joint, name in enumerate(motion.skeleton.names) if joint}


def test_a_root_that_stands_still_above_hips_that_move(tmp_path):
    motion = walk()
    path, shown = read(tmp_path, bvh_text(motion, above="Root"))
    np.testing.assert_allclose(shown.positions()[:, 1:], motion.positions(), atol=1e-5)
    found = [finding for finding in inspect(path).findings if finding.code == "path"]
    assert [finding.place.joint for finding in found] == [motion.skeleton.names[0]]
    source = find_rig(shown)
    moved = retarget(shown, body_skeleton(source), source=source)
    assert moved.root[-1, 2] - moved.root[0, 2] == pytest.approx(motion.root[-1, 2] - motion.root[0, 2], rel=0.01)


@pytest.mark.parametrize("moving_root", [False, True])
def test_the_path_is_written_where_it_was(moving_root, tmp_path):
    """Into the hips, where the root stands still; either way all joints are where they were."""
    motion = walk()
    text = bvh_text(motion, above="Root")
    if moving_root:
        head, rows = text.split("Frame Time: ")
        time, *lines = rows.splitlines()
        lines = [" ".join([str(at), *line.split()[1:]]) for at, line in enumerate(lines)]
        text = "\n".join([head + "Frame Time: " + time, *lines]) + "\n"
    path, shown = read(tmp_path, text)
    _, layout = read_with_layout(path)
    write_like(tmp_path / "b.bvh", shown, layout)
    again = read_bvh(tmp_path / "b.bvh")
    np.testing.assert_allclose(again.positions()[:, 1:], shown.positions()[:, 1:], atol=1e-5)
    values = np.loadtxt((tmp_path / "b.bvh").read_text().split("Frame Time: ")[1].splitlines()[1:])
    assert (np.ptp(values[:, :3]) == 0.0) is not moving_root


def test_a_root_without_channels(tmp_path):
    motion = walk()
    text = bvh_text(motion, above="Root")
    head, rows = text.split("Frame Time: ")
    head = head.replace("CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation", "CHANNELS 0", 1)
    time, *lines = rows.splitlines()
    lines = [" ".join(line.split()[6:]) for line in lines]
    path, shown = read(tmp_path, "\n".join([head + "Frame Time: " + time, *lines]) + "\n")
    np.testing.assert_allclose(shown.positions()[:, 1:], motion.positions(), atol=1e-5)
    write_like(tmp_path / "b.bvh", shown, read_with_layout(path)[1])
    np.testing.assert_allclose(read_bvh(tmp_path / "b.bvh").positions(), shown.positions(), atol=1e-5)


def test_six_channels_on_every_joint_that_hold_bones(tmp_path):
    motion = walk()
    _, shown = read(tmp_path, bvh_text(motion, positions=every_bone(motion)))
    np.testing.assert_allclose(shown.positions(), motion.positions(), atol=1e-5)
    # With OFFSETs of another pose, and as differences to the right ones.
    zero = {name: np.zeros(3) for name in every_bone(motion)}
    _, shown = read(tmp_path, bvh_text(motion, positions=zero))
    np.testing.assert_allclose(shown.positions(), motion.positions(), atol=1e-5)


def test_six_channels_and_a_path_in_the_hips(tmp_path):
    motion = walk()
    text = bvh_text(motion, above="Root", positions=every_bone(motion))
    _, shown = read(tmp_path, text)
    np.testing.assert_allclose(shown.positions()[:, 1:], motion.positions(), atol=1e-5)


@pytest.mark.parametrize("above", ["", "Root"])
def test_bones_that_move_are_warned_of_in_centimetres(above, tmp_path):
    """A bone of the spine that grows and shrinks by 3 cm: joints above it are 3 cm off, if the mean is taken."""
    motion = walk()
    bones = every_bone(motion)
    wave = np.sin(np.arange(motion.frames) / 5)
    bones["Spine2"] = bones["Spine2"] + 0.03 * wave[:, None] * np.array([0, 1, 0])
    path = tmp_path / "a.bvh"
    path.write_text(bvh_text(motion, positions=bones, above=above))
    with pytest.warns(InputWarning, match=r"up to [23]\.\d cm from their places") as caught:
        read_bvh(path)
    assert str(path) in str(caught[0].message)
    (found,) = [finding for finding in inspect(path).findings if finding.code == "moving-bones"]
    assert found.value == pytest.approx(3.0, abs=0.2)
    assert found.place.frame is not None


def test_other_branches_beside_the_hips_do_not_hide_the_path(tmp_path):
    """Targets of an IK rig below the root, which stay behind."""
    text = bvh_text(walk(), above="Root")
    helper = (
        "JOINT ik_foot_root\n{\nOFFSET 0 0 0\nCHANNELS 0\nJOINT ik_foot_l\n{\nOFFSET 9 0 0\nCHANNELS 0\n}\n"
        "JOINT ik_foot_r\n{\nOFFSET -9 0 0\nCHANNELS 0\n}\n}\n"
    )
    text = text.replace("}\nMOTION", helper + "}\nMOTION")
    _, shown = read(tmp_path, text)
    body = [joint for joint, name in enumerate(shown.skeleton.names) if not name.startswith("ik") and joint]
    np.testing.assert_allclose(shown.positions()[:, body], walk().positions(), atol=1e-5)
