"""Figures of clips, and the clips that are refused for them."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.errors import InputError
from a2g_jax.generation.clip_fit import Bounds, measure_clip, refusals, t_pose_frames
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.onto import on_skeleton
from a2g_jax.io.bvh import read_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.training.run import demo_run

SHARED = Path(os.environ.get("A2G_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))
DOG = SHARED.parent / "cases" / "bvh" / "dog_walk.bvh"


@pytest.fixture(scope="module")
def clip():
    return talk(6.0, 77, speaker="felix").motion.clip(60, 150)


def fit(motion):
    config = demo_run().config
    return measure_clip(motion, config.space, config.statistics["pose"])


def test_talk_lies_within_the_training_motion(clip):
    figures = fit(clip)
    assert refusals(figures) == []
    assert refusals(figures, Bounds(z_rms=2.0, beyond_share=0.05)) == []
    assert figures.as_json()["turn"]["joint"] in clip.skeleton.names
    assert figures.seconds == pytest.approx(3.0)


def test_a_flip_is_named_with_joint_frame_and_degrees(clip):
    rotations = np.array(clip.rotations)
    elbow = clip.skeleton.names.index("L_Elbow")
    rotations[31:, elbow] = rotations[31:, elbow] @ Rotation.from_euler("x", 180, degrees=True).as_matrix()
    (line,) = refusals(fit(replace(clip, rotations=rotations)))
    assert "turns L_Elbow by 1" in line
    assert "from frame 30 to the next" in line


def test_a_fast_clip_is_named_with_its_speed(clip):
    lines = refusals(fit(replace(clip, fps=clip.fps * 8)))
    assert any("m/s" in line and "Wrist" in line for line in lines)


def test_a_cartwheel_is_named_with_its_tilt(clip):
    turns = Rotation.from_euler("z", np.linspace(0, 360, clip.frames)[:, None], degrees=True).as_matrix()
    rotations = np.array(clip.rotations)
    rotations[:, 0] = turns @ rotations[:, 0]
    assert any("tilts the trunk by 1" in line for line in refusals(fit(replace(clip, rotations=rotations))))


def test_a_t_pose_is_refused_and_one_within_a_gesture_is_not(clip):
    still = np.tile(np.eye(3, dtype=np.float32), (30, 22, 1, 1))
    pose = Motion(still, np.zeros((30, 3), np.float32), TALKER_SKELETON, 30.0)
    assert t_pose_frames(pose).all()
    assert any("T-pose for 100%" in line for line in refusals(fit(pose)))
    rotations = np.array(clip.rotations)
    rotations[40:50] = still[:10]
    assert not any("T-pose" in line for line in refusals(fit(replace(clip, rotations=rotations))))


def test_short_clips_are_refused(clip):
    assert refusals(fit(clip.clip(0, 1)))[0].startswith("is a single frame")
    assert refusals(fit(clip.clip(0, 3)))[0].startswith("lasts 0.10 s")


def test_bounds_on_the_training_range_are_for_those_who_ask(clip):
    turned = np.array(clip.rotations)
    turned[:, clip.skeleton.names.index("Head")] = Rotation.from_euler("y", 80, degrees=True).as_matrix()
    figures = fit(replace(clip, rotations=turned))
    assert refusals(figures) == []
    assert "standard deviations" in refusals(figures, Bounds(z_rms=1.0))[0]


@pytest.mark.skipif(not DOG.exists(), reason="the shared problem files are not here")
def test_a_dog_is_no_human_body():
    with pytest.raises(InputError, match="no human body"):
        on_skeleton(read_bvh(DOG), TALKER_SKELETON, 30.0, "dog")
