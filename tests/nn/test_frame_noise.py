"""Noise and draws that belong to absolute frames, not to windows."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from a2g_jax.nn.noise import BLOCK, blended_draws, frame_normal

KEY = jax.random.key(3)
normal = partial(jax.jit(frame_normal, static_argnums=(2, 3)), KEY)


@partial(jax.jit, static_argnums=(3, 4))
def draws(key, table, start, frames, period):
    return blended_draws(key, table, start, frames, period)


def start_at(frame):
    return jnp.int32(frame)


class TestFrameNormal:
    def test_the_same_frame_in_any_window(self):
        long = np.asarray(normal(start_at(-2 * BLOCK), 5 * BLOCK, 3))
        for block, frames in ((-2, 200), (-1, 200), (1, 200), (2, 7)):
            part = normal(start_at(block * BLOCK), frames, 3)
            assert part.shape == (frames, 3)
            first = (block + 2) * BLOCK
            np.testing.assert_array_equal(part, long[first : first + frames])

    def test_a_window_may_begin_within_a_block(self):
        long = np.asarray(normal(start_at(-BLOCK), 4 * BLOCK, 3))
        for start, frames in ((-127, 9), (-1, 3), (5, 7), (100, 60), (127, 130)):
            np.testing.assert_array_equal(normal(start_at(start), frames, 3), long[start + BLOCK :][:frames])

    def test_no_two_blocks_are_alike(self):
        blocks = np.asarray(normal(start_at(-2 * BLOCK), 5 * BLOCK, 3)).reshape(5, -1)
        correlation = np.corrcoef(blocks) - np.eye(5)
        assert np.abs(correlation).max() < 0.25

    def test_is_standard_normal(self):
        values = np.asarray(normal(start_at(0), 5 * BLOCK, 3)).ravel()
        assert stats.kstest(values, "norm").pvalue > 0.01

    def test_the_key_decides(self):
        other = jax.jit(frame_normal, static_argnums=(2, 3))(jax.random.key(4), start_at(0), 7, 3)
        assert np.abs(other - normal(start_at(0), 7, 3)).max() > 0.1


class TestBlendedDraws:
    table = (np.arange(50, dtype=np.float32)[:, None], 10 * np.arange(50, dtype=np.float32)[:, None])

    def test_period_zero_is_one_row(self):
        first = [draws(KEY, self.table, start_at(start), 9, 0) for start in (-128, 0, 1280)]
        for values, tens in first:
            assert values.shape == (9, 1)
            assert np.ptp(values) == 0
            assert values[0, 0] in self.table[0]
            np.testing.assert_array_equal(values, first[0][0])
            np.testing.assert_array_equal(tens, 10 * values)

    def test_period_zero_varies_with_the_key(self):
        rows = {float(draws(jax.random.key(n), self.table, start_at(0), 9, 0)[0][0, 0]) for n in range(10)}
        assert len(rows) > 5

    def test_windows_agree(self):
        long = np.asarray(draws(KEY, self.table, start_at(-60), 240, 20)[0])
        for start in (-67, -7, 0, 13, 20):
            part = np.asarray(draws(KEY, self.table, start_at(start), 240, 20)[0])
            first, stop = max(start, -60), min(start + 240, 180)
            np.testing.assert_allclose(part[first - start : stop - start], long[first + 60 : stop + 60], atol=1e-4)

    def test_is_a_row_at_each_period_and_turns_into_the_next(self):
        values, tens = (np.asarray(v)[:, 0] for v in draws(KEY, self.table, start_at(-60), 240, 20))
        knots = values[::20]
        np.testing.assert_allclose(knots, np.round(knots), atol=1e-4)
        assert len(set(np.round(knots))) > 4
        np.testing.assert_allclose(values[:220], self.turned(knots, 20), atol=1e-3)
        np.testing.assert_allclose(tens, 10 * values, rtol=1e-4, atol=1e-3)

    def turned(self, knots, period):
        """Between knots a quarter of a turn, about the mean of the table."""
        mean = float(np.mean(self.table[0]))
        angle = 0.5 * np.pi * np.arange(period) / period
        pairs = zip(knots[:-1], knots[1:], strict=True)
        return np.concatenate([mean + (a - mean) * np.cos(angle) + (b - mean) * np.sin(angle) for a, b in pairs])

    def test_the_variance_is_the_same_between_rows(self):
        keys, table = jax.random.split(KEY, 2000), jax.tree.map(jnp.asarray, self.table)
        one = jax.jit(jax.vmap(lambda key: blended_draws(key, table, start_at(0), 20, 20)[0][:, 0]))
        spread = np.asarray(one(keys)).std(axis=0)
        np.testing.assert_allclose(spread, np.std(self.table[0]), rtol=0.06)

    def test_every_row_is_drawn(self):
        """Uniformly: a chi-squared test over many keys."""
        table = (jnp.arange(5.0)[:, None],)
        keys = jax.random.split(KEY, 300)
        rows = jax.jit(jax.vmap(lambda key: blended_draws(key, table, start_at(0), 1, 0)[0][0, 0]))(keys)
        assert stats.chisquare(np.bincount(np.asarray(rows, int), minlength=5)).pvalue > 0.01

    def test_far_into_a_long_audio(self):
        """Two hours at 30 fps: float32 still resolves frames within a period."""
        start = 216_000
        values = np.asarray(draws(KEY, self.table, start_at(start), 240, 20)[0])[:, 0]
        knots = values[::20]
        np.testing.assert_allclose(values[:220], self.turned(knots, 20), atol=0.1)


def test_a_table_of_one_row_never_changes():
    table = {"mean": np.full((1, 3), 7.0, np.float32), "std": np.ones((1, 2), np.float32)}
    result = draws(KEY, table, start_at(-40), 90, 20)
    np.testing.assert_allclose(result["mean"], np.full((90, 3), 7.0))
    np.testing.assert_allclose(result["std"], np.ones((90, 2)))
