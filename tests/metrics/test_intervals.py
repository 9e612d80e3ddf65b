"""Intervals: known values, coverage, properties, and no interval of too few."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from a2g_jax.metrics import intervals as m
from a2g_jax.metrics.pooled import MOST_PARTS, jackknife, pooled_mean, pooled_quantile

some_values = st.lists(st.floats(-100.0, 100.0), min_size=5, max_size=30).map(np.array)
seeds = st.integers(0, 10_000)


def clustered(seed, groups=8):
    """Values of clips with their recordings, of different numbers."""
    rng = np.random.default_rng(seed)
    owner = np.repeat(np.arange(groups), rng.integers(1, 6, groups))
    return rng.normal(size=groups)[owner] + rng.normal(size=len(owner)), owner


@settings(deadline=None)
@given(some_values)
def test_a_mean_has_the_interval_of_scipy(values):
    found = m.mean_interval(values)
    error = np.std(values, ddof=1) / np.sqrt(len(values))
    low, high = stats.t.interval(0.95, len(values) - 1, values.mean(), max(error, 1e-300))
    np.testing.assert_allclose(found[:3], (values.mean(), low, high), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("count", [5, 10, 30])
def test_a_normal_mean_is_held_with_the_stated_probability(count):
    """The percentile bootstrap holds it in 0.85 of the cases at 5 and in 0.90 at 10."""
    rng = np.random.default_rng(count)
    found = [m.mean_interval(rng.normal(3.0, 2.0, count)) for _ in range(2000)]
    assert np.mean([one.low <= 3.0 <= one.high for one in found]) == pytest.approx(0.95, abs=0.016)


def test_clips_of_a_recording_are_not_counted_as_independent():
    rng = np.random.default_rng(1)
    owner = np.repeat(np.arange(10), 6)
    held = {True: 0, False: 0}
    for _ in range(500):
        values = rng.normal(size=10)[owner] + rng.normal(size=60)
        for grouped in held:
            found = m.mean_interval(values, owner if grouped else None)
            held[grouped] += found.low <= 0.0 <= found.high
    assert held[True] / 500 == pytest.approx(0.95, abs=0.03)
    assert held[False] / 500 < 0.8


@settings(deadline=None)
@given(seeds)
def test_of_equal_groups_the_interval_is_that_of_their_means(seed):
    values = np.random.default_rng(seed).normal(size=(7, 4))
    found = m.mean_interval(values.ravel(), np.repeat(np.arange(7), 4))
    np.testing.assert_allclose(found, m.mean_interval(values.mean(axis=1)), rtol=1e-9)


@settings(deadline=None)
@given(seeds, st.floats(0.01, 100.0), st.floats(-50.0, 50.0), st.booleans())
def test_intervals_move_and_stretch_with_their_values(seed, scale, shift, turn):
    values, owner = clustered(seed)
    scale = -scale if turn else scale
    before, after = m.mean_interval(values, owner), m.mean_interval(scale * values + shift, owner)
    ends = [scale * end + shift for end in (before.low, before.high)]
    np.testing.assert_allclose((after.low, after.high), sorted(ends), rtol=1e-7, atol=1e-7)


@settings(deadline=None)
@given(seeds)
def test_the_order_of_clips_and_the_names_of_recordings_do_not_matter(seed):
    values, owner = clustered(seed)
    order = np.random.default_rng(seed).permutation(len(values))
    names = np.array([f"take {9 - one}" for one in owner])
    np.testing.assert_allclose(
        m.mean_interval(values[order], names[order]), m.mean_interval(values, owner), rtol=1e-9, atol=1e-12
    )


@settings(deadline=None)
@given(st.integers(0, 12))
def test_fewer_than_five_recordings_have_no_interval(count):
    """Neither do their differences, shares, quantiles and sets; the mean is there."""
    rng = np.random.default_rng(count)
    values = rng.normal(size=3 * count)
    owner = np.repeat(np.arange(count), 3)
    found = [m.mean_interval(values, owner), m.difference_interval(values, 0 * values, owner)]
    if count:
        parts = list(values.reshape(count, 3))
        found += [m.share_interval(np.ones(count), np.full(count, 2)), pooled_mean(parts), pooled_quantile(parts, 0.5)]
        found.append(jackknife(lambda chosen: float(np.mean([parts[one] for one in chosen])), count))
    for one in found:
        assert one.clips == count
        assert np.isnan(one.low) == np.isnan(one.high) == (count < m.LEAST)
        assert np.isnan(one.mean) == (count == 0)
        assert (one.to_json()["low"] is None) == (count < m.LEAST)


def test_nan_is_left_out_and_equal_values_have_no_spread():
    assert m.mean_interval(np.array([1.0, np.nan, 3.0]))[::3] == (2.0, 2)
    assert m.mean_interval(np.zeros(0)).clips == 0
    same = np.arange(10.0) / 3.0
    assert m.difference_interval(same + 1.0, same)[:3] == pytest.approx((1.0, 1.0, 1.0))
    assert m.mean_interval(np.full(9, 1e6 + 0.1))[:3] == pytest.approx((1e6 + 0.1,) * 3, rel=1e-12)


class TestShares:
    def test_of_single_clips_it_is_wilsons_with_students_quantile(self):
        hits = np.array([1] * 8 + [0] * 2)
        found = m.share_interval(hits, np.ones(10))
        t = stats.t.ppf(0.975, 9)
        middle = (0.8 + t**2 / 20) / (1 + t**2 / 10)
        half = t * np.sqrt(0.8 * 0.2 / 10 + t**2 / 400) / (1 + t**2 / 10)
        # The spread over groups has n - 1 in its denominator: the effective number is at least that of groups.
        np.testing.assert_allclose(found[:3], (0.8, middle - half, middle + half))

    @settings(deadline=None)
    @given(st.lists(st.integers(0, 8), min_size=5, max_size=20))
    def test_it_stays_within_zero_and_one_and_holds_the_share(self, hits):
        found = m.share_interval(np.array(hits), np.full(len(hits), 8))
        assert 0.0 <= found.low <= found.mean + 1e-12
        assert found.mean - 1e-12 <= found.high <= 1.0
        assert found.high - found.low > 0.01
        turned = m.share_interval(8 - np.array(hits), np.full(len(hits), 8))
        np.testing.assert_allclose((turned.low, turned.high), (1 - found.high, 1 - found.low), atol=1e-9)

    def test_all_hits_are_no_certainty(self):
        found = m.share_interval(np.full(6, 8), np.full(6, 8))
        assert found.mean == found.high == 1.0
        assert 0.4 < found.low < 0.6

    def test_recordings_that_agree_within_are_few(self):
        alike, mixed = (m.share_interval(hits, np.full(10, 8)) for hits in (np.array([8, 0] * 5), np.full(10, 4)))
        assert alike.high - alike.low > 2.0 * (mixed.high - mixed.low)

    def test_the_share_is_held_about_as_often_as_stated(self):
        rng = np.random.default_rng(0)
        found = [m.share_interval(rng.binomial(8, rng.beta(3.6, 0.4, 12)), np.full(12, 8)) for _ in range(1000)]
        assert np.mean([one.low <= 0.9 <= one.high for one in found]) > 0.91


class TestPooled:
    @settings(max_examples=30, deadline=None)
    @given(seeds, st.sampled_from([0.1, 0.3, 0.5, 0.9, 0.99]))
    def test_quantiles_are_those_of_all_values_and_keep_monotone_maps(self, seed, share):
        rng = np.random.default_rng(seed)
        groups = [rng.normal(rng.normal(), 1.0, rng.integers(1, 40)) for _ in range(8)]
        values = np.sort(np.concatenate(groups))
        found = pooled_quantile(groups, share)
        assert found.mean == values[int(np.ceil(share * len(values) - 1e-9)) - 1]
        assert found.low <= found.mean <= found.high
        mapped = pooled_quantile([np.exp(group) for group in groups], share)
        np.testing.assert_allclose(mapped[:3], np.exp(found[:3]))

    def test_a_quantile_is_held_about_as_often_as_stated(self):
        rng = np.random.default_rng(0)
        found = []
        for _ in range(400):
            levels = rng.normal(size=12)
            found.append(pooled_quantile([rng.normal(level, 1.0, 50) for level in levels], 0.5))
        assert np.mean([one.low <= 0.0 <= one.high for one in found]) > 0.91

    def test_many_groups_are_left_out_in_parts(self):
        calls = []
        values = np.random.default_rng(0).normal(size=100)
        found = jackknife(lambda chosen: calls.append(len(chosen)) or float(values[list(chosen)].mean()), 100)
        assert len(calls) == MOST_PARTS + 1
        assert set(calls[1:]) == {95}
        assert found.clips == 100
        error = values.std(ddof=1) / 10
        assert found.high - found.mean == pytest.approx(stats.t.ppf(0.975, 19) * error, rel=0.4)
