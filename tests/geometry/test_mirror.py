"""Mirroring on any rig."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs_for_tests import Poses, Spec, angle, places, specs, world

from a2g_jax.errors import InputError
from a2g_jax.geometry.mirror import mirror, mirror_pairs
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.io.bvh import read_bvh


@settings(max_examples=40, deadline=None)
@given(specs(), st.integers(0, 5))
def test_positions_are_mirrored_and_twice_is_once(spec, seed):
    motion, joints = spec.build(Poses.random(3, seed))
    rig = find_rig(motion)
    pairs = mirror_pairs(rig)
    assert pairs[joints["L_Elbow"]] == joints["R_Elbow"]
    assert pairs[joints["Head"]] == joints["Head"]
    twice = mirror(mirror(motion, rig), rig)
    assert angle(world(twice), world(motion)) < 0.05
    np.testing.assert_allclose(twice.root, motion.root, atol=1e-4 * spec.scale)
    mirrored = mirror(motion, rig)
    across = rig.world[:, 0]
    image = places(motion) - 2 * (places(motion) @ across)[..., None] * across
    # The generator's bodies are symmetric, so the same skeleton shows the mirror image.
    np.testing.assert_allclose(places(mirrored), image[:, list(pairs)], atol=1e-3 * spec.scale)


def test_a_crooked_body_needs_a_mirrored_skeleton():
    motion, joints = Spec(fingers=True).build(Poses.random(3, 1))
    offsets = np.asarray(motion.skeleton.offsets).copy()
    offsets[joints["L_Elbow"]] *= 1.3
    motion = dataclasses.replace(motion, skeleton=dataclasses.replace(motion.skeleton, offsets=offsets))
    rig = find_rig(motion)
    pairs = list(mirror_pairs(rig))
    image = (places(motion) * [-1, 1, 1])[:, pairs]
    mirrored = mirror(motion, rig, keep_skeleton=False)
    np.testing.assert_allclose(places(mirrored), image, atol=1e-5)
    assert np.abs(places(mirror(motion, rig)) - image).max() > 0.05
    again = mirror(mirrored, find_rig(mirrored), keep_skeleton=False)
    np.testing.assert_allclose(again.skeleton.offsets, offsets, atol=1e-6)
    np.testing.assert_allclose(places(again), places(motion), atol=1e-5)


def test_a_joint_without_partner_is_named():
    motion, joints = Spec(leaf_ends=True).build(Poses.random(2, 1))
    parents = list(motion.skeleton.parents)
    wrist_end = motion.skeleton.index("LeftHand_end")
    parents[wrist_end] = joints["L_Elbow"]
    skeleton = dataclasses.replace(motion.skeleton, parents=tuple(parents))
    with pytest.raises(InputError, match="Hand_end"):
        mirror(dataclasses.replace(motion, skeleton=skeleton))


@pytest.mark.parametrize("name", ["beat/2_scott_0_1_1.bvh", "zeggs/067_Speech_2_x_1_0.bvh"])
def test_real_rigs(shared, name):
    motion = read_bvh(shared / name)
    rig = find_rig(motion)
    pairs = list(mirror_pairs(rig))
    image = (places(motion) * [-1, 1, 1])[:, pairs]
    mirrored = mirror(motion, rig, keep_skeleton=False)
    np.testing.assert_allclose(places(mirrored), image, atol=1e-4)
    assert np.abs(places(mirror(motion, rig)) - image).max() < 0.05
    assert angle(world(mirror(mirror(motion, rig), rig)), world(motion)) < 0.05
