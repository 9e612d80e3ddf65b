"""The length of a seed clip is that of the poses that are used."""

import pytest

from a2g_jax.errors import InputError
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.generation.stylized_flow.styled import Clip, Styling
from a2g_jax.geometry.motion import resample
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import Run


def test_a_seed_clip_that_is_too_short_after_resampling_is_refused_by_name(tmp_path, toy_run_config):
    """Ten frames at 10 fps last a second, but from the first to the last one there are only 28 at 30 fps."""
    path = tmp_path / "seed.bvh"
    write_bvh(path, resample(talk(3.0, 1).motion, 10.0).clip(5, 15))
    styling = Styling(seed_clip=Clip("--seed-clip", path))

    def seed(history: int):
        # Only the run and the number of seed poses matter; the networks are not needed.
        space = FlowSpace.__new__(FlowSpace)
        space.run, space.history = Run(toy_run_config(), {}, {}, 0), history
        return styling._seed(space)

    assert len(seed(28).rows) == 28
    with pytest.raises(
        InputError, match="--seed-clip .*seed.bvh: has 28 frames at the run's 30 fps; give a clip of 30"
    ):
        seed(30)
