"""The joint tree: what is refused, and what it answers."""

import jax
import numpy as np
import pytest

from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton, tree_levels


def toy(names=("hips", "spine", "arm"), parents=(-1, 0, 1), ends=((2, (0.0, 0.1, 0.2)),)):
    return Skeleton(np.arange(9, dtype=np.float32).reshape(3, 3), names, parents, ends)


@pytest.mark.parametrize(
    ("names", "parents", "message"),
    [
        (("a", "b", "c"), (-1, 0), "2 parents for 3 names"),
        ((), (), "joint 0 to be the root"),
        (("a", "b", "c"), (0, 0, 0), "joint 0 to be the root"),
        (("a", "b", "c"), (-1, 2, 0), "parent of joint 1 \\(b\\)"),
        (("a", "b", "c"), (-1, 0, 2), "parent of joint 2 \\(c\\)"),
        (("a", "b", "c"), (-1, -1, 0), "parent of joint 1 \\(b\\)"),
        (("a", "b", "a"), (-1, 0, 0), "unique joint names; got a more than once"),
    ],
)
def test_a_wrong_tree_is_refused(names, parents, message):
    with pytest.raises(ValueError, match=message):
        toy(names, parents)


def test_levels():
    assert tree_levels((-1, 0, 0, 1, 3, 2)) == ((0,), (1, 2), (3, 5), (4,))
    assert tree_levels((-1,)) == ((0,),)
    assert toy().levels == ((0,), (1,), (2,))
    levels = tree_levels(BODY_PARENTS)
    assert sorted(joint for level in levels for joint in level) == list(range(22))
    for above, level in zip(levels, levels[1:], strict=False):
        assert all(BODY_PARENTS[joint] in above for joint in level)


def test_index_names_the_joints_there_are():
    assert toy().index("arm") == 2
    with pytest.raises(KeyError, match="hips, spine, arm"):
        toy().index("leg")


def test_scaled():
    scaled = toy().scaled(0.01)
    np.testing.assert_allclose(scaled.offsets, toy().offsets * 0.01)
    assert scaled.ends[0][0] == 2
    np.testing.assert_allclose(scaled.ends[0][1], (0, 0.001, 0.002))
    assert scaled.same_tree(toy())


def test_same_tree():
    assert not toy().same_tree(toy(names=("hips", "spine", "leg")))
    assert not toy().same_tree(toy(parents=(-1, 0, 0)))


def test_is_a_pytree_with_the_offsets_as_its_only_leaf():
    leaves, tree = jax.tree.flatten(toy())
    assert len(leaves) == 1
    doubled = jax.tree.map(lambda x: 2 * x, toy())
    np.testing.assert_array_equal(doubled.offsets, 2 * np.asarray(toy().offsets))
    assert doubled.same_tree(toy())
    assert doubled.ends == toy().ends
    assert tree != jax.tree.structure(toy(parents=(-1, 0, 0)))


def test_the_body_is_a_valid_tree():
    skeleton = Skeleton(np.zeros((22, 3), np.float32), BODY_JOINTS, BODY_PARENTS)
    assert skeleton.joints == 22
    for left in (name for name in BODY_JOINTS if name.startswith("L_")):
        right = skeleton.index(left.replace("L_", "R_"))
        above = BODY_JOINTS[BODY_PARENTS[skeleton.index(left)]]
        assert BODY_JOINTS[BODY_PARENTS[right]] == above.replace("L_", "R_")
