"""Mirrored poses are those of the mirrored motion, in every kind."""

import jax
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.geometry.mirror import mirror
from a2g_jax.geometry.mirror_poses import pose_mirror
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_rows import write_motion
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.talker.recordings import talk


@pytest.mark.parametrize("kind", ["6d", "exponential", "euler"])
def test_poses_of_the_mirrored_motion(kind):
    motion = talk(3.0, 2, fps=30.0).motion
    space = PoseSpace(motion.skeleton, kind)
    pose, other = (write_motion(one, kind, "it")[0] for one in (motion, mirror(motion)))
    mirrored = jax.jit(pose_mirror(space))
    np.testing.assert_allclose(mirrored(pose[None])[0], other, atol=2e-3)
    assert np.abs(other - pose).max() > 0.1
    np.testing.assert_allclose(mirrored(mirrored(pose[None]))[0], pose, atol=2e-3)


def test_poses_without_a_skeleton_are_refused():
    layout = PoseLayout(("a", "b", "c"), ((0, 1), (1, 2)))
    with pytest.raises(InputError, match="--mirror: exchanges left and right of a skeleton"):
        pose_mirror(PoseSpace(layout, "directions"))
