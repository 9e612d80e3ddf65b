"""The latent space as notebooks use it, on the shipped weights."""

from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.features.dynamics import EDGES, Dynamics
from a2g_jax.generation.audio2gestures.latent_space import LatentSpace
from a2g_jax.generation.generator import Generator
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import demo_run


@pytest.fixture(scope="module")
def space():
    return LatentSpace(demo_run())


@pytest.fixture(scope="module")
def speech():
    return talk(6.0, 11)


@pytest.mark.parametrize("controls", [(), ("height=0.1@0,0.9@5", "emotion=anger")])
def test_codes_decode_to_what_generation_gives(speech, controls):
    run = demo_run()
    run = replace(run, config=run.config.with_sampling(controls=controls))
    space = LatentSpace(run)
    generated = Generator(run).generate(speech.audio, 2, seed=5)[1]
    motion = space.to_motion(space.from_audio(speech.audio, seed=5, sample=1))
    assert motion.frames == generated.frames
    np.testing.assert_allclose(motion.rotations, generated.rotations, atol=2e-4)


def test_decoded_codes_have_the_gains_of_the_run(speech):
    rows = demo_run().config.space.rows
    levels = np.broadcast_to(np.linspace(-3.0, 3.0, 4), (len(EDGES), rows, 4))
    gains = Dynamics(
        mean=np.zeros((rows, 6)),
        shift=np.zeros((rows, 6)),
        std=np.ones((rows, 6)),
        weight=np.ones(rows),
        slow=np.full(rows, 0.1),
        levels=levels,
        gains=np.full_like(levels, 0.4),
        speed_levels=levels[0, 0],
        speed_gains=np.zeros(4),
    )
    run = replace(demo_run(), dynamics=gains)
    space = LatentSpace(run)
    (generated,) = Generator(run).generate(speech.audio, 1, seed=5)
    codes = space.from_audio(speech.audio, seed=5)
    np.testing.assert_allclose(space.to_motion(codes).rotations, generated.rotations, atol=1e-3)
    assert np.abs(LatentSpace(demo_run()).to_motion(codes).rotations - generated.rotations).max() > 0.05


def test_a_motion_comes_back(space, speech):
    """Decoded from its codes, the wrists are within a few centimetres; another motion is farther."""
    motion = speech.motion
    back = space.to_motion(space.from_motion(motion))
    other = talk(6.0, 12).motion
    local = lambda m: m.positions() - m.positions()[:, :1]  # noqa: E731
    error = np.abs(local(back) - local(motion)).mean()
    assert error < 0.5 * np.abs(local(other) - local(motion)).mean()


def test_edits(space, speech):
    codes = space.from_audio(speech.audio)
    same = space.edit(codes, "specific keep 128")
    np.testing.assert_allclose(same.specific, codes.specific, atol=1e-4)
    still = space.edit(codes, "shared keep 1", "specific keep 1")
    assert still.bands("shared")[1:].max() < 1e-3 < codes.bands("shared")[1:].max()
    moving, calm = space.to_motion(codes), space.to_motion(still)
    speed = lambda m: np.abs(np.diff(m.positions(), axis=0)).mean()  # noqa: E731
    assert speed(calm) < 0.5 * speed(moving)


def test_swapped_bands_are_the_others(space, speech):
    first, second = space.from_audio(speech.audio, seed=1), space.from_audio(speech.audio, seed=2)
    mixed = space.edit(first, "specific swap 0:10", other=second)
    np.testing.assert_allclose(mixed.bands("specific")[:10], second.bands("specific")[:10], atol=1e-3)
    np.testing.assert_allclose(mixed.bands("specific")[10:], first.bands("specific")[10:], atol=1e-3)
    np.testing.assert_array_equal(space.swap(first, second).specific, second.specific)


def test_refusals(space, speech):
    codes = space.from_audio(speech.audio)
    with pytest.raises(InputError, match="give one as 'other'"):
        space.edit(codes, "shared swap 0:3")
    with pytest.raises(InputError, match="less than a frame"):
        space.from_audio(speech.audio[:10])
    with pytest.raises(InputError, match="25 fps, the run"):
        space.from_motion(talk(2.0, 1, fps=25.0).motion)
    with pytest.raises(InputError, match="give longer ones"):
        space.swap(codes, space.from_audio(talk(2.0, 3).audio))
