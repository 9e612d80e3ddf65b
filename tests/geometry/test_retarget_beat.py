"""The same performance as BEAT's BVH and as BEAT2's SMPL-X parameters: on the 22 body joints both agree."""

import numpy as np
import pytest

from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.retarget import retarget
from a2g_jax.inspection.files import inspect_npz
from a2g_jax.io.bvh import read_bvh
from a2g_jax.talker.skeleton import TALKER_SKELETON

WRISTS = [TALKER_SKELETON.index("L_Wrist"), TALKER_SKELETON.index("R_Wrist")]


def wrists(motion, place):
    """Paths of the wrists against the chest, turned with it, or against the pelvis."""
    positions = motion.positions()
    if place == "pelvis":
        return positions[:, WRISTS] - positions[:, :1]
    chest = TALKER_SKELETON.index("Spine3")
    axes = motion.world_rotations()[:, chest]
    return np.einsum("tji,tkj->tki", axes, positions[:, WRISTS] - positions[:, [chest]])


@pytest.mark.parametrize(("place", "least"), [("chest", 0.97), ("pelvis", 0.8)])
def test_wrist_paths_agree(place, least, shared):
    """Correlation of each coordinate, without shift; BEAT's trunk hardly moves, so the chest is compared too."""
    name = "2_scott_0_1_1"
    motions = [read_bvh(shared / f"beat/{name}.bvh"), inspect_npz(shared / f"beat2/{name}.npz").motion]
    frames = int(min(motion.seconds for motion in motions) * 15)
    first, second = (wrists(resample(retarget(motion, TALKER_SKELETON), 15.0, frames), place) for motion in motions)

    def agreement(one, other):
        return np.array([[np.corrcoef(one[:, h, k], other[:, h, k])[0, 1] for k in range(3)] for h in range(2)])

    together = agreement(first, second)
    assert together.min() > least
    # It is this moment that agrees, and not the shape of all gestures.
    for shift in (3, 15, 150):
        assert agreement(first[shift:], second[:-shift]).mean() < together.mean() - 0.1
