"""The latent space and its pins on poses that are exponential maps."""

import dataclasses

import jax
import numpy as np

from a2g_jax.features.statistics import Statistics
from a2g_jax.generation.audio2gestures.latent_space import LatentSpace
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.pose_track import represent
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run_config import Run


def test_codes_of_a_motion_decode_to_rotations(toy_run_config):
    take = talk(4.0, 3)
    rows, body = represent(take.motion, "exponential", "the take")
    config = toy_run_config()
    statistics = {**config.statistics, "pose": Statistics(rows.mean(0), rows.std(0) + 0.1)}
    config = dataclasses.replace(config, space=PoseSpace(body, "exponential"), statistics=statistics)
    params = jax.device_get(jax.jit(config.build().init)(jax.random.key(0)))
    space = LatentSpace(Run(config, params, {}, 0))
    codes = space.from_motion(take.motion)
    assert codes.frames == take.motion.frames
    rotations = np.asarray(space.to_motion(codes).rotations)
    assert rotations.shape == take.motion.rotations.shape
    np.testing.assert_allclose(
        rotations @ np.swapaxes(rotations, -1, -2), np.broadcast_to(np.eye(3), rotations.shape), atol=1e-5
    )
