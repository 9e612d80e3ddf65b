"""Lower rates: pooling and interpolation."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.nn.rates import adaptive_reach, adaptively_smoothed, interpolated, pooled, shifted, smoothed


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 5), st.integers(1, 9), st.integers(0, 2**31))
def test_pooling_a_linear_sequence_gives_its_centres_and_interpolation_restores_the_inside(steps, frames, seed):
    """Linear sequences survive but for half a step at both ends, where there is no neighbour."""
    rng = np.random.default_rng(seed)
    line = rng.normal(size=2) + np.arange(steps * frames)[:, None] * rng.normal(size=2)
    low = pooled(jnp.asarray(line, jnp.float32)[None], frames)
    assert low.shape == (1, steps, 2)
    again = np.asarray(interpolated(low, frames))[0]
    assert again.shape == line.shape
    inside = slice(frames // 2, len(line) - frames // 2)
    np.testing.assert_allclose(again[inside], line[inside], atol=1e-4, rtol=1e-4)
    np.testing.assert_allclose(again[: frames // 2], np.tile(np.asarray(low)[0, :1], (frames // 2, 1)), atol=1e-5)


def test_a_frame_depends_on_its_own_step_and_its_nearer_neighbour():
    steps = jnp.asarray(np.random.default_rng(0).normal(size=(1, 6, 1)), jnp.float32)
    moved = steps.at[0, 3].add(1.0)
    change = np.abs(np.asarray(interpolated(moved, 4) - interpolated(steps, 4)))[0, :, 0]
    assert (change[12:16] > 0.5).all()
    np.testing.assert_array_equal(change > 0, np.r_[np.zeros(10), np.ones(8), np.zeros(6)].astype(bool))


def test_groups_of_one_are_the_sequence_and_a_remainder_is_refused():
    x = jnp.ones((2, 7, 3))
    assert pooled(x, 1) is x
    assert interpolated(x, 1) is x
    with pytest.raises(ValueError, match="multiple of 4 frames; got 7"):
        pooled(x, 4)


def test_smoothing_removes_what_alternates_and_keeps_constants():
    frames = np.arange(40)
    fast, slow = (-1.0) ** frames, np.cos(2 * np.pi * frames / 4)
    x = jnp.asarray(np.stack([fast, slow, np.full(40, 2.0)], axis=-1)[None], jnp.float32)
    once = np.asarray(smoothed(x, 1))[0, 1:-1]
    np.testing.assert_allclose(once[:, 0], 0.0, atol=1e-6)
    np.testing.assert_allclose(once[:, 1], 0.5 * slow[1:-1], atol=1e-6)
    np.testing.assert_allclose(smoothed(x, 3)[..., 2], 2.0)
    assert smoothed(x, 0) is x


def test_each_sequence_is_delayed_by_its_own_number_of_frames():
    x = jnp.asarray(np.arange(6.0)[None, :, None].repeat(3, axis=0))
    late, same, early = np.asarray(shifted(x, jnp.asarray([2, 0, -3])))[..., 0]
    np.testing.assert_array_equal(late, [0, 0, 0, 1, 2, 3])
    np.testing.assert_array_equal(same, range(6))
    np.testing.assert_array_equal(early, [3, 4, 5, 5, 5, 5])
    assert shifted(x, None) is x


def test_adaptive_smoothing_smooths_what_is_slow_and_keeps_what_is_fast():
    alternating = jnp.asarray(np.tile([0.01, -0.01], 30)[None, :, None], jnp.float32)
    wave = np.sin(2 * np.pi / 8 * np.arange(60))[None, :, None]
    slight, swing = (jnp.asarray(scale * wave, jnp.float32) for scale in (0.01, 10.0))
    inner = slice(8, -8)
    # What alternates vanishes at any speed, and what repeats every eight frames only where it is slow.
    for speed in (1.0, 1e-6):
        assert np.abs(adaptively_smoothed(alternating, 4, speed)[0, inner]).max() < 1e-4
    kept = np.asarray(adaptively_smoothed(slight, 4, 1.0))[0, inner]
    np.testing.assert_allclose(kept, np.cos(np.pi / 8) ** 8 * np.asarray(slight)[0, inner], atol=1e-5)
    fast = np.asarray(adaptively_smoothed(swing, 4, 0.1))[0, inner]
    np.testing.assert_allclose(fast, np.asarray(swing)[0, inner], rtol=0.03, atol=0.05)
    # Each channel has a weight of its own, and its own speed.
    both = jnp.concatenate([slight, swing], axis=-1)
    again = np.asarray(adaptively_smoothed(both, 4, np.array([1.0, 0.1], np.float32)))[0, inner]
    np.testing.assert_allclose(again, np.concatenate([kept, fast], axis=-1), atol=1e-6)


@pytest.mark.parametrize("passes", [1, 4, 6])
def test_adaptive_smoothing_reaches_as_far_as_stated(passes):
    x = np.random.default_rng(0).standard_normal((1, 41, 2)).astype(np.float32)
    moved = x.copy()
    moved[0, 20] += 5.0
    apart = np.abs(
        np.asarray(
            adaptively_smoothed(jnp.asarray(moved), passes, 0.5) - adaptively_smoothed(jnp.asarray(x), passes, 0.5)
        )
    )
    rows = np.flatnonzero(apart[0].max(axis=-1) > 0)
    assert rows.min() >= 20 - adaptive_reach(passes)
    assert rows.max() <= 20 + adaptive_reach(passes)
    assert rows.max() - 20 == adaptive_reach(passes)  # and no less
