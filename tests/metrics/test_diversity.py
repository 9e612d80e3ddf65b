"""Diversity and multimodality beside loops over pairs."""

from itertools import combinations

import numpy as np
import pytest

from a2g_jax.metrics import diversity as m


def motions(seed, count=5, frames=7):
    """Random motions of three joints."""
    return np.random.default_rng(seed).normal(size=(count, frames, 3, 3)).astype(np.float32)


def distance(a, b):
    """Mean L1 norm of a joint's difference."""
    return np.abs(a - b).sum(axis=-1).mean()


@pytest.mark.parametrize("count", [2, 5, 20])
def test_multimodality_is_the_published_sum(count):
    several = motions(0, count)
    total = sum(distance(a, b) for a, b in combinations(several, 2))
    assert m.multimodality(several) == pytest.approx(total / (count * np.ceil(count / 2)), rel=1e-5)
    assert m.mean_pair_distance(several) == pytest.approx(total / (count * (count - 1) / 2), rel=1e-5)


def test_for_twenty_motions_the_paper_prints_95_percent_of_the_mean():
    assert m.paper_factor(20) == pytest.approx(0.95)


def test_diversity_compares_clips_of_one_motion():
    motion = motions(1, 1, 234)[0]
    clips = [motion[start : start + 50] for start in (0, 50, 100, 150)]
    total = sum(distance(a, b) for a, b in combinations(clips, 2))
    assert m.diversity(motion) == pytest.approx(total / (4 * 2), rel=1e-5)
    assert m.diversity(np.tile(motion[:50], (3, 1, 1))) == 0.0
    with pytest.raises(ValueError, match="two motions or more; got 1"):
        m.diversity(motion[:99])


def test_moving_all_together_changes_nothing():
    several = motions(2)
    moved = several + np.float32(3.0)
    assert m.multimodality(moved) == pytest.approx(m.multimodality(several), rel=1e-4)


class TestL1Div:
    def test_is_the_spread_about_the_mean_and_leaves_its_input_alone(self):
        motion = motions(3, 1, 40)[0]
        before = motion.copy()
        assert m.l1_div(motion, root=None) == pytest.approx(np.abs(motion - motion.mean(axis=0)).sum() / 40, rel=1e-5)
        np.testing.assert_array_equal(motion, before)

    def test_walking_counts_only_where_the_root_is_left_in(self):
        motion = motions(4, 1, 40)[0]
        walking = motion + np.linspace(0, 20, 40, dtype=np.float32)[:, None, None]
        assert m.l1_div(walking) == pytest.approx(m.l1_div(motion), rel=1e-4)
        assert m.l1_div(walking, root=None) > 5 * m.l1_div(motion, root=None)
