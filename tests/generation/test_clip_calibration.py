"""Clips that are pinned, give a style or are continued lose a calibration pose at their start, and a note says so."""

from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.generation.clips import read_facing, without_calibration
from a2g_jax.generation.pins.request import pin_of
from a2g_jax.generation.stylized_flow.fit import fit
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.generation.stylized_flow.styled import Clip, Styling
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import Run, demo_run


@pytest.fixture(scope="module")
def run():
    return demo_run()


@pytest.fixture(scope="module")
def take():
    return talk(8.0, 77, speaker="felix").motion.clip(30, 150)


def after_pose(motion, frames):
    """A motion after frames in the T-pose of its rest."""
    pose = np.tile(np.eye(3, dtype=np.float32), (frames, motion.skeleton.joints, 1, 1))
    root = np.tile(np.asarray(motion.root)[:1], (frames, 1))
    return replace(
        motion,
        rotations=np.concatenate([pose, np.asarray(motion.rotations)]),
        root=np.concatenate([root, np.asarray(motion.root)]),
    )


@pytest.mark.parametrize(("frames", "words"), [(1, "frame 0 (0.03 s)"), (40, "frames 0 to 39 (1.33 s)")])
def test_pins_and_styles(run, take, frames, words):
    pin, plain = pin_of(after_pose(take, frames), run, "clip", 1.0), pin_of(take, run, "clip", 1.0)
    np.testing.assert_array_equal(pin.motion.rotations, plain.motion.rotations)
    assert pin.notes[0] == f"{words}, a calibration pose such as a T-pose, left out"
    assert plain.notes == ()
    styled = fit(after_pose(take, frames), run, "--style clip")
    assert styled.notes == pin.notes
    np.testing.assert_array_equal(styled.rows, fit(take, run, "--style clip").rows)


def test_a_clip_that_is_too_short_without_the_pose_is_refused_with_the_reason(run, take):
    with pytest.raises(InputError, match=r"clip: lasts 0\.17 s; .* \(frames 0 to 29 \(1\.00 s\), a calibration pose"):
        pin_of(after_pose(take.clip(0, 5), 30), run, "clip", 1.0)


def test_clips_to_continue(run, take, tmp_path, toy_run_config):
    path = tmp_path / "seed.bvh"
    write_bvh(path, after_pose(take.clip(0, 20), 30))
    motion, notes = read_facing(path, run)
    assert motion.frames == 20
    assert "frames 0 to 29" in notes[0]
    # Only the run and the number of seed poses matter; the networks are not needed.
    space = FlowSpace.__new__(FlowSpace)
    space.run, space.history = Run(toy_run_config(), {}, {}, 0), 20
    styling = Styling(seed_clip=Clip("--seed-clip", path))
    assert "frames 0 to 29" in styling._seed(space).notes[0]
    space.history = 25
    with pytest.raises(InputError, match="seed.bvh: has 20 frames"):
        styling._seed(space)


def test_talk_keeps_all_its_frames():
    for seed in range(4):
        motion = talk(6.0, seed).motion
        assert without_calibration(motion) == (motion, ())
