"""Semantic recall: the bounded form and the published one."""

import numpy as np
import pytest

from a2g_jax.metrics import semantic as m


def test_a_perfect_motion_is_one_and_by_the_published_form_six():
    motion = np.random.default_rng(0).normal(size=(40, 5, 3)).astype(np.float32)
    relevant = np.ones(40, np.float32)
    assert float(m.srgr(motion, motion, relevant)) == 1.0
    assert float(m.srgr_published(motion, motion, relevant)) == pytest.approx(1 / 0.165)


def test_frames_count_by_their_relevance():
    random = np.random.default_rng(1)
    a, b = random.normal(size=(2, 30, 4, 3)).astype(np.float32)
    weights = random.uniform(size=30).astype(np.float32)
    correct = [np.mean([np.linalg.norm(a[t, j] - b[t, j]) < 2.0 for j in range(4)]) for t in range(30)]
    assert float(m.srgr(a, b, weights, 2.0)) == pytest.approx(np.average(correct, weights=weights), rel=1e-5)
    assert float(m.srgr_published(a, b, weights, 2.0)) == pytest.approx(np.mean(correct * weights) / 0.165, rel=1e-5)
    only = np.zeros(30, np.float32)
    only[7] = 0.3
    assert float(m.srgr(a, b, only, 2.0)) == pytest.approx(correct[7])


def test_nothing_to_score_is_nan():
    motion = np.zeros((5, 2, 3), np.float32)
    assert np.isnan(m.srgr(motion, motion, np.zeros(5, np.float32)))
    broken = motion.copy()
    broken[1, 0, 0] = np.nan
    assert np.isnan(m.srgr(broken, motion, np.ones(5, np.float32)))
